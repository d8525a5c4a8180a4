"""Maps and diagrams over any parameters, as clients decode them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.wire import canonical_id, parse_request
from grazemap_worker.processes import IMPLEMENTATIONS
from tests.support.computed import tiled, whole

OMEGA = {"vary": "omega", "values": {"start": 0.27, "stop": 0.29, "points": 4}}
UP = {
    "restitution": {"start": 0.5, "stop": 0.8, "points": 3},
    "damping": {"start": 0.8, "stop": 1.2, "points": 3},
    "masses[2]": {"start": 9.0, "stop": 11.0, "points": 3},
    "stiffnesses[3]": {"start": 4.0, "stop": 6.0, "points": 3},
}


def body_of(vary: str) -> dict[str, Any]:
    up = {"vary": vary, "values": UP[vary]}
    return {"horizontal": OMEGA, "vertical": up, "clearance": 1.6, "max_periods": 200}


@pytest.mark.parametrize(
    "vary", [vary if vary == "restitution" else pytest.param(vary, marks=pytest.mark.thorough) for vary in UP]
)
def test_any_cut_of_a_plane_gives_the_same_map(vary: str) -> None:
    single, cut = (tiled("unfolding-maps", body_of(vary), *tile) for tile in ((3, 4), (2, 3)))
    assert single.keys() == cut.keys()
    for name, array in single.items():
        np.testing.assert_array_equal(array, cut[name])
    np.testing.assert_array_equal(single["horizontal"], np.linspace(0.27, 0.29, 4))
    assert single["margin_right"].shape == (3, 4)


@pytest.mark.thorough
def test_the_values_of_an_oscillator_are_those_of_its_description() -> None:
    """The row of a mass is the map of the oscillator with that mass."""
    umap = tiled("unfolding-maps", body_of("masses[2]"))
    body = {"omega": OMEGA["values"], "clearance": [1.6, 1.7], "oscillator": {"masses": [1.0, 11.0, 10.0]}}
    alone = tiled("unfolding-maps", {**body, "max_periods": 200})
    for name in ("kind", "period", "impacts_right", "multiplier", "least_impact_velocity"):
        np.testing.assert_array_equal(umap[name][2], alone[name][0])


def test_an_adaptive_map_of_a_plane_has_the_labels_of_the_full_one() -> None:
    values = {"start": 0.7, "stop": 1.3, "points": 33}
    body = {
        "horizontal": {"vary": "forcing", "values": values},
        "vertical": {"vary": "clearance_left", "values": values},
    }
    body |= {"omega": 0.29, "clearance": {"right": 1.6}, "max_periods": 100, "preview": True}
    full, adaptive = (tiled("unfolding-maps", {**body, "adaptive": asked}, 33, 33) for asked in (False, True))
    same = adaptive["computed"]
    np.testing.assert_array_equal(adaptive["period"][same], full["period"][same])
    np.testing.assert_array_equal(adaptive["margin_left"], full["margin_left"])


@pytest.mark.parametrize("vary", ["restitution_left", "damping", "masses[1]"])
def test_a_diagram_along_any_parameter_has_the_motions_of_periodic_orbits(vary: str) -> None:
    values = [0.7, 0.8, 1.0]
    body = {"vary": vary, "range": values, "omega": 0.29, "clearance": 1.6, "periods": 4}
    document = whole("bifurcation-diagrams", body)
    assert document["parameter"].tolist() == values
    oscillator = {"restitution": {"right": 0.8, "left": 1.0}} if vary == "restitution_left" else {}
    clearance_body = {"vary": "clearance", "range": [1.6, 1.7], "omega": 0.29, "periods": 4, "oscillator": oscillator}
    first = whole("bifurcation-diagrams", clearance_body)["sections"][0]
    assert document["sections"][2]["motion"] == first["motion"]
    np.testing.assert_allclose(document["sections"][2]["displacement"], first["displacement"], atol=1e-6)


def test_a_plane_of_structures_takes_longer_by_the_estimate() -> None:
    seconds = {}
    for vary in ("restitution", "damping"):
        request = parse_request("unfolding-maps", body_of(vary))
        assert canonical_id("unfolding-maps", request.canonical(), "0")
        seconds[vary] = IMPLEMENTATIONS["unfolding-maps"].plan(request).estimate.seconds
    assert seconds["damping"] > 2.0 * seconds["restitution"]
