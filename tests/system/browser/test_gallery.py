"""The gallery of places: every link leads to a window with the motions that its card promises."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.explorer_page import soon
from tests.support.watched_page import Watched
from tests.support.watching import until
from tests.system.browser.conftest import watched_page

pytestmark = pytest.mark.browser

PLACES = 10


@pytest.fixture
def visitor(browser: Browser, url: str) -> Iterator[Watched]:
    """A page whose plane has very few tiles."""
    yield from watched_page(browser, url, 420, 420)


def places(page: Page) -> list[dict[str, Any]]:
    """Return the places as the page has them."""
    listed: list[dict[str, Any]] = page.evaluate("async () => (await import('/static/explorer/places.js')).PLACES")
    return listed


def opened(page: Page, url: str) -> Page:
    page.goto(f"{url}/#omega=0.25..0.28125&clearance=2..2.25")
    expect(page.locator("#layer option").first).to_be_attached()  # the page answers from then on
    page.locator("#open-gallery").click()
    expect(page.locator("#gallery")).to_be_visible()
    return page


@pytest.mark.parametrize("number", range(PLACES))
def test_a_place_shows_what_its_card_promises(visitor: Watched, url: str, number: int) -> None:
    page = opened(visitor.page, url)
    place = places(page)[number]
    assert len(places(page)) == PLACES
    link = page.locator("#places a").nth(number)
    expect(link).to_contain_text(place["text"])
    link.click()
    expect(page.locator("#gallery")).to_be_hidden()
    expect(page.locator("#place")).to_contain_text(place["text"])
    page.get_by_role("button", name="Close", exact=True).click()
    expect(page.locator("#place")).to_be_hidden()
    state = {name: value for name, [value] in parse_qs(urlsplit(page.url).fragment).items()}
    assert [*map(float, state["omega"].split(".."))] == place["x"]
    assert state.get("layer") == place.get("layer")
    expect(page.locator("#layer")).to_have_value(place.get("layer", "motion"))
    page.locator("#layer").select_option("motion")
    assert place["shows"]

    def promised() -> bool:
        page.wait_for_timeout(100)
        more = page.locator("#legend button:not([aria-pressed])")
        if more.count():
            more.evaluate("(button) => button.click()")
        buttons = page.locator("#legend button[aria-pressed]")
        seen = buttons.evaluate_all("(buttons) => buttons.map(({ value }) => value)")
        return {*place["shows"]} <= {*seen}

    until(promised, 240)  # chaos is known from verified tiles


def test_pictures_are_drawn_when_the_gallery_is_open_and_given_up_when_it_is_closed(visitor: Watched, url: str) -> None:
    page = opened(visitor.page, url)
    drawn = "(canvases) => canvases.filter((canvas) => canvas.width < 100).length"
    soon(page, lambda: page.locator("#places canvas").evaluate_all(drawn) == PLACES)
    first = page.locator("#places canvas").first
    colours = "(canvas) => new Set(canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data).size"
    assert first.evaluate(colours) > 3
    page.keyboard.press("Escape")
    expect(page.locator("#gallery")).to_be_hidden()
    expect(page.locator("#open-gallery")).to_be_focused()
    asked = len(visitor.posted("unfolding-maps"))
    page.locator("#open-gallery").click()
    page.locator("#gallery .close").click()
    page.wait_for_timeout(500)
    again = visitor.posted("unfolding-maps")[asked:]
    assert not [request for request in again if request.get("preview")]  # the coarse pictures are kept
