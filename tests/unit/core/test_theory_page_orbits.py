"""The numbers of the theory page on one-impact motions are the computed ones, to the last printed digit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_theory_page import PROPORTIONAL, cells

from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.steady_maxima import steady_motion
from grazemap_core.maps.margins import grazing_margins
from grazemap_core.maps.planes import Axis, Plane
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_branches import one_impact_branch
from grazemap_core.orbits.varied_gaps import VariedFactor
from grazemap_core.orbits.window_curves import window_curves

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


@pytest.mark.parametrize(("label", "index"), [("SN", 1), ("GR, with the other stop", 2)])
def test_curves_over_the_forces(label, index):
    """At the frequency of the branch F is the clearance of the stops over that of the branch, and v is F times its."""
    stops, known = 2.0, one_impact_branch(PROPORTIONAL, 0.27).special_points[index]
    found = window_curves(PROPORTIONAL, (0.27, 0.271), (1.0, 1.2), 1, 2, VariedFactor("forcing", stops, stops))
    (curve,) = (one for one in found if (one.type, one.symmetric) == (known.type, False))
    factor, speed = curve.value[0], curve.impact_velocity[0]
    assert cells(f"factor of the forces, {label}") == [f"{factor:.12f}", f"{speed:.12f}"]
    assert factor == pytest.approx(stops / known.clearance, rel=1e-13)
    assert speed == pytest.approx(factor * known.impact_velocity, rel=1e-13)


@pytest.mark.parametrize("omega", [0.1, 0.27, 0.51])
def test_margins_of_the_stops(omega):
    """The page's formulas, with two harmonics and a bias."""
    parts = [force(k, np.array([a, 0.0, 0.0]), np.zeros(3)) for k, a in ((1, 1.0), (2, 0.7))]
    bias = np.array([0.1, 0.0, 0.0])
    system = replace(Oscillator.of_structure(PROPORTIONAL.structure, PROPORTIONAL.contact, parts, 0.8), bias=bias)
    place, motion = contact_equilibrium(system), steady_motion(system, np.array([omega]))
    right, left = (motion.toward(stop).amplitude[0] for stop in (1, -1))
    assert right != pytest.approx(left, rel=1e-4)
    forcing, factor = Axis("forcing", np.array([0.5, 2.0])), Axis("bias", np.array([-1.0, 3.0]))
    at = ParameterPoint.of(system, omega, 1.6)
    for found, side, largest in zip(
        grazing_margins(Plane(system, at, forcing, factor)), (1, -1), (right, left), strict=True
    ):
        expected = [[1.6 - side * beta * place - f * largest for f in forcing.values] for beta in factor.values]
        np.testing.assert_allclose(found, expected, rtol=1e-12)


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
