"""The guide in a real browser, from the service: it is found, searched, read in the dark and on a phone."""

from __future__ import annotations

import pytest
from playwright.sync_api import expect

from tests.support.watched_page import Watched
from tools.guide.pages import DOCS

pytestmark = pytest.mark.browser

PAGES = [path.relative_to(DOCS).with_suffix(".html").as_posix() for path in (DOCS / "start.md", DOCS / "gallery.md")]
PAGES += [f"howto/{path.stem}.html" for path in sorted((DOCS / "howto").glob("*.md"))]
PAGES += ["reference/unfolding-maps.html", "reference/http.html", "theory.html"]


def test_the_front_page_leads_to_the_guide_and_its_search(watched: Watched, url: str) -> None:
    page = watched.page
    page.goto(f"{url}/")
    page.get_by_role("link", name="Guide").click()
    expect(page.get_by_role("heading", name="grazemap", exact=True)).to_be_visible()
    page.get_by_placeholder("Search").fill("restitution")
    page.get_by_placeholder("Search").press("Enter")
    expect(page.locator("#search-results li").first).to_be_visible()


def test_it_is_dark_where_a_reader_asks_for_it(watched: Watched, url: str) -> None:
    page = watched.page
    page.emulate_media(color_scheme="dark")
    page.goto(f"{url}/guide/start.html")
    background = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert sum(int(part) for part in background.strip("rgb()").split(",")[:3]) < 3 * 64


@pytest.mark.parametrize("name", PAGES)
def test_a_page_fits_a_phone(watched: Watched, url: str, name: str) -> None:
    page = watched.page
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(f"{url}/guide/{name}")
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    pictures = page.evaluate("[...document.images].filter(image => image.complete && !image.naturalWidth).length")
    assert pictures == 0
