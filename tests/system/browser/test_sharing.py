"""Ten browsers over one region of the plane: they share its tiles, and the last one that leaves a tile stops it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack

import httpx2
import pytest
from playwright.sync_api import Browser, Page, Response, expect

from tests.support.explorer_page import QUICK, ended, maps, show, verified
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

BROWSERS = 10
REGION = "omega=0.3125..0.34375&clearance=3..3.25"  # above the grazing curve, where a tile takes a moment
SLOW = 'omega=0.28125..0.296875&clearance=1.125..1.25&machine={"periods":4000}'
FINISHED = {"successful", "failed", "dismissed"}


class Viewer(Watched):
    """A page that is watched, with the maps whose computation it was told to wait for."""

    def __init__(self, page: Page) -> None:
        super().__init__(page)
        self.waits_for: set[str] = set()
        page.on("response", self._answered)

    def _answered(self, answer: Response) -> None:
        asked = answer.request.method == "POST" and answer.url.endswith("/v1/unfolding-maps") and answer.ok
        if asked and "return=representation" not in answer.headers.get("preference-applied", ""):
            self.waits_for.add(answer.headers["location"].rpartition("/")[2])


@pytest.fixture
def crowd(browser: Browser) -> Iterator[list[Viewer]]:
    """Pages of ten browsers that share nothing but the service."""
    with ExitStack() as opened:
        contexts = [browser.new_context(viewport={"width": 700, "height": 420}) for _ in range(BROWSERS)]
        for context in contexts:
            opened.callback(context.close)
        pages = [Viewer(context.new_page()) for context in contexts]
        yield pages
        assert [complaint for viewer in pages for complaint in viewer.complaints] == []


def asked(page: Viewer) -> set[str]:
    """Return the requests for maps that a page has made."""
    return {json.dumps(body, sort_keys=True) for body in page.posted("unfolding-maps")}


def test_ten_browsers_that_pan_at_once_share_their_tiles(crowd: list[Viewer], url: str) -> None:
    before = {job["id"] for job in maps(url)}
    for viewer in crowd:
        show(viewer, url, REGION, wait=False)
    for step in range(3):
        for viewer in crowd:
            verified(viewer.page)
        for viewer in crowd:
            viewer.page.locator("#plane").focus()
            viewer.page.keyboard.press("Shift+ArrowRight")
        for viewer in crowd:
            expect(viewer.page).to_have_url(re.compile(rf"omega={0.3125 + 0.015625 * (step + 1)}\.\."))
    for viewer in crowd:
        verified(viewer.page)
    distinct = set.union(*(asked(viewer) for viewer in crowd))
    tiles = [request for request in distinct if "preview" not in json.loads(request)]
    assert len(tiles) >= 5
    for viewer in crowd:
        assert set(tiles) <= asked(viewer)  # each needed all of them
    new = [job for job in maps(url) if job["id"] not in before]
    assert len(new) == len(distinct)
    assert {job["status"] for job in new if "preview" not in job["request"]} == {"successful"}


def tile_of_all(crowd: list[Viewer], url: str) -> str:
    """Wait until all have been told to wait for one and the same tile, and return its id."""
    while True:
        crowd[0].page.wait_for_timeout(100)
        common = set.intersection(*(viewer.waits_for for viewer in crowd))
        for job in maps(url):
            if job["id"] in common and job["status"] not in FINISHED and "preview" not in job["request"]:
                return str(job["id"])


def leave(viewer: Viewer, tile: str) -> None:
    """Show another part of the plane, and wait until the page has given up the tile."""
    with viewer.page.expect_response(lambda answer: answer.request.method == "DELETE" and tile in answer.url):
        viewer.page.evaluate(f"location.hash = '{QUICK}'")


def test_a_tile_goes_on_until_its_last_viewer_has_left(crowd: list[Viewer], url: str) -> None:
    last, *others = crowd
    for viewer in crowd:
        show(viewer, url, SLOW, wait=False)
    tile = tile_of_all(crowd, url)
    for viewer in others:
        leave(viewer, tile)
    assert httpx2.get(f"{url}/v1/jobs/{tile}").json()["status"] not in FINISHED
    leave(last, tile)
    assert ended(url, tile) == "dismissed"
