"""Orbits and branches of any oscillator and any stops as requests and documents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.wire.processes import parse_request
from tests.support.computed import refused_at, whole

ONE = {"motion": {"period": 1, "stops": [1]}}
COCO = {
    "matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]},
    "forcing": {"amplitude": [1.0], "phase": [np.pi / 2]},
    "bias": [0.1],
    "restitution": {"right": 0.8, "left": 0.7},
}


def test_equal_sides_are_one_number() -> None:
    """So that today's questions keep their text, and those that mean the same have the same."""
    plain = {"omega": 0.27, "clearance": 1.85, **ONE}
    same = {**plain, "clearance": {"right": 1.85, "left": 1.85}}
    for process, more in (("periodic-orbits", {}), ("orbit-branches", {"range": {"start": 1.8, "stop": 1.9}})):
        texts = [parse_request(process, {**body, **more}).canonical() for body in (plain, same)]
        assert texts[0] == texts[1]
        assert texts[0]["clearance"] == 1.85
        alone = parse_request(process, {**plain, **more, "vary": "clearance_right"} if more else plain).canonical()
        assert alone["clearance"] == 1.85
    absent = parse_request("periodic-orbits", {**plain, "clearance": {"right": 1.85}}).canonical()
    assert absent["clearance"] == {"right": 1.85, "left": None}


@pytest.mark.parametrize(
    ("change", "place"),
    [
        ({"clearance": {"right": None, "left": None}}, ("clearance",)),
        ({"clearance": {"right": -1.0, "left": 0.5}}, ("clearance",)),
        ({"clearance": {"left": 1.0}}, ("motion", "stops")),
        ({"vary": "clearance"}, ("vary",)),
        ({"vary": "clearance_left"}, ("vary",)),
        ({"vary": "speed"}, ("vary",)),
        ({"vary": "restitution", "range": {"start": 0.5, "stop": 0.9}}, ("vary",)),
        ({"vary": "bias", "oscillator": {}, "range": {"start": 0.5, "stop": 1.5}}, ("vary",)),
        ({"vary": "restitution_left", "range": {"start": 0.5, "stop": 1.5}}, ("range", "stop")),
        ({"vary": "restitution_left", "range": {"start": -0.5, "stop": 0.9}}, ("range", "start")),
        ({"vary": "forcing", "range": {"start": -0.5, "stop": 1.5}}, ("range", "start")),
        ({"range": {"start": 1.5, "stop": 2.0}}, ("range",)),
    ],
)
def test_errors_name_the_field(change: dict[str, Any], place: tuple[str, ...]) -> None:
    body = {
        "oscillator": COCO,
        "omega": 0.8,
        "clearance": {"right": 1.2, "left": None},
        **ONE,
        "vary": "clearance_right",
        "range": {"start": 1.0, "stop": 1.5},
    }
    parse_request("orbit-branches", body)
    assert refused_at("orbit-branches", body | change) == place


@pytest.mark.parametrize(
    ("vary", "bounds"),
    [
        ("clearance_right", (1.5, 4.0)),
        ("bias", (-20.0, 20.0)),
        ("forcing", (0.3, 2.0)),
        ("restitution_right", (0.1, 1.0)),
        ("omega", (0.7, 0.95)),
    ],
)
def test_an_orbit_beyond_a_special_point_is_a_request(vary: str, bounds: tuple[float, float]) -> None:
    """The doubled orbit beyond a PD has, as a request of its own, the factors in its oscillator."""
    body = {
        "oscillator": COCO,
        "omega": 0.8,
        "clearance": {"right": 2.1, "left": None},
        **ONE,
        "vary": vary,
        "range": {"start": bounds[0], "stop": bounds[1]},
    }
    document = whole("orbit-branches", body)
    assert document["reason"] is None
    assert np.all(np.isnan(document["clearance"]))
    assert np.all(np.isnan(document["clearance_left"]))
    assert np.all(document["restitution_left"] == 0.7)
    varied = document[vary]
    np.testing.assert_array_equal(document["parameter"], varied)
    assert {point["type"] for point in document["special_points"]} & {"PD", "GR", "SN"}
    for point in document["special_points"]:
        assert point["parameter"] == point[vary]
        for beyond in point["beyond"]:
            orbit = whole("periodic-orbits", beyond["request"])
            assert orbit["converged"]
            assert orbit["clearance_right"] == beyond["request"]["clearance"]["right"]
            assert orbit["admissible"] == beyond["admissible"]


def test_a_trajectory_from_rest_leads_to_the_orbit_between_unlike_stops() -> None:
    body = {"oscillator": COCO, "omega": 0.8, "clearance": {"right": 1.2, "left": 1.3}}
    orbit = whole("periodic-orbits", body)
    assert orbit["converged"]
    assert orbit["verified"]
    assert (orbit["clearance_right"], orbit["clearance_left"]) == (1.2, 1.3)
    assert np.isnan(orbit["clearance"])
    again = whole(
        "periodic-orbits",
        {
            **body,
            "motion": {name: np.asarray(orbit[name]).tolist() for name in ("period", "stops", "phases", "velocities")},
        },
    )
    np.testing.assert_allclose(again["phases"], orbit["phases"], rtol=0.0, atol=1e-12)
