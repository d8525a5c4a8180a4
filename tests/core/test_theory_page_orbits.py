"""The numbers of the theory page on one-impact motions are the computed ones, to the last printed digit."""

from __future__ import annotations

import pytest
from test_theory_page import PROPORTIONAL, cells

from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_branches import one_impact_branch

ONE_MASS = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)


@pytest.mark.parametrize(
    ("label", "index", "kind"),
    [
        ("one impact, graze of the steady motion", 0, "GR"),
        ("one impact, SN", 1, "SN"),
        ("one impact, GR, with the other stop", 2, "GR"),
    ],
)
def test_special_points_of_a_branch(label, index, kind):
    point = one_impact_branch(PROPORTIONAL, 0.27).special_points[index]
    assert point.type == kind
    assert cells(label) == [f"{point.clearance:.12f}", f"{point.impact_velocity:.12f}", f"{point.angle:.12f}"]


@pytest.mark.parametrize(
    ("label", "system", "start", "stop", "bifurcation"),
    [
        ("unfolding, SN", PROPORTIONAL, 0.2795, 0.283, "SN"),
        ("unfolding, PD", PROPORTIONAL, 0.2795, 0.283, "PD"),
        ("unfolding, one mass, SN", ONE_MASS, 0.66, 0.67, "SN"),
        ("unfolding, one mass, PD", ONE_MASS, 0.66, 0.67, "PD"),
    ],
)
def test_unfoldings(label, system, start, stop, bifurcation):
    points = codimension_two_points(system, start, stop, max_order=1, max_multiple=1)
    (point,) = [p for p in points if p.kind == "resonant" and not p.symmetric and p.bifurcation == bifurcation]
    unfolding = point.unfolding
    order, coefficient = ("x", unfolding.slope) if unfolding.quadratic is None else ("x^2", unfolding.quadratic)
    expected = [f"{point.omega:.12f}", order, f"{coefficient:.5f}", f"{unfolding.velocity_slope:.5f}"]
    assert cells(label) == expected
