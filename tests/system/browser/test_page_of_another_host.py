"""The example of docs/languages.md for pages: it is served by another host, and draws a curve of the service."""

from __future__ import annotations

import functools
import http.server
import math
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests.support.running_stack import RunningStack
from tests.support.watched_page import Watched

pytestmark = pytest.mark.browser

EXAMPLES = Path(__file__).parents[3] / "examples" / "languages"
# of the curve in the example
POINTS = 400


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def origin() -> Iterator[str]:
    """A host with the example."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=EXAMPLES)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def service(origin: str) -> Iterator[str]:
    """A stack that allows pages of this host."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("GRAZEMAP_CORS_ORIGINS", origin)
        stack = RunningStack()
    yield stack.url
    stack.stop()


@pytest.fixture
def watched(browser: Browser) -> Iterator[Watched]:
    context = browser.new_context()
    yield Watched(context.new_page())
    context.close()


def test_a_page_of_an_allowed_host_draws_the_curve(watched: Watched, origin: str, service: str) -> None:
    page = watched.page
    page.goto(f"{origin}/grazing_curve.html?service={service}")
    expect(page.locator("polyline")).to_be_attached(timeout=60_000)
    points = page.locator("polyline").get_attribute("points") or ""
    x, y = zip(*(map(float, point.split(",")) for point in points.split()), strict=True)
    assert (x[0], x[-1], min(y)) == (0, 540, 0)
    assert list(x) == sorted(x)
    assert len(x) == POINTS
    # one mass: the peak is at its natural frequency
    natural = math.sqrt(2000 / 0.5) / (2 * math.pi)
    assert math.isclose(x[y.index(0)] / 540, (natural - 6) / 8, abs_tol=0.01)
    expect(page.locator("figcaption")).to_contain_text(f"{natural:.1f} Hz")
    expect(page.locator("svg")).to_contain_text("clearance in mm")
    expect(page.locator("li")).to_have_count(0)
    assert watched.complaints == []


def altered(page: Page, before: str, after: str) -> None:
    """Change a part of the example's request on its way."""

    def on_its_way(route: Route) -> None:
        asked = route.request.post_data
        route.continue_(post_data=asked.replace(before, after) if asked else None)

    page.route("**/v1/grazing-curves", on_its_way)


def test_a_page_shows_the_notes_on_a_request(watched: Watched, origin: str, service: str) -> None:
    page = watched.page
    altered(page, ',"restitution":0.7', "")
    page.goto(f"{origin}/grazing_curve.html?service={service}")
    expect(page.locator("li")).to_have_count(1, timeout=60_000)
    expect(page.locator("li")).to_contain_text("restitution")


def test_a_page_follows_a_job_that_takes_long(watched: Watched, origin: str, service: str) -> None:
    """Answers to POST do not wait, as if the job took long."""
    page = watched.page
    streams: list[str] = []
    page.on("request", lambda request: streams.append(request.url) if request.url.endswith("/events") else None)

    def at_once(route: Route) -> None:
        if route.request.method != "POST":
            return route.continue_()
        answer = route.fetch()
        return route.fulfill(response=answer, json={**answer.json(), "status": "running"})

    page.route("**/v1/grazing-curves", at_once)
    page.goto(f"{origin}/grazing_curve.html?service={service}")
    expect(page.locator("polyline")).to_be_attached(timeout=60_000)
    assert len(streams) == 1


def test_a_page_shows_the_errors_of_a_request(watched: Watched, origin: str, service: str) -> None:
    page = watched.page
    altered(page, '"masses":[0.5]', '"masses":[-0.5]')
    page.goto(f"{origin}/grazing_curve.html?service={service}")
    expect(page.locator("figcaption")).to_contain_text("/oscillator/masses/0: ", timeout=60_000)
    expect(page.locator("polyline")).to_have_count(0)


def test_a_page_of_another_host_is_told_that_it_may_not(watched: Watched, url: str, origin: str) -> None:
    """`url` is a stack without the setting."""
    page = watched.page
    page.goto(f"{origin}/grazing_curve.html?service={url}")
    expect(page.locator("figcaption")).to_contain_text(f"GRAZEMAP_CORS_ORIGINS={origin}")
    expect(page.locator("polyline")).to_have_count(0)
