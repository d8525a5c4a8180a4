"""The explorer with answers that are not as they should be, from a service that is played."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from urllib.parse import quote

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Browser, Route, expect

from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store
from tests.support.service_running import running
from tests.support.watched_page import Watched
from tests.support.watching import until

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

AT_ONCE = 4  # tiles that are asked for
STRUCTURE = {"natural_frequencies": [1.0], "damping_ratios": [0.1]}


def answer(route: Route, content: bytes, media_type: str) -> None:
    headers = {"Location": f"/v1/jobs/{'a' * 64}", "Preference-Applied": "wait=1, return=representation"}
    route.fulfill(status=200, body=content, headers={**headers, "Content-Type": media_type})


def npz_of_another_program() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, a=np.zeros(3))
    return buffer.getvalue()


@pytest.fixture
def address(redis_server: RedisServer, store: Store) -> Iterator[str]:
    """A service without workers."""
    with running(ServiceSettings(redis_url=redis_server.url)) as url:
        yield url


@pytest.fixture
def page(browser: Browser) -> Iterator[Watched]:
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    watched = Watched(context.new_page())
    watched.page.route(
        "**/v1/**", lambda route: route.fulfill(status=404, body="{}", headers={"Content-Type": "application/json"})
    )
    structure = json.dumps(STRUCTURE).encode()
    watched.page.route("**/v1/structures", lambda route: answer(route, structure, "application/json"))
    yield watched
    context.close()


@pytest.mark.parametrize("content", [b"", b"PK damaged", npz_of_another_program()], ids=["empty", "damaged", "foreign"])
def test_the_page_goes_on_after_maps_that_cannot_be_read(page: Watched, address: str, content: bytes) -> None:
    page.page.route("**/v1/unfolding-maps", lambda route: answer(route, content, "application/x-npz"))
    page.page.goto(address)

    def asked() -> int:
        page.page.wait_for_timeout(100)
        return len({json.dumps(body) for body in page.posted("unfolding-maps")})

    until(lambda: asked() > 2 * AT_ONCE, 60)
    expect(page.page.locator("#progress.done")).to_be_attached(timeout=60_000)
    expect(page.page.locator("#says")).to_contain_text("failed")
    expect(page.page.locator("#says")).not_to_contain_text("Refining")


def test_the_list_of_jobs_is_asked_for_once_at_a_time(page: Watched, address: str) -> None:
    jobs = json.dumps({"jobs": [], "links": []})
    page.page.route("**/v1/jobs?*", lambda route: route.fulfill(status=200, body=jobs))
    page.page.goto(address)
    for _ in range(11):
        page.page.evaluate("document.getElementById('jobs-section').toggleAttribute('open')")
        page.page.wait_for_timeout(50)

    def asked() -> int:
        return sum("/v1/jobs?" in request.url for request in page.requests)

    before = asked()
    page.page.wait_for_timeout(5000)
    assert 1 <= asked() - before <= 3


def test_the_list_of_jobs_has_those_whose_requests_are_too_long_for_lists(page: Watched, address: str) -> None:
    plane = {"omega": [1.0 + place / 4096 for place in range(4000)], "clearance": [1.0, 1.1]}
    job = httpx2.post(f"{address}/v1/unfolding-maps", json=plane).json()["id"]
    page.page.route("**/v1/jobs?*", lambda route: route.continue_())
    page.page.goto(address)
    page.page.evaluate("document.getElementById('jobs-section').open = true")
    expect(page.page.locator(f'#jobs a[href="v1/jobs/{job}"]')).to_have_text("unfolding maps", timeout=30_000)


def test_a_machine_of_the_address_with_unknown_stops_is_drawn(page: Watched, address: str) -> None:
    page.page.goto(f"{address}#machine={quote(json.dumps({'stops': 'above'}))}")
    expect(page.page.locator("#sketch *").first).to_be_attached(timeout=30_000)
    assert page.page.locator("#error-machine").text_content() == ""
