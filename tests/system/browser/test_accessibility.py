"""What axe finds in the explorer: nothing that keeps a person from using it, in any of its states."""

from __future__ import annotations

from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page, expect

from tests.support.explorer_page import USUAL, WAIT, place, show, unfold
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

BARRIERS = {"serious", "critical"}


def barriers(page: Page, within: str | None = None) -> list[str]:
    """Return axe's serious and critical findings in a part of the page, each with its rule and the element."""
    violations: list[dict[str, Any]] = Axe().run(page, context=within).response["violations"]
    return [
        f"{violation['id']} ({violation['impact']}): {' '.join(map(str, node['target']))}"
        for violation in violations
        if violation["impact"] in BARRIERS
        for node in violation["nodes"]
    ]


def with_everything_open(page: Page) -> list[str]:
    """Return the findings while every section of the page is open, and every menu, of which one is open at a time."""
    page.evaluate("for (const section of document.querySelectorAll('details:not(.menu)')) section.open = true")
    findings = barriers(page)
    for menu in page.locator("details.menu:visible").all():
        menu.evaluate("(menu) => (menu.open = true)")
        findings += barriers(page, "details.menu[open]")
    page.keyboard.press("Escape")
    return findings


@pytest.mark.parametrize(
    ("scheme", "width", "height"), [("light", 1280, 800), ("dark", 1280, 800), ("light", 360, 740), ("dark", 360, 740)]
)
def test_axe_finds_no_barrier(watched: Watched, url: str, scheme: Any, width: int, height: int) -> None:
    page = watched.page
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": height})
    by_state = {}
    show(watched, url, USUAL)
    by_state["the first window"] = barriers(page)
    page.mouse.click(*place(page, 0.27, 1.5))
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    expect(page.locator("#history svg")).to_be_visible(timeout=WAIT)
    by_state["an opened point"] = barriers(page)
    page.get_by_role("button", name="Close the point").click()
    unfold(page, "Machine", "All its numbers")
    page.locator("#machine").get_by_label("Restitution").fill("2")
    expect(page.locator("#error-restitution")).to_contain_text("less than or equal to 1")
    by_state["a form with an error"] = barriers(page)
    by_state["every section"] = with_everything_open(page)
    page.get_by_label("Colour").select_option("exponent")
    expect(page.locator("#ramp-text")).to_contain_text("Lyapunov exponent")
    by_state["a layer with a ramp"] = barriers(page)
    assert {state: findings for state, findings in by_state.items() if findings} == {}


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_barrier_in_what_is_asked_about_a_point(small: Watched, url: str, scheme: Any) -> None:
    page = small.page
    page.emulate_media(color_scheme=scheme)
    show(small, url, f"{USUAL}&at=0.27%2C1.5", wait=False)
    expect(page.locator("#multipliers svg")).to_be_visible(timeout=WAIT)
    for name, answer in (("Basins", "#basins li"), ("Follow the branch", "#branch svg")):
        page.get_by_role("button", name=name).click()
        expect(page.locator(answer).first).to_be_visible(timeout=WAIT)
    assert barriers(page) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_barrier_in_the_story_and_the_places(small: Watched, url: str, scheme: Any) -> None:
    page = small.page
    page.emulate_media(color_scheme=scheme)
    page.goto(f"{url}/")
    by_state = {}
    for step in ("Next", "Next", "Done"):
        by_state[f"the story before {step}"] = barriers(page)
        page.get_by_role("button", name=step).click()
    page.locator("#open-gallery").click()
    expect(page.locator("#places small").first).not_to_be_empty(timeout=WAIT)
    by_state["the places"] = barriers(page)
    page.goto("about:blank")
    page.goto(f"{url}/#{USUAL}&embed=sliders,legend,colour")
    expect(page.locator("#legend button").first).to_be_visible(timeout=WAIT)
    by_state["a part of another page"] = barriers(page)
    assert {state: findings for state, findings in by_state.items() if findings} == {}


def test_axe_sees_a_barrier(small: Watched, url: str) -> None:
    """A page with faults is not found to be without any."""
    page = show(small, url, USUAL, wait=False)
    page.evaluate(
        """() => {
            document.getElementById("home").removeAttribute("aria-label");
            document.getElementById("home").textContent = "";
            Object.assign(document.getElementById("reading").style, { color: "#bbb", background: "#ccc" });
        }"""
    )
    findings = " ".join(barriers(page))
    assert "button-name (critical): #home" in findings
    assert "color-contrast (serious): #reading" in findings
