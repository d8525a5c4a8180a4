"""Zooming until double precision ends: what the page calls verified stays right, and it says where the end is."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from grazemap import Client
from tests.slow.verified_points import DEFAULT, EQUAL, Point, impacts_in_fifty_digits, verdict
from tests.support.explorer_page import answered, holds, place, ranges, show, verified, window
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

# Where the border between 1-1r-1l and 1-(-1)r-1l crosses the grazing curve: both are in the tile at every depth.
OMEGA = 0.2128986213338
START = "omega=0.1875..0.25&clearance=1.25..2"
WHEEL = -924  # zooms by 4
MOST_NOT_VERIFIED = 4
FOUND = (
    "period",
    "impacts_right",
    "impacts_left",
    "symmetric",
    "settled_after",
    "least_impact_velocity",
    "multiplier",
)
END = re.compile("Double precision ends here")


@pytest.fixture(autouse=True)
def few_tiles(small: Watched) -> None:
    """Make the window small: what is looked at is one tile."""
    small.page.set_viewport_size({"width": 500, "height": 300})


def zoom(page: Page, clearance: float, width: float) -> None:
    """Turn the wheel over the point, which is aimed at again as it becomes clearer, until the window is so narrow."""
    while np.ptp(window(page)[0]) > width:
        before = page.url
        page.mouse.move(*place(page, OMEGA, clearance))
        page.mouse.wheel(0, WHEEL)
        expect(page).not_to_have_url(before)


def tile_at(watched: Watched, clearance: float) -> dict[str, Any]:
    """Return the last request for a verified tile that contains the point."""
    for request in reversed(watched.posted("unfolding-maps")):
        if "preview" not in request and holds(request, OMEGA, clearance):
            return dict(request)
    raise AssertionError("no tile was asked for at the point")


def test_verified_points_stay_right_until_double_precision_ends(small: Watched, url: str) -> None:
    """Of 20 points of the tile at a point of the grazing curve, at most 4 are not verified; the others are right."""
    curve = answered(url, "grazing-curves", {"omega": [OMEGA, 0.25]})
    clearance = curve["clearance"][0]
    page = show(small, url, START, wait=False)
    zoom(page, clearance, 0.0625 / 2.0**30)
    verified(page)
    expect(page.locator("#says")).not_to_have_text(END)
    tile = tile_at(small, clearance)
    across, _ = ranges(tile)
    assert across["stop"] - across["start"] < 0.0625 / 2.0**30
    umap = answered(url, "unfolding-maps", tile)
    verdicts, labels = [], set()
    for row, column in np.random.default_rng(1).integers(128, size=(20, 2)):
        if umap["verified"][row][column]:
            pixel = {name: umap[name][row][column] for name in FOUND}
            point = Point.of(DEFAULT, umap["omega"][column], umap["clearance"][row], pixel)
            verdicts.append(verdict(point, impacts_in_fifty_digits(point)))
            labels.add(point.label)
    assert len(verdicts) >= 20 - MOST_NOT_VERIFIED
    assert set(verdicts) == {EQUAL}, Counter(verdicts)
    assert len(labels) == 2  # the points are on both sides of the border

    for _ in range(12):
        page.mouse.move(*place(page, OMEGA, clearance))
        page.mouse.wheel(0, WHEEL)
        page.wait_for_timeout(300)  # longer than a window takes to be settled
    expect(page.locator("#says")).to_have_text(END)
    finest = page.url
    page.mouse.wheel(0, WHEEL)
    page.wait_for_timeout(300)
    assert page.url == finest
    assert np.ptp(window(page)[0]) < 0.0625 / 2.0**30


def test_where_round_off_decides_a_closer_look_shows_no_more(small: Watched, url: str) -> None:
    """About a point after a long transient, whose neighbours have come the same way."""
    with Client(url) as client:
        umap = client.unfolding_map(omega=(0.283, 0.296), clearance=(1.25, 1.37), shape=(24, 24), max_periods=400)
    row, column = np.argwhere(umap.sensitive)[0]
    omega, clearance = float(umap.omega[column]), float(umap.clearance[row])
    around = [f"{value - 1e-11!r}..{value + 1e-11!r}" for value in (omega, clearance)]
    page = show(small, url, f"omega={around[0]}&clearance={around[1]}")
    expect(page.locator("#says")).to_contain_text("Round-off decides nearly all labels here")
    shown = page.url
    page.get_by_role("button", name="Zoom in").click()
    page.wait_for_timeout(500)
    assert page.url == shown
    page.get_by_role("button", name="Zoom out").click()
    expect(page).not_to_have_url(shown)
