"""Three people and the explorer: a student, an engineer and a researcher find what they came for."""

from __future__ import annotations

import re
import time
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import httpx2
import matplotlib.pyplot as plt
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from grazemap import Client, Oscillator
from grazemap.plots import palette
from tests.support.explorer_page import (
    QUICK,
    USUAL,
    WAIT,
    beside_axes,
    is_free,
    picture,
    place,
    reading,
    show,
    spot,
    unfold,
    window,
)
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

MINUTE = 60.0
FIRST = "1-(-1)r-(-1)l"  # the motion without impacts
NO_MOTION = {FIRST, None, "unresolved", "chaotic"}
RUN = 12  # pixels of one colour that make a region
ASIDE = 0.02  # of clearance: beside a curve, but not so near that it explains itself
BETWEEN = 24  # pixels at most between two regions: of the grazing curve, and of motions that are rarer
EDGE = 60  # pixels along the edges of the plane, where its axes and the bars over it are
SVG = "{http://www.w3.org/2000/svg}"
PREFER = {"Prefer": "wait=20, return=representation"}


class Seen(NamedTuple):
    """Two regions, one below the other: a column of the canvas, a row of each, and their names in the legend."""

    column: int
    rows: tuple[int, int]
    names: tuple[str, str]


def legend(page: Page) -> dict[str, str]:
    """Return the motions in the legend, by their colours as the canvas has them."""
    entries: list[list[str]] = page.locator("#legend button[value]").evaluate_all(
        """(entries) => entries.map((one) => [
            one.querySelector(".swatch").style.backgroundColor.match(/\\d+/g).slice(0, 3).join(","),
            one.value,
        ])"""
    )
    return {entry[0]: entry[1] for entry in reversed(entries)}


def end_of_the_first_motion(page: Page) -> Iterator[Seen]:
    """Yield the places where, downwards, the first motion ends and another motion of the legend begins."""
    named = legend(page)
    plane = picture(page)
    height, width, _ = plane.shape
    for x in range(EDGE + RUN, width - RUN, 4):
        names = [named.get("{},{},{}".format(*pixel)) for pixel in plane[:, x]]
        last = max((y for y in range(EDGE, height - EDGE) if names[y] == FIRST), default=0)
        for y in range(last, min(last + BETWEEN, height - EDGE - RUN)):
            below = set(names[y : y + RUN])
            if set(names[last - RUN : last]) == {FIRST} and len(below) == 1 and below.isdisjoint(NO_MOTION):
                yield Seen(x, (last - RUN // 2, y + RUN // 2), (FIRST, str(below.pop())))
                break


def test_a_student_sees_the_first_bifurcation_within_a_minute(watched: Watched, url: str) -> None:
    page = watched.page
    started = time.monotonic()
    page.goto(f"{url}/")
    expect(page.get_by_label("Colour")).to_have_value("motion")
    expect(page.locator("#legend button[value]").nth(1)).to_be_visible(timeout=WAIT)
    box = page.locator("#plane").bounding_box()
    assert box is not None
    end = None
    while end is None:
        assert time.monotonic() - started < MINUTE
        page.wait_for_timeout(300)
        for seen in end_of_the_first_motion(page):
            sides = [(box["x"] + seen.column, box["y"] + row) for row in seen.rows]
            if not all(is_free(page, side) for side in sides):
                continue
            readings = [reading(page, side) for side in sides]
            if all(f": {name}; verified" in text for name, text in zip(seen.names, readings, strict=True)):
                between = [reading(page, (sides[0][0], box["y"] + row)) for row in range(*seen.rows, 3)]
                if any("Grazing curve" in text for text in between):
                    end = seen
                    break
    for side, name in zip(sides, end.names, strict=True):
        page.mouse.click(*side)
        expect(page.locator("#point-name")).to_have_text(name, timeout=WAIT)
    expect(page.locator("#history .impact").first).to_be_visible()
    assert time.monotonic() - started < MINUTE


def test_an_engineer_enters_a_machine_with_one_stop_and_reads_the_power_at_her_point(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "Machine", "All its numbers")
    form = page.locator("#machine")
    form.get_by_label("Units").select_option("SI")
    expect(form.get_by_label("Damping")).to_have_value("")  # those of the paper are gone
    fields = {"Masses, from": "0.5", "Stiffnesses": "2000", "Damping": "[1.5]", "Forces": "5", "Restitution": "0.7"}
    for name, text in fields.items():
        form.get_by_label(name).fill(text)
    expect(page.locator("#modes")).to_contain_text("63.25 rad/s, damping ratio 0.02372")
    page.locator("select[name=stops]").select_option("right")
    page.get_by_role("button", name="Show this machine").click()
    expect(page).to_have_url(re.compile("machine="))
    (left, right), (low, high) = window(page)
    assert left < 63.25 < right
    assert low < 0.0395 < high  # the amplitude at resonance
    machine = Oscillator(units="SI", masses=[0.5], stiffnesses=[2000], damping=[1.5], forcing=[5.0], restitution=0.7)
    page.get_by_label("Frequency from").fill("60")
    page.locator("#overview").get_by_label("to", exact=True).fill("70")
    page.get_by_role("button", name="Show this window").click()
    expect(page).to_have_url(re.compile(r"omega=59\.\d+\.\.70"))
    page.mouse.click(*place(page, 66, 0.018))
    expect(page.locator("#point-figures")).to_contain_text("dissipated power", timeout=WAIT)
    omega, right_stop = opened(page)
    with Client(url) as client:
        orbit = client.periodic_orbit(
            machine,
            omega=omega,
            clearance={"right": right_stop, "left": None},
            observables=["dissipated_power"],
            progress=False,
        )
    power, unit = figures(page)["dissipated power"].split()
    assert unit == "W"
    assert float(power) == pytest.approx(orbit.dissipated_power, rel=1e-3)
    assert float(power) > 0
    posted = [body for body in small.posted("unfolding-maps") if "oscillator" in body]
    assert posted
    assert all(body["oscillator"]["masses"] == [0.5] and body["clearance"]["left"] is None for body in posted)


def opened(page: Page) -> tuple[float, float]:
    """Return the point that the address says is open."""
    at = re.search(r"at=([\d.e-]+)%2C([\d.e-]+)", page.url)
    assert at is not None
    return float(at[1]), float(at[2])


def figures(page: Page) -> dict[str, str]:
    """Return the figures of the open point by their names."""
    names, values = (page.locator(f"#point-figures {kind}").all_inner_texts() for kind in ("dt", "dd"))
    return dict(zip(names, values, strict=True))


class Border(NamedTuple):
    """A place where a bifurcation curve is the border of a region, a clearance inside, and the piece of the curve."""

    omega: float
    clearance: float
    inside: float
    piece: dict[str, Any]


def border_of(page: Page, pieces: list[dict[str, Any]], motion: str) -> Border | None:
    """Return the place, nearest to the open point, where one of the motion's curves has it on one side only."""
    (left, right), (low, high) = window(page)
    start = np.array(spot(page, *opened(page)))
    candidates = []
    for piece in pieces:
        for omega, clearance in zip(piece["omega"], piece["clearance"], strict=True):
            if piece["admissible"] and left < omega < right and low + ASIDE < clearance < high - ASIDE:
                far = float(np.hypot(*(spot(page, omega, clearance) - start)))
                candidates.append((far, omega, clearance, piece))
    for _, omega, clearance, piece in sorted(candidates, key=lambda candidate: candidate[0]):
        if not is_free(page, spot(page, omega, clearance)):
            continue
        text = reading(page, spot(page, omega, clearance))
        if f"{piece['type']}, " in text and f" of {motion}" in text:
            sides = [clearance + ASIDE, clearance - ASIDE]
            inside = [side for side in sides if f": {motion};" in reading(page, spot(page, omega, side))]
            if len(inside) == 1:
                return Border(omega, clearance, inside[0], piece)
    return None


def test_a_researcher_goes_from_a_border_to_its_curve_its_branch_and_a_figure(
    watched: Watched, url: str, tmp_path: Path
) -> None:
    """The curve, the branch and the figure say the same of where the motion ends."""
    page = show(watched, url, USUAL)
    page.mouse.click(*place(page, 0.27, 1.5))
    motion = "1-2r-2l"
    expect(page.locator("#point-name")).to_have_text(motion, timeout=WAIT)
    asks = page.get_by_role("button", name="Bifurcation curves of this motion")
    expect(asks).to_be_enabled(timeout=WAIT)
    asks.click()
    expect(page.locator("#own-curves")).to_contain_text(f"of {motion} are drawn", timeout=WAIT)
    request = watched.posted("bifurcation-curves")[-1]
    answer = httpx2.post(f"{url}/v1/bifurcation-curves", json=request, headers=PREFER).json()
    border = border_of(page, answer["curves"], motion)
    assert border is not None, "no curve of the motion is the border of its region"

    # the branch at the border's frequency ends at the border
    omega = border.omega
    page.mouse.click(*place(page, omega, border.inside))
    expect(page.locator("#point-name")).to_have_text(motion, timeout=WAIT)
    expect(asks).to_be_enabled(timeout=WAIT)
    page.get_by_role("button", name="Follow the branch").click()
    ends = page.locator("#branch li")
    expect(ends.first).to_be_visible(timeout=WAIT)
    kind, x = border.piece["type"], opened(page)[0]
    told = [re.match(r"(\w+) at clearance ([\d.]+)", text) for text in ends.all_inner_texts()]
    of_kind = [float(match[2]) for match in told if match is not None and match[1] == kind]
    curve = crossing(border, x)
    assert min(abs(value - curve) for value in of_kind) < 1e-3
    asks.click()
    expect(page.locator("#own-curves")).to_contain_text(f"of {motion} are drawn", timeout=WAIT)

    # a figure: the drawing has the curve through the same point, the picture its colour there
    colour = palette.BIFURCATIONS[kind][1]
    unfold(page, "Take home")
    with page.expect_download() as download:
        page.get_by_role("button", name=re.compile("SVG")).click()
    download.value.save_as(tmp_path / "figure.svg")
    drawn = [
        np.array([[float(number) for number in pair.split()] for pair in re.split("[ML]", path.attrib["d"])[1:]])
        for path in ET.parse(tmp_path / "figure.svg").iter(f"{SVG}path")
        if path.get("stroke") == colour and f"of {motion}" in (path.findtext(f"{SVG}title") or "")
    ]
    frame = next(
        rectangle for rectangle in ET.parse(tmp_path / "figure.svg").iter(f"{SVG}rect") if "x" in rectangle.attrib
    )
    on_curve = at_of_frame(page, frame.attrib, x, curve)
    assert min(distance(line, on_curve) for line in drawn) < 1.0
    with page.expect_download() as download:
        page.get_by_role("button", name="PNG", exact=True).click()
    download.value.save_as(tmp_path / "figure.png")
    picture = plt.imread(tmp_path / "figure.png")
    scale = picture.shape[1] / float(ET.parse(tmp_path / "figure.svg").getroot().attrib["width"])
    column, row = np.rint(scale * at_of_frame(page, frame.attrib, omega, border.clearance)).astype(int)
    around = np.round(255 * picture[row - 6 : row + 7, column - 6 : column + 7, :3])
    wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    assert np.abs(around - wanted).max(axis=2).min() <= 2


def crossing(border: Border, omega: float) -> float:
    """Return the clearance at which the border's curve has a frequency, the nearest to the border."""
    x, y = (np.array(border.piece[name]) for name in ("omega", "clearance"))
    clearances = [
        y[k] + (omega - x[k]) / (x[k + 1] - x[k]) * (y[k + 1] - y[k])
        for k in range(len(x) - 1)
        if (x[k] - omega) * (x[k + 1] - omega) <= 0 and x[k] != x[k + 1]
    ]
    return float(min(clearances, key=lambda value: abs(value - border.clearance)))


def at_of_frame(page: Page, frame: dict[str, str], omega: float, clearance: float) -> np.ndarray[Any, Any]:
    """Return where a point of the page's window is in a drawing with this frame."""
    (left, right), (low, high) = beside_axes(page)
    x, y, width, height = (float(frame[name]) for name in ("x", "y", "width", "height"))
    return np.array([x + (omega - left) / (right - left) * width, y + (high - clearance) / (high - low) * height])


def distance(line: np.ndarray[Any, Any], spot: np.ndarray[Any, Any]) -> float:
    """Return the distance of a point from a line of straight pieces."""
    start, along = line[:-1], np.diff(line, axis=0)
    share = np.einsum("ij,ij->i", spot - start, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-30)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * along
    return float(np.hypot(*(nearest - spot).T).min())
