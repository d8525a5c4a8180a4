"""The docs page in a real browser, without internet: it shows every operation and runs it."""

from __future__ import annotations

import httpx2
import pytest
from playwright.sync_api import expect

from tests.support.watched_page import Watched

pytestmark = pytest.mark.browser

# The first start on a machine compiles every kernel.
START_SECONDS = 240
# Of the operations, each of which takes the page three seconds of processor time to unfold.
PARTS = 4


@pytest.mark.timeout(START_SECONDS)
@pytest.mark.parametrize("part", range(PARTS))
def test_the_docs_page_shows_every_operation(watched: Watched, url: str, part: int) -> None:
    page = watched.page
    page.set_viewport_size({"width": 1280, "height": 1600})
    page.goto(f"{url}/docs")
    document = httpx2.get(f"{url}/openapi.json").json()
    expected = {(method.upper(), path) for path, operations in document["paths"].items() for method in operations}
    blocks = page.locator(".opblock")
    blocks.first.wait_for()
    expect(blocks).to_have_count(len(expected))
    shown = {
        (
            block.locator(".opblock-summary-method").inner_text(),
            block.locator(".opblock-summary-path").get_attribute("data-path"),
        )
        for block in blocks.all()
    }
    assert shown == expected
    # unfolded, each shows its parameters or body and its responses; a page with all of them unfolded is slow
    for block in blocks.all()[part::PARTS]:
        block.locator(".opblock-summary-control").click()
        expect(block.locator(".responses-wrapper")).to_be_visible()
        block.locator(".opblock-summary-control").click()
    expect(page.locator(".errors-wrapper")).to_have_count(0)


def test_try_it_out_runs_an_operation(watched: Watched, url: str) -> None:
    page = watched.page
    page.set_viewport_size({"width": 1280, "height": 1600})
    page.goto(f"{url}/docs")
    block = page.locator(".opblock", has=page.locator('[data-path="/v1/grazing-curves"]'))
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


def test_the_front_page_leads_to_the_docs(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/")
    expect(page.get_by_role("heading", name="grazemap")).to_be_visible()
    page.get_by_role("link", name="API documentation").click()
    page.locator(".opblock").first.wait_for()
