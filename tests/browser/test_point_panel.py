"""What a person sees of a point that was clicked: its own motion, where one can see it."""

from __future__ import annotations

import pytest
from explorer_page import USUAL, WAIT, place, show
from playwright.sync_api import Page, Route, expect
from watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

FIRST_POINT = (0.27, 1.5)  # of 1-2r-2l
SECOND_POINT = (0.29, 1.75)  # of 1-1r-1l
QUESTIONS = ("Follow the branch", "Bifurcation curves of this motion")


def open_point(page: Page, at: tuple[float, float], name: str) -> None:
    """Click a point, and wait for the name of its motion."""
    page.mouse.click(*place(page, *at))
    expect(page.locator("#point-name")).to_have_text(name, timeout=WAIT)


def test_a_new_point_shows_nothing_of_the_orbit_before(watched: Watched, url: str) -> None:
    """While the orbit of a point is awaited, there is none to ask about, and no figures of the last one."""
    page = show(watched, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    held: list[Route] = []
    page.route("**/v1/periodic-orbits", lambda route: held.append(route))
    open_point(page, SECOND_POINT, "1-1r-1l")
    for question in QUESTIONS:
        expect(page.get_by_role("button", name=question)).to_be_disabled()
    expect(page.locator("#multipliers svg")).to_have_count(0)
    for route in held:
        route.continue_()
    page.unroute_all()
    for question in QUESTIONS:
        expect(page.get_by_role("button", name=question)).to_be_enabled(timeout=WAIT)
    page.get_by_role("button", name="Bifurcation curves of this motion").click()
    expect(page.locator("#own-curves")).to_contain_text("of 1-1r-1l are drawn", timeout=WAIT)


def test_a_clicked_point_comes_into_sight(small: Watched, url: str) -> None:
    """Also where another section of the panel was read before."""
    page = show(small, url, USUAL, wait=False)
    page.get_by_text("Machine", exact=True).click()
    page.get_by_role("button", name="Show this window").scroll_into_view_if_needed()
    expect(page.locator("#point-section summary")).not_to_be_in_viewport()
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#point-name")).to_be_in_viewport()


def test_a_question_says_in_sight_that_it_is_computed(small: Watched, url: str) -> None:
    page = show(small, url, USUAL, wait=False)
    open_point(page, FIRST_POINT, "1-2r-2l")
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    page.route("**/v1/basins", lambda route: None)  # an answer that does not come
    page.get_by_role("button", name="Basins").click()
    expect(page.get_by_text("Basins: computing")).to_be_in_viewport()
    page.unroute_all(behavior="ignoreErrors")
