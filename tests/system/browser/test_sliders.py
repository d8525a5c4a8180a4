"""Sliders of the machine: the plane follows them in previews, and what is released is computed and kept."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from tests.support.explorer_page import (
    USUAL,
    WAIT,
    answered,
    paler,
    picture,
    place,
    reading,
    show,
    soon,
    unfold,
    verified,
)
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

# where 1-1r-1l, above, gives way to 1-2r-2l: at another restitution elsewhere
WINDOW = "omega=0.265625..0.28125&clearance=1.5625..1.75"
AT = (0.273, 1.7)


def restitution(page: Page) -> float:
    """Return the value beside the slider."""
    return float(page.locator("#sliders label:has([name=restitution]) output").inner_text())


def recoloured(before: Any, after: Any) -> float:
    """Return the share of a picture that has one of the motions' colours, but another than before."""
    colours, counts = np.unique(before.reshape(-1, 3), axis=0, return_counts=True)
    motions = paler(colours[np.argsort(-counts)[:2]])  # as previews; not those of before, which stand until others come
    is_motion = np.any([np.all(np.abs(after - colour) <= 2, axis=2) for colour in motions], axis=0)
    return float(np.mean(is_motion & np.any(after != before, axis=2)))


def test_a_swipe_that_begins_on_a_slider_leaves_its_value(small: Watched, url: str) -> None:
    page = show(small, url, WINDOW)
    slider = page.locator("#sliders [name=restitution]")
    before, address = restitution(page), page.url
    slider.evaluate(
        """(slider) => {
          const send = (event) => slider.dispatchEvent(event);
          send(new PointerEvent("pointerdown", { bubbles: true }));
          slider.value = 20;
          send(new InputEvent("input", { bubbles: true }));
          setTimeout(() => send(new PointerEvent("pointercancel", { bubbles: true })), 200);
        }"""
    )
    soon(page, lambda: restitution(page) < before)
    soon(page, lambda: restitution(page) == before)
    page.wait_for_timeout(300)
    assert page.url == address


def test_a_slider_recolours_the_plane_and_what_is_released_is_kept(small: Watched, url: str) -> None:
    page = show(small, url, WINDOW)
    slider = page.locator("#sliders [name=restitution]")
    box = slider.bounding_box()
    assert box is not None
    first, asked = picture(page), len(small.posted("unfolding-maps"))
    before = restitution(page)
    # the thumb is held at another value, and then moved on
    page.mouse.move(box["x"] + before * box["width"], box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2, steps=4)
    soon(page, lambda: recoloured(first, picture(page)) > 0.02)
    moved = small.posted("unfolding-maps")[asked:]
    assert all(body.get("preview") for body in moved)
    assert {body["oscillator"]["restitution"] for body in moved} != {before}
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2, steps=2)
    page.mouse.up()
    kept = restitution(page)
    assert kept < before
    expect(page).to_have_url(re.compile("machine="))
    machine = json.loads(parse_qs(urlsplit(page.url).fragment)["machine"][0])
    assert machine["oscillator"]["restitution"] == kept
    verified(page)
    asked_of = {
        "oscillator": machine["oscillator"],
        "omega": [AT[0], AT[0] + 1e-3],
        "clearance": [AT[1], AT[1] + 1e-3],
        "max_periods": 400,
    }
    umap = answered(url, "unfolding-maps", asked_of)
    label = umap["motions"][umap["motion"][0][0]]["label"]
    assert f": {label}; verified" in reading(page, place(page, *AT))
    # the history has the machine before, and the one that was released, not those between
    page.go_back()
    expect(page).not_to_have_url(re.compile("machine="))
    soon(page, lambda: restitution(page) == before)
    assert float(slider.input_value()) / float(slider.get_attribute("max") or 1) == pytest.approx(before)
    verified(page)
    soon(page, lambda: np.mean(np.any(picture(page) != first, axis=2)) < 0.05)  # rare motions may have other colours
    page.go_forward()
    soon(page, lambda: restitution(page) == kept)


def test_a_slider_follows_keys_and_moves_the_open_point_too(small: Watched, url: str) -> None:
    page = show(small, url, f"{USUAL}&at=0.27,1.5", wait=False)
    expect(page.locator("#point-name")).to_have_text("1-2r-2l", timeout=WAIT)
    unfold(page, "Machine")  # which lay over the point
    slider = page.locator("#sliders [name=restitution]")
    slider.focus()
    page.keyboard.press("ArrowLeft")
    expect(page).to_have_url(re.compile("machine="))
    value = restitution(page)
    assert slider.get_attribute("aria-valuetext") == str(value)
    soon(page, lambda: small.posted("periodic-orbits")[-1].get("oscillator", {}).get("restitution") == value)
    expect(slider).to_be_focused()


def test_a_slider_of_the_frequency_keeps_the_focus_and_follows_the_form(small: Watched, url: str) -> None:
    plane = "horizontal=restitution&vertical=clearance&restitution=0.5..0.75&clearance=1.5..1.75&omega=0.28"
    page = show(small, url, plane, wait=False)
    slider, output = page.locator("#sliders [name=omega]"), page.locator("#sliders label:has([name=omega]) output")
    expect(output).to_have_text("0.28")
    slider.focus()
    values = [0.28]
    for _ in range(3):
        page.keyboard.press("ArrowRight")
        expect(page).to_have_url(re.compile(f"omega={output.inner_text()}(&|$)"))
        expect(slider).to_be_focused()
        values.append(float(output.inner_text()))
    assert values == sorted(set(values))
    assert float(slider.input_value()) / float(slider.get_attribute("max") or 1) > 0.5  # where it was moved to
    unfold(page, "View")
    page.locator("#fixed-omega input").fill("0.3")
    page.keyboard.press("Enter")
    expect(output).to_have_text("0.3")
