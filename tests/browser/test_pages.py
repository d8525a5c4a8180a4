"""The pages in a real browser, without internet: the map of the first page, and the docs with every operation."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from urllib.parse import urlsplit

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, expect, sync_playwright

from grazemap.plots import palette

pytestmark = pytest.mark.browser

CHROMIUM = shutil.which("chromium", path="/usr/bin")
# Chromium asks its maker's hosts for this and that unless it is told not to.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# The first start on a machine compiles every kernel.
START_SECONDS = 240


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a whole stack."""
    command = [sys.executable, "-m", "grazemap_service.stack", "--workers", "1", "--die-with-parent"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as stack:
        try:
            assert stack.stdout is not None
            yield json.loads(stack.stdout.readline())["url"]
        finally:
            stack.terminate()
            stack.wait(10)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("no /usr/bin/chromium: make browser installs it")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, headless=True, args=FLAGS)
        yield chromium
        chromium.close()


class Watched:
    """A page, what it complained about, and where it went for files."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.hosts: set[str] = set()
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", self._request)

    def _console(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            self.complaints.append(message.text)

    def _request(self, request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme != "data":
            self.hosts.add(parts.netloc)


@pytest.fixture
def watched(browser: Browser, url: str) -> Iterator[Watched]:
    page = browser.new_page(viewport={"width": 1280, "height": 1600})
    watched = Watched(page)
    yield watched
    page.close()
    assert watched.complaints == []
    assert watched.hosts == {urlsplit(url).netloc}


@pytest.mark.timeout(START_SECONDS)
def test_the_docs_page_shows_every_operation(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/docs")
    document = httpx2.get(f"{url}/openapi.json").json()
    expected = {(method.upper(), path) for path, operations in document["paths"].items() for method in operations}
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
    # unfolded, each shows its parameters or body and its responses; a page with all of them unfolded is slow
    for block in blocks.all():
        block.locator(".opblock-summary-control").click()
        expect(block.locator(".responses-wrapper")).to_be_visible()
        block.locator(".opblock-summary-control").click()
    expect(page.locator(".errors-wrapper")).to_have_count(0)


def test_try_it_out_runs_an_operation(watched: Watched, url: str) -> None:
    page = watched.page
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
    expect(page.locator(".opblock").first).to_be_visible()


@pytest.mark.timeout(START_SECONDS)
def test_the_front_page_shows_a_map_that_it_has_computed_and_answers_clicks_and_drags(
    watched: Watched, url: str
) -> None:
    page = watched.page
    page.goto(f"{url}/")
    says, canvas = page.locator("#says"), page.locator("#map")
    expect(says).to_contain_text("computed by this service", timeout=60_000)
    jobs = httpx2.get(f"{url}/v1/jobs").json()["jobs"]
    assert {"unfolding-maps", "grazing-curves"} <= {job["process"] for job in jobs}
    expect(page.locator("#legend")).to_contain_text("1-1r-1l")
    # the commonest motions have the colours of the SDK's pictures, and there are many colours
    seen = page.evaluate(
        """() => {
            const canvas = document.getElementById("map"), counts = new Map();
            const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
            for (let i = 0; i < data.length; i += 4) {
                const parts = [data[i], data[i + 1], data[i + 2]];
                const colour = "#" + parts.map((part) => part.toString(16).padStart(2, "0")).join("").toUpperCase();
                counts.set(colour, (counts.get(colour) ?? 0) + 1);
            }
            return [...counts].sort((one, other) => other[1] - one[1]).map(([colour]) => colour);
        }"""
    )
    assert palette.NAMED["1-1r-1l"] in seen[:2]
    assert {palette.NAMED["1-2r-2l"], palette.NAMED["1-3r-3l"], palette.UNRESOLVED} <= set(seen[:8])
    box = canvas.bounding_box()
    assert box is not None
    across, up = box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.4
    page.mouse.move(across, up)
    expect(canvas).to_have_attribute("title", re.compile(r"ω = 0\.2\d+, b = 1\.\d+: 1-1r-1l"))
    expect(page.locator("#legend")).to_contain_text("sensitive (")
    (job,) = (job for job in jobs if job["process"] == "unfolding-maps")
    sensitive = np.array(httpx2.get(f"{url}/v1/jobs/{job['id']}/result?f=json").json()["sensitive"])
    row, column = np.argwhere(sensitive)[0]
    # the part of the canvas inside the axes
    right, high = 96 + 828 * column / (sensitive.shape[1] - 1), 584 - 569 * row / (sensitive.shape[0] - 1)
    page.mouse.move(box["x"] + box["width"] * right / 960, box["y"] + box["height"] * high / 640)
    expect(canvas).to_have_attribute("title", re.compile(", sensitive$"))
    page.mouse.click(across, up)
    expect(says).to_contain_text("the motion from rest is 1-1r-1l", timeout=30_000)
    expect(page.locator("#motion")).to_be_visible()
    page.mouse.move(across, box["y"] + box["height"] * 0.1)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.9, up)
    page.mouse.up()
    expect(page.locator("#back")).to_be_visible(timeout=60_000)
    maps = [job for job in httpx2.get(f"{url}/v1/jobs").json()["jobs"] if job["process"] == "unfolding-maps"]
    assert len(maps) == 2
    page.locator("#back").click()
    expect(page.locator("#back")).to_be_hidden(timeout=60_000)
