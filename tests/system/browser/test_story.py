"""The story of the first visit: it is told once, blocks nothing, and ends where someone begins."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.support.explorer_page import QUICK, soon
from tests.support.watched_page import Watched
from tests.system.browser.conftest import watched_page

pytestmark = pytest.mark.browser

NO_STORAGE = """
for (const name of ["localStorage", "sessionStorage"])
  Object.defineProperty(window, name, { get() { throw new DOMException("refused", "SecurityError"); } });
"""


@pytest.fixture(params=["wide", "phone"])
def visitor(browser: Browser, url: str, request: pytest.FixtureRequest) -> Iterator[Watched]:
    size = (1280, 800) if request.param == "wide" else (390, 844)
    yield from watched_page(browser, url, *size)


def told(page: Page) -> str:
    return page.locator("#story-says").inner_text()


def ring(page: Page) -> tuple[float, float]:
    """Return where the point is whose machine the story shows."""
    box = page.locator("#story-ring").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_first_visit_is_told_three_things(visitor: Watched, url: str) -> None:
    page = visitor.page
    page.goto(f"{url}/")
    expect(page.locator("#story")).to_be_visible()
    expect(page.locator("#living")).to_be_visible(timeout=60_000)
    first = told(page)
    page.get_by_role("button", name="Next").click()
    expect(page.locator("#story-says")).not_to_have_text(first)
    expect(page.locator("#story-tag")).to_be_visible(timeout=60_000)
    # a machine that does not touch its stops, and then one that does
    named = page.locator("#living figcaption")
    expect(named).to_contain_text("1-(-1)r-(-1)l", timeout=60_000)
    above = ring(page)
    soon(page, lambda: named.inner_text().partition("\n")[0] not in {"", "1-(-1)r-(-1)l"} and ring(page)[1] > above[1])
    second = told(page)
    page.get_by_role("button", name="Next").click()
    expect(page.locator("#story-says")).not_to_have_text(second)
    expect(page.locator("#story-tag")).to_be_hidden()
    rhythms: set[str] = set()

    def several() -> bool:
        rhythms.add(named.inner_text())
        return len(rhythms - {second, ""}) >= 2

    soon(page, several)
    page.get_by_role("button", name="Done").click()
    expect(page.locator("#story")).to_be_hidden()
    page.reload()
    expect(page.locator("#says")).to_be_visible() if page.viewport_size["width"] > 800 else None
    expect(page.locator("#living")).to_be_visible(timeout=60_000)
    expect(page.locator("#story")).to_be_hidden()


def test_the_story_leaves_the_plane_free_and_ends_at_a_press_on_it(visitor: Watched, url: str) -> None:
    page = visitor.page
    page.goto(f"{url}/")
    story = page.locator("#story")
    expect(story).to_be_visible()
    card = story.bounding_box()
    assert card is not None
    middle = page.viewport_size["width"] / 2, 0.35 * page.viewport_size["height"]  # type: ignore[index]
    on_top = page.evaluate("([x, y]) => document.elementFromPoint(x, y).id", [*middle])
    assert on_top == "plane"
    page.mouse.move(*middle)
    expect(page.locator("#reading")).to_contain_text("ω =")
    expect(story).to_be_visible()
    page.mouse.click(*middle)
    expect(story).to_be_hidden()
    expect(page.locator("#point-name")).not_to_be_empty(timeout=60_000)
    page.goto("about:blank")
    page.goto(f"{url}/")
    expect(page.locator("#reading")).to_be_visible()
    expect(story).to_be_hidden()


def test_the_story_is_skipped_by_keys_and_told_again(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/")
    expect(page.locator("#story")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#story")).to_be_hidden()
    page.goto(f"{url}/#{QUICK}")
    page.locator("#about-section summary").click()
    page.locator("#story-again").click()
    expect(page.locator("#story-next")).to_be_focused()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    expect(page.locator("#story")).to_be_hidden()
    expect(page.locator("#plane")).to_be_focused()
    page.go_back()
    soon(page, lambda: QUICK in page.url)


def test_an_address_that_says_a_window_tells_no_story(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/#{QUICK}")
    expect(page.locator("#living")).to_be_visible(timeout=60_000)
    expect(page.locator("#story")).to_be_hidden()


def test_where_the_browser_keeps_nothing_the_story_is_told(watched: Watched, url: str) -> None:
    page = watched.page
    page.add_init_script(NO_STORAGE)
    page.goto(f"{url}/")
    page.get_by_role("button", name="Skip").click()
    expect(page.locator("#story")).to_be_hidden()
    page.goto("about:blank")
    page.goto(f"{url}/")
    expect(page.locator("#story")).to_be_visible()


def test_with_reduced_motion_nothing_moves_by_itself(browser: Browser, url: str) -> None:
    context = browser.new_context(reduced_motion="reduce")
    page = context.new_page()
    page.goto(f"{url}/")
    expect(page.locator("#story-ring")).to_be_visible(timeout=60_000)
    assert page.evaluate("document.getAnimations().filter(({ playState }) => playState === 'running').length") == 0
    context.close()
