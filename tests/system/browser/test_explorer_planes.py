"""Planes of other parameters than omega and clearance, and explained borders, in the explorer."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import parse_qs, quote, urlsplit

import httpx2
import numpy as np
import pytest
from playwright.sync_api import Page, expect

from grazemap import Client
from grazemap.wire import Oscillator
from grazemap.wire.planes import with_parameter
from tests.support.explorer_page import (
    QUICK,
    WAIT,
    answered,
    holds,
    is_free,
    place,
    reading,
    show,
    spot,
    trajectories_of_points,
    unfold,
    verified,
)
from tests.support.watched_page import Watched

pytestmark = [pytest.mark.browser, pytest.mark.timeout(240)]

OVER_RESTITUTION = "horizontal=omega&vertical=restitution&omega=0.265625..0.28125&restitution=0.5..0.75&clearance=1.88"
OVER_FORCES = "horizontal=omega&vertical=forcing&omega=0.28125..0.296875&forcing=0.75..1&clearance=1.8"
BESIDE_BORDERS = "omega=0.2734375..0.27734375&clearance=1.8125..1.84375"


def point_at(page: Page, x: float, y: float) -> str:
    """Point at the plane, and return what the page says of it."""
    return reading(page, place(page, x, y))


def assert_told(page: Page, url: str, asked: dict[str, Any]) -> None:
    """Fail where the page does not say the motions of a map over lists of values, which the API is asked for."""
    umap = answered(url, "unfolding-maps", asked)
    across, up = asked["horizontal"]["values"], asked["vertical"]["values"]
    for row, column in np.ndindex(len(up), len(across)):
        label = umap["motions"][umap["motion"][row][column]]["label"]
        assert f": {label};" in point_at(page, across[column], up[row])


def test_a_plane_over_a_restitution_is_the_map_of_the_api_with_its_grazing_curve(watched: Watched, url: str) -> None:
    page = show(watched, url, OVER_RESTITUTION)
    request = next(body for body in watched.posted("unfolding-maps") if "preview" not in body)
    assert (request["horizontal"]["vary"], request["vertical"]["vary"]) == ("omega", "restitution")
    assert request["clearance"] == 1.88
    assert "omega" not in request
    axes = {
        "horizontal": {"vary": "omega", "values": [0.268, 0.27, 0.28]},
        "vertical": {"vary": "restitution", "values": [0.55, 0.6, 0.7]},
    }
    assert_told(page, url, {**axes, "clearance": 1.88, "max_periods": 400})
    asked = {"omega": {"start": 0.265625, "stop": 0.28125, "points": 2001}}
    curve = answered(url, "grazing-curves", asked)
    touching = np.interp(1.88, curve["clearance"], curve["omega"])
    assert "Grazing curve: on it the steady motion just touches the right stop" in point_at(page, touching, 0.6)


UNEQUAL = {
    "oscillator": {"masses": [1, 10, 10], "stiffnesses": [1, 5, 5], "forcing": [1, 0, 0], "restitution": 0.8},
    "stops": "unequal",
    "left": 1.9,
}


def test_both_clearances_of_unequal_stops_may_vary(small: Watched, url: str) -> None:
    axes = "horizontal=clearance&vertical=clearance_left&clearance=1.75..2&clearance_left=1.75..2&omega=0.28"
    page = show(small, url, f"{axes}&machine={quote(json.dumps(UNEQUAL))}")
    expect(page.locator("#up option:checked")).to_have_text("clearance of the left stop")
    expect(page.locator("#across option:checked")).to_have_text("clearance of the right stop")
    axes = {
        axis: {"vary": name, "values": [1.8, 1.9]}
        for axis, name in (("horizontal", "clearance_right"), ("vertical", "clearance_left"))
    }
    assert_told(page, url, {**axes, "oscillator": UNEQUAL["oscillator"], "omega": 0.28, "max_periods": 400})
    page.mouse.click(*place(page, 1.8, 1.9))
    expect(page.locator("#point-place")).to_have_text(
        re.compile(r"^ω = 0.28, clearance of the right stop 1\.[78]\d*, clearance of the left stop 1\.[89]"),
        timeout=WAIT,
    )
    (trajectory,) = trajectories_of_points(small)
    assert trajectory["clearance"]["left"] == pytest.approx(1.9, abs=1e-3)


def test_the_graze_of_a_fixed_left_stop_is_drawn(small: Watched, url: str) -> None:
    page = show(small, url, f"omega=0.265625..0.28125&clearance=1.9375..2&machine={quote(json.dumps(UNEQUAL))}")
    asked = {"omega": {"start": 0.265625, "stop": 0.28125, "points": 2001}}
    curve = answered(url, "grazing-curves", asked)
    touching = np.interp(1.9, curve["clearance"], curve["omega"])
    assert "just touches the left stop" in point_at(page, touching, 1.97)


def test_a_point_over_the_forces_is_the_machine_with_such_forces(watched: Watched, url: str) -> None:
    page = show(watched, url, OVER_FORCES)
    page.mouse.click(*place(page, 0.29, 0.95))
    expect(page.locator("#point-name")).to_have_text(re.compile(r"^\d"), timeout=WAIT)
    expect(page.locator("#point-place")).to_contain_text("factor of the forces")
    omega, factor = (float(part) for part in parse_qs(urlsplit(page.url).fragment)["at"][0].split(","))
    (trajectory,) = trajectories_of_points(watched)
    assert (trajectory["omega"], trajectory["clearance"]) == (omega, 1.8)
    assert trajectory["oscillator"]["forcing"] == [factor, 0, 0]
    label = page.locator("#point-name").text_content()
    assert f": {label};" in point_at(page, omega, factor)
    expect(page.locator("#ask-branch")).to_have_text("Follow the branch over the factor of the forces")
    page.locator("#ask-branch").click()
    expect(page.locator("#branch")).to_contain_text("at factor of the forces", timeout=WAIT)
    branch = watched.posted("orbit-branches")[0]
    assert branch["axis"]["vary"] == "forcing"
    assert branch["axis"]["values"]["start"] * factor == pytest.approx(0.75)


def test_the_parameters_are_chosen_in_the_form_and_the_history_goes_back(small: Watched, url: str) -> None:
    page = show(small, url, QUICK)
    unfold(page, "View")
    form = page.locator("#plane-form")
    form.locator("[name=vertical]").select_option("masses[3]")
    expect(page).to_have_url(re.compile(r"vertical=masses%5B3%5D.*masses%5B3%5D=7.5..12.5&clearance=2.125$"))
    expect(form.locator("[name=clearance]")).to_have_value("2.125")
    form.locator("[name=clearance]").fill("2.25")
    form.locator("[name=clearance]").press("Enter")
    expect(page).to_have_url(re.compile("clearance=2.25$"))
    form.locator("[name=horizontal]").select_option("masses[3]")  # the axes change places
    expect(page).to_have_url(
        re.compile(r"horizontal=masses%5B3%5D&vertical=omega&masses%5B3%5D=7.5..12.5&omega=0.25..")
    )
    for _ in range(3):
        page.go_back()
    expect(page).to_have_url(re.compile(r"#omega=0.25..0.28125&clearance=2..2.25$"))
    expect(form.locator("[name=vertical]")).to_have_value("clearance")


CHAIN = {"masses": [1, 2], "stiffnesses": [3, 4], "damping": [0.1, 0.2], "forcing": [1, 0], "bias": [0.5, 0]}
DENSE = {
    "matrices": {"mass": [[1, 0], [0, 2]], "stiffness": [[3, -1], [-1, 4]], "damping": {"modal": 0.05}},
    "contact": [1, 2],
    "forcing": {"amplitude": [1, 0], "law": "unbalance"},
}
SHAKEN = {"masses": [1], "stiffnesses": [2], "damping": 0.1, "base": {"amplitude": 0.5, "stops_move": True}}
AT: list[tuple[dict[str, Any], str, float]] = [
    (CHAIN, "restitution", 0.6),
    (CHAIN, "forcing", 2.0),
    (CHAIN, "bias", 2.0),
    (CHAIN, "damping", 2.0),
    (CHAIN, "stiffnesses[2]", 5.0),
    (DENSE, "damping", 2.0),
    (DENSE, "forcing", 2.0),
    (SHAKEN, "forcing", 2.0),
]


def test_the_machine_at_a_point_is_that_of_the_api(small: Watched, url: str) -> None:
    page = show(small, url, QUICK, wait=False)
    at = """async ([oscillator, name, value]) => {
        const { placeOf } = await import("/static/explorer/parameters.js");
        const plane = { horizontal: "omega", vertical: name, omega: null, clearance: 1 };
        return placeOf({ oscillator, stops: "equal" }, plane, [2, value]).machine.oscillator;
    }"""
    for oscillator, name, value in AT:
        machine = Oscillator(**page.evaluate(at, [oscillator, name, value]))
        assert machine == with_parameter(Oscillator(**oscillator), name, value), name
        assert machine != Oscillator(**oscillator), name
    default = page.evaluate(at, [None, "damping", 1.0])
    assert Oscillator(**default) == Oscillator()


def test_the_power_is_asked_for_with_the_tiles_and_is_that_of_the_api(small: Watched, url: str) -> None:
    page = show(small, url, "omega=0.28125..0.296875&clearance=1.75..1.8125")
    label = point_at(page, 0.29, 1.78).partition(": ")[2].partition(";")[0]
    page.locator("#layer").select_option("dissipated_power")
    expect(page.locator("#ramp-text")).to_have_text(re.compile("^Dissipated power: 0 to "), timeout=WAIT)
    verified(page)
    request = small.posted("unfolding-maps")[-1]
    assert request["observables"] == ["dissipated_power"]
    tile = next(
        body
        for body in small.posted("unfolding-maps")
        if "observables" in body and "preview" not in body and holds(body, 0.29, 1.78)
    )
    umap = answered(url, "unfolding-maps", tile)
    column, row = (
        int(np.argmin(np.abs(np.array(umap[axis]) - at))) for axis, at in (("omega", 0.29), ("clearance", 1.78))
    )
    text = point_at(page, umap["omega"][column], umap["clearance"][row])
    assert f": {label};" in text
    power = re.search(r"dissipated power ([0-9.e-]+)$", text)
    assert power is not None, text
    assert float(power[1]) == pytest.approx(umap["dissipated_power"][row][column], rel=1e-3)


def test_borders_say_why_they_are_there(small: Watched, url: str) -> None:
    page = show(small, url, BESIDE_BORDERS)
    unfold(page, "View")
    page.locator("#borders").check()
    page.keyboard.press("Escape")
    expect(page).to_have_url(re.compile("borders=explained"))
    with page.expect_response(
        lambda response: "unfolding-diagrams" in response.url or "/result" in response.url, timeout=WAIT
    ):
        pass
    (request,) = small.posted("unfolding-diagrams")
    assert request["borders"] is True
    jobs = httpx2.get(f"{url}/v1/jobs?process=unfolding-diagrams&limit=1").json()["jobs"]
    with Client(url) as client:
        diagram = client.job(jobs[0]["id"]).wait().result()
    verified(page)
    umap, borders = diagram.unfolding_map, diagram.borders
    labels, (rows, columns) = umap.labels(), borders.others()
    (left, right), (low, high) = (0.2734375, 0.27734375), (1.8125, 1.84375)
    told = 0
    for k in range(0, len(borders), max(1, len(borders) // 20)):
        ends = (borders.row[k], borders.column[k]), (rows[k], columns[k])
        x, y = (
            sum(float(axis[end[part]]) for end in ends) / 2 for axis, part in ((umap.omega, 1), (umap.clearance, 0))
        )
        if left < x < right and low < y < high and is_free(page, spot(page, x, y)):
            first, second = sorted(str(labels[end]) for end in ends)
            told += f"Border between {first} and {second}: " in point_at(page, x, y)
    assert told > 3
