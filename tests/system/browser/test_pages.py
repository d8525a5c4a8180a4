"""The docs page in a real browser, without internet: it shows every operation and runs it."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from grazemap.wire import PROCESSES
from grazemap_service.middleware import GUIDE
from grazemap_service.settings import ServiceSettings
from tests.support.service_running import running
from tests.support.watched_page import Watched

pytestmark = pytest.mark.browser

# The first start on a machine compiles every kernel.
START_SECONDS = 240
# Of the main thread, until the page shows the first operation: half of the two seconds that this may take.
OPENING_SECONDS = 1.0
# Of the workers, for the example of a process.
EXAMPLE_SECONDS = 5.0
# Pages for all operations: a page with all of them unfolded is slow.
PARTS = 4


def open_docs(page: Page, url: str) -> None:
    page.set_viewport_size({"width": 1280, "height": 1600})
    page.goto(f"{url}/docs")
    page.locator(".opblock").first.wait_for()


def operation(page: Page, path: str) -> Locator:
    return page.locator(".opblock", has=page.locator(f'[data-path="{path}"]'))


def described(url: str) -> dict[str, Any]:
    document: dict[str, Any] = httpx2.get(f"{url}/openapi.json").json()
    return document


@pytest.mark.timeout(START_SECONDS)
@pytest.mark.parametrize("part", range(PARTS))
def test_the_docs_page_shows_every_operation(watched: Watched, url: str, part: int) -> None:
    page = watched.page
    open_docs(page, url)
    expected = {(method.upper(), path) for path, operations in described(url)["paths"].items() for method in operations}
    blocks = page.locator(".opblock")
    expect(blocks).to_have_count(len(expected))
    shown = {
        (
            block.locator(".opblock-summary-method").inner_text(),
            block.locator(".opblock-summary-path").get_attribute("data-path"),
        )
        for block in blocks.all()
    }
    assert shown == expected
    # unfolded, each shows its parameters or body and its responses
    for block in blocks.all()[part::PARTS]:
        block.locator(".opblock-summary-control").click()
        expect(block.locator(".responses-wrapper")).to_be_visible()
        block.locator(".opblock-summary-control").click()
    expect(page.locator(".errors-wrapper")).to_have_count(0)


def test_the_docs_page_opens_soon(watched: Watched, url: str) -> None:
    page = watched.page
    session = page.context.new_cdp_session(page)
    # the processor time of the page, which other processes of the machine do not lengthen
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    open_docs(page, url)
    measured = {metric["name"]: metric["value"] for metric in session.send("Performance.getMetrics")["metrics"]}
    assert 0 < measured["TaskDuration"] < OPENING_SECONDS


def test_the_docs_page_leads_to_the_explorer_and_the_guide(watched: Watched, url: str) -> None:
    page = watched.page
    open_docs(page, url)
    links = page.locator(".info .description a")
    assert [link.evaluate("link => link.href") for link in links.all()] == [f"{url}/", f"{url}{GUIDE}/"]


def test_an_operation_shows_the_fields_of_its_request_and_of_its_job(watched: Watched, url: str) -> None:
    page = watched.page
    open_docs(page, url)
    block = operation(page, "/v1/trajectories")
    block.locator(".opblock-summary-control").click()
    block.locator(".request-body, .opblock-section-request-body").first.get_by_role("tab", name="Schema").click()
    expect(block).to_contain_text("transient_periods")
    expect(block).to_contain_text("restitution")
    expect(block.locator(".errors-wrapper")).to_have_count(0)


def test_the_fields_of_a_result_are_shown_under_schemas(watched: Watched, url: str) -> None:
    page = watched.page
    open_docs(page, url)
    schemas = page.locator(".models")
    schemas.locator(".models-control").click()
    schemas.get_by_role("button", name="GrazingCurveResult", exact=True).click()
    expect(schemas).to_contain_text("first_recurrence")


def test_try_it_out_runs_an_operation(watched: Watched, url: str) -> None:
    page = watched.page
    open_docs(page, url)
    block = operation(page, "/v1/grazing-curves")
    block.locator(".opblock-summary-control").click()
    block.get_by_role("button", name="Try it out").click()
    block.get_by_placeholder("prefer").fill("wait=20")
    with page.expect_response("**/v1/grazing-curves") as posted:
        block.get_by_role("button", name="Execute").click()
    job = posted.value.json()
    assert posted.value.status in {200, 201}
    assert job["status"] == "successful"
    live = block.locator(".live-responses-table")
    expect(live.locator(".response .response-col_status")).to_contain_text(str(posted.value.status))
    expect(live).to_contain_text(job["id"])
    result = httpx2.get(f"{url}/v1/jobs/{job['id']}/result").json()
    assert len(result["omega"]) == len(result["clearance"]) == 200


EXAMPLES = [(process, name) for process, model in PROCESSES.items() for name in model.operation.examples]


@pytest.mark.parametrize(("process", "name"), EXAMPLES)
def test_every_example_is_answered_soon(url: str, process: str, name: str) -> None:
    """What the page sends where one presses Execute; the button itself is pressed for each process below."""
    content = described(url)["paths"][f"/v1/{process}"]["post"]["requestBody"]["content"]["application/json"]
    answer = httpx2.post(
        f"{url}/v1/{process}", json=content["examples"][name]["value"], headers={"Prefer": "wait=30"}, timeout=60
    )
    job = answer.json()
    assert answer.status_code in {200, 201}
    assert job["status"] == "successful", job
    assert job["cpu_seconds"] < EXAMPLE_SECONDS


@pytest.mark.parametrize("process", PROCESSES)
def test_execute_answers_with_a_finished_job(watched: Watched, url: str, process: str) -> None:
    page = watched.page
    open_docs(page, url)
    block = operation(page, f"/v1/{process}")
    block.locator(".opblock-summary-control").click()
    block.get_by_role("button", name="Try it out").click()
    with page.expect_response(f"**/v1/{process}") as posted:
        block.get_by_role("button", name="Execute").click()
    assert posted.value.request.headers["prefer"] == "wait=5"
    assert posted.value.json()["status"] == "successful"
    expect(block.locator(".live-responses-table")).to_contain_text(posted.value.json()["id"])


def test_a_key_is_sent_once_it_was_entered(browser: Browser) -> None:
    key = "0123456789-of-the-tests-KEY"
    # what the operation answers is not in Redis
    with running(ServiceSettings(redis_url="redis://127.0.0.1:1", api_keys=key)) as address:
        page = browser.new_page()
        open_docs(page, address)
        page.locator("button.authorize").click()
        page.locator(".auth-container input").fill(key)
        page.locator(".auth-btn-wrapper button.authorize").click()
        page.locator(".btn-done").click()
        block = operation(page, "/v1")
        block.locator(".opblock-summary-control").click()
        block.get_by_role("button", name="Try it out").click()
        with page.expect_response("**/v1") as answered:
            block.get_by_role("button", name="Execute").click()
        page.close()
    assert answered.value.status == 200


def test_the_front_page_leads_to_the_docs(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/")
    expect(page.get_by_role("heading", name="grazemap")).to_be_visible()
    page.get_by_role("link", name="API documentation").click()
    page.locator(".opblock").first.wait_for()
