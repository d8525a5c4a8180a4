"""Bifurcation curves and unfolding diagrams of any oscillator and any stops as requests and documents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.results import BifurcationCurves, UnfoldingDiagram
from grazemap.wire.processes import parse_request
from grazemap_worker.processes import IMPLEMENTATIONS
from tests.support.computed import refused_at, result_of, tiled, whole
from tests.support.thorough import the_first

COCO = {
    "matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]},
    "forcing": {"amplitude": [1.0], "phase": [np.pi / 2]},
    "bias": [0.1],
    "restitution": {"right": 0.8, "left": 0.7},
}
OMEGA, CLEARANCE = {"start": 0.75, "stop": 0.85}, {"start": 1.0, "stop": 3.0}
WINDOW = {"oscillator": COCO, "omega": OMEGA, "clearance": CLEARANCE}
GRID = {"omega": {"start": 0.279, "stop": 0.286, "points": 6}, "max_periods": 300, "max_order": 4, "max_multiple": 1}
ROWS = {"start": 1.86, "stop": 1.97, "points": 6}
PRELOADED = {"right": ROWS, "left": 0.5}
"""With a bias that moves the equilibrium beyond the left stop."""


def test_requests_of_equal_stops_have_the_simplest_text() -> None:
    window = {"omega": OMEGA, "clearance": CLEARANCE}
    both = parse_request("bifurcation-curves", window).canonical()
    assert both["vertical"] == {"vary": "clearance", "values": CLEARANCE}
    assert "clearance" not in both
    for clearance in ({"right": CLEARANCE}, {"right": CLEARANCE, "left": None}):
        text = parse_request("bifurcation-curves", {**window, "clearance": clearance}).canonical()
        assert text["vertical"] == {"vary": "clearance_right", "values": CLEARANCE}
        assert text["clearance"] == {"left": None}
    diagram = parse_request("unfolding-diagrams", {**GRID, "clearance": ROWS})
    assert diagram.canonical()["vertical"] == {"vary": "clearance", "values": ROWS}
    assert diagram.plane.mirrors
    assert "clearance" not in diagram.grazing_curve.canonical()
    assert "clearance" not in diagram.codimension_two_points.canonical()
    for change in ({"clearance": {"right": ROWS}}, {"oscillator": {"restitution": {"right": 0.8, "left": 0.7}}}):
        assert not parse_request("unfolding-diagrams", {**GRID, "clearance": ROWS, **change}).plane.mirrors


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"clearance": 1.5}, ("clearance",)),
        ({"clearance": {"right": CLEARANCE, "left": CLEARANCE}}, ("clearance",)),
        ({"clearance": {"right": 1.5, "left": 1.2}}, ("clearance",)),
        ({"clearance": {"right": CLEARANCE, "left": -1.0}}, ("clearance",)),
        ({"clearance": {"right": {"start": 2.0, "stop": 1.0}}}, ("clearance", "right")),
        ({"clearance": {"start": -2.0, "stop": 1.0}}, ("clearance", "start")),
        ({"clearance": {"right": CLEARANCE, "up": 1.0}}, ("clearance", "up")),
        (
            {"clearance": {"right": CLEARANCE}, "motions": [{"period": 1, "stops": [1, -1]}]},
            ("motions", "0", "stops"),
        ),
        (
            {"clearance": {"left": CLEARANCE}, "motions": [{"period": 1, "stops": [-1], "clearance": 4.0}]},
            ("motions", "0", "clearance"),
        ),
    ],
)
def test_errors_name_the_field(change: dict[str, Any], place: tuple[str, ...]) -> None:
    parse_request("bifurcation-curves", WINDOW)
    assert refused_at("bifurcation-curves", WINDOW | change) == place


@pytest.mark.parametrize(
    ("clearance", "families"),
    [
        (CLEARANCE, {"1-1r-(-1)l", "1-(-1)r-1l", "1-(-1)r-(-1)l"}),
        ({"right": CLEARANCE}, {"1-1r-(-1)l", "1-(-1)r-(-1)l"}),
        ({"left": CLEARANCE}, {"1-(-1)r-1l", "1-(-1)r-(-1)l"}),
        ({"right": CLEARANCE, "left": 2.0}, {"1-1r-(-1)l", "1-(-1)r-1l", "1-(-1)r-(-1)l"}),
    ],
)
def test_curves_in_closed_form_have_every_field(clearance: dict[str, Any], families: set[str]) -> None:
    body = {**WINDOW, "clearance": clearance, "max_multiple": 1, "points": 40}
    curves = whole("bifurcation-curves", body)["curves"]
    assert {curve["motion"] for curve in curves} == families
    assert "clearance_right" not in curves[0]
    grazing = [curve for curve in curves if curve["motion"] == "1-(-1)r-(-1)l"]
    assert {curve["type"] for curve in grazing} == {"GR"}
    assert not any(np.any(curve["impact_velocity"]) for curve in grazing)
    assert IMPLEMENTATIONS["bifurcation-curves"].plan(parse_request("bifurcation-curves", body)).estimate.seconds > 0.0


@pytest.mark.parametrize(
    ("clearance", "stops"),
    the_first(
        1,
        [
            ({"right": CLEARANCE, "left": 1.4}, [1, -1]),
            ({"right": CLEARANCE}, [1]),
            ({"right": 2.4, "left": CLEARANCE}, [-1]),
        ],
    ),
)
def test_points_of_continued_curves_are_requests_of_special_orbits(clearance: dict[str, Any], stops: list[int]) -> None:
    body = {**WINDOW, "clearance": clearance, "motions": [{"period": 1, "stops": stops}]}
    document = whole("bifurcation-curves", body)
    (motion,) = document["motions"]
    assert motion["reason"] is None
    result = result_of("bifurcation-curves", body, document)
    assert isinstance(result, BifurcationCurves)
    assert result.varied_stop == ("left" if stops == [-1] else "right")
    seen = set()
    for curve in result.curves:
        if curve.type == "GR":
            continue
        asked = curve.orbit(len(curve.omega) // 2)
        orbit = whole("periodic-orbits", {"oscillator": COCO, **asked})
        assert orbit["converged"]
        multipliers = orbit["multipliers"] @ np.array([1.0, 1j])
        apart = {"SN": multipliers - 1.0, "PD": multipliers + 1.0, "NS": np.abs(multipliers) - 1.0}[curve.type]
        assert np.min(np.abs(apart)) < 1e-5
        varied = orbit[f"clearance_{result.varied_stop}"]
        assert varied == curve.clearance[len(curve.omega) // 2]
        seen.add(curve.type)
    assert seen


def test_an_orbit_that_is_given_in_a_window_of_one_stop_is_followed() -> None:
    orbit = whole(
        "periodic-orbits", {**WINDOW, "omega": 0.8, "clearance": {"right": 2.0}, "motion": {"period": 1, "stops": [1]}}
    )
    motion = {name: np.asarray(orbit[name]).tolist() for name in ("period", "stops", "phases", "velocities")}
    known = {**motion, "omega": 0.8, "clearance": 2.0}
    document = whole("bifurcation-curves", {**WINDOW, "clearance": {"right": CLEARANCE}, "motions": [known]})
    assert document["motions"][0]["clearance"] == 2.0
    assert {"PD", "GR"} <= {curve["type"] for curve in document["curves"]}
    assert all(np.all(np.isnan(curve["clearance_left"])) for curve in document["curves"])


@pytest.mark.parametrize(
    ("clearance", "oscillator"),
    the_first(
        1,
        [
            ({"right": ROWS}, {}),
            ({"right": 1.93, "left": ROWS}, {}),
            (ROWS, {"restitution": {"right": 0.8, "left": 0.7}}),
            (ROWS, {"bias": [0.02, 0.0, 0.0]}),
            (PRELOADED, {"bias": [-1.0, 0.0, 0.0]}),
        ],
    ),
)
def test_diagrams_have_every_field_and_no_border_is_unexplained(clearance: Any, oscillator: dict[str, Any]) -> None:
    body = {**GRID, "oscillator": oscillator, "clearance": clearance, "borders": True}
    request = parse_request("unfolding-diagrams", body)
    diagram = result_of("unfolding-diagrams", body, tiled("unfolding-diagrams", body))
    assert isinstance(diagram, UnfoldingDiagram)
    assert diagram.unfolding_map.meta["request"] == request.unfolding_map.canonical()
    alike = clearance is ROWS and "bias" not in oscillator
    assert (diagram.grazing_curve is None) != alike
    assert (diagram.stop_grazing_curves is None) == (alike or clearance is PRELOADED)
    assert diagram.borders is not None
    assert diagram.borders.count("unexplained") == 0
    assert "unexplained" in diagram.summary()
    assert not diagram.mirrors
    labels = {motion for border in diagram.border_list() for motion in border.motions}
    if clearance == {"right": 1.93, "left": ROWS}:
        assert any(label.startswith("1-(-1)r") for label in labels)
