"""Bifurcation curves and unfolding diagrams over any two parameters, as clients decode them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.wire import parse_request
from grazemap_worker.processes import IMPLEMENTATIONS
from tests.support.computed import tiled, whole

OMEGA = {"vary": "omega", "values": {"start": 0.265, "stop": 0.295}}


def curves_of(vary: str, start: float, stop: float, **more: Any) -> dict[str, Any]:
    up = {"vary": vary, "values": {"start": start, "stop": stop}}
    return whole("bifurcation-curves", {"horizontal": OMEGA, "vertical": up, **more})


def test_curves_over_the_forces_in_either_order_are_the_closed_form_s() -> None:
    body: dict[str, Any] = {"clearance": 1.87, "points": 24, "max_multiple": 1}
    document = curves_of("forcing", 0.8, 1.2, **body)
    up = {"vary": "forcing", "values": {"start": 0.8, "stop": 1.2}}
    turned = whole("bifurcation-curves", {"horizontal": up, "vertical": OMEGA, **body})
    assert {curve["type"] for curve in document["curves"]} >= {"SN", "PD", "SB", "GR"}
    assert document["motions"] == []
    for curve, other in zip(document["curves"], turned["curves"], strict=True):
        assert "omega" not in curve
        np.testing.assert_array_equal(curve["horizontal"], other["vertical"])
        np.testing.assert_array_equal(curve["vertical"], other["horizontal"])
        assert np.all((curve["vertical"] >= 0.8) & (curve["vertical"] <= 1.2))


def test_motions_over_a_restitution_are_those_with_one_impact_and_each_says_whether_it_was_found() -> None:
    document = curves_of("restitution", 0.5, 0.9, clearance=1.87, max_multiple=1)
    assert [motion["stops"] for motion in document["motions"]] == [[1], [1, -1]]
    assert all(motion["reason"] is None and 0.5 <= motion["vertical"] <= 0.9 for motion in document["motions"])
    assert {curve["type"] for curve in document["curves"]} >= {"SN", "SB", "GR"}
    assert {curve["of_motion"] for curve in document["curves"]} == {0, 1}
    far = curves_of("restitution_left", 0.5, 0.6, clearance=40.0, max_multiple=1)
    assert [motion["stops"] for motion in far["motions"]] == [[1], [-1]]
    for motion in far["motions"]:
        assert "no motion with these stops" in motion["reason"] or not motion["admissible"]


def test_an_orbit_that_is_given_by_its_place_is_followed_over_two_gaps() -> None:
    sides = [{"vary": f"clearance_{side}", "values": {"start": 1.8, "stop": 1.95}} for side in ("right", "left")]
    motion = {"period": 1, "stops": [1], "horizontal": 1.85, "vertical": 1.9}
    body = {"horizontal": sides[0], "vertical": sides[1], "omega": 0.27, "motions": [motion]}
    document = whole("bifurcation-curves", body)
    (started,) = document["motions"]
    assert (started["horizontal"], started["vertical"], started["reason"]) == (1.85, 1.9, None)
    folds = [curve for curve in document["curves"] if curve["type"] == "SN"]
    assert folds
    for curve in folds:  # the left stop is not touched
        assert np.ptp(curve["horizontal"]) < 1e-12


@pytest.mark.parametrize(
    ("across", "up", "more"),
    [
        (("omega", 0.27, 0.29), ("forcing", 0.95, 1.05), {"clearance": 1.89}),
        (("omega", 0.27, 0.29), ("restitution", 0.6, 0.9), {"clearance": 1.89}),
        (("clearance_right", 1.8, 1.95), ("clearance_left", 1.8, 1.95), {"omega": 0.28}),
    ],
    ids=["forcing", "restitution", "gaps"],
)
def test_a_diagram_of_any_plane_has_its_grazing_curves_and_borders(
    across: tuple[str, float, float], up: tuple[str, float, float], more: dict[str, float]
) -> None:
    axes = [{"vary": name, "values": {"start": start, "stop": stop, "points": 8}} for name, start, stop in (across, up)]
    body = {"horizontal": axes[0], "vertical": axes[1], "max_periods": 400, "borders": True, "max_multiple": 1, **more}
    plan = IMPLEMENTATIONS["unfolding-diagrams"].plan(parse_request("unfolding-diagrams", body))
    assert (plan.rows, plan.columns) == (8, 8)
    assert plan.estimate.seconds > 0.0
    diagram = tiled("unfolding-diagrams", body, 8, 5)
    assert {"grazing_curve", "codimension_two_points"}.isdisjoint(diagram)
    assert ("bifurcation_curves" in diagram) == ("omega" in (across[0], up[0]))
    assert {curve["stop"] for curve in diagram["grazing_curves"]} == ({1} if "omega" in across else {1, -1})
    borders = diagram["borders"]
    assert len(borders["row"]) > 3
    unexplained = borders["explanation"] == 0
    assert np.count_nonzero(unexplained & borders["regular"]) <= 0.2 * len(unexplained)
    for curve in borders["curves"]:
        assert curve["horizontal"].shape == curve["vertical"].shape


def test_a_diagram_over_the_forces_with_a_stop_at_the_equilibrium_has_no_curve_that_moves() -> None:
    """No force lifts the contact off that stop, so neither the grazing curve nor those that leave it exist."""
    body = {
        "horizontal": {"vary": "omega", "values": {"start": 0.28, "stop": 0.29, "points": 2}},
        "vertical": {"vary": "forcing", "values": {"start": 0.9, "stop": 1.1, "points": 2}},
        "clearance": {"right": 0.0},
        "max_periods": 50,
    }
    diagram = tiled("unfolding-diagrams", body)
    assert diagram["bifurcation_curves"] == {"curves": [], "motions": []}
    assert diagram["unfolding_map"]["kind"].shape == (2, 2)
