"""The numbers on the theory page are the computed ones, to the last printed digit."""

from __future__ import annotations

import functools
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.discontinuity_mapping import beyond_stop, largest_overshoot, mapping_error
from grazemap_core.grazing.grazing_curve import VariedStop, grazing_curve, steady_motion
from grazemap_core.grazing.poincare_map import compare_returns
from grazemap_core.grazing.point import grazing_point
from grazemap_core.grazing.recurrence import next_contact
from grazemap_core.maps.plane_grazes import grazing_margins
from grazemap_core.maps.planes import Axis, Plane
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.single_impact.curve_parameter import VariedFactor
from grazemap_core.orbits.single_impact.window_curves import window_curves
from grazemap_core.simulation.monodromy import monodromy
from tests.oracles.next_contacts import simulated_contact
from tests.support.orbits import angle_of, default_orbit, one_impact_motions, special_motion
from tests.support.oscillators import DEFAULT

PAGE = Path(__file__).parents[3] / "docs" / "theory.md"
PAPER_OMEGA = 0.28109
PER_LINK = Oscillator.create(DEFAULT.masses, DEFAULT.stiffnesses, [0.05, 0.05, 0.05], [1.0, 0.0, 0.0], 0.8)
ONE_MASS = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)


def cells(label, occurrence=0):
    """Return the cells after the first one of the table row that starts with this label."""
    rows = re.findall(rf"^\| {re.escape(label)} \|(.*)\|$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [cell.strip() for cell in rows[occurrence].split("|")]


@pytest.mark.parametrize(
    ("label", "occurrence", "system", "omega"),
    [
        ("A(0.1)", 0, DEFAULT, 0.1),
        ("A(0.28109)", 0, DEFAULT, 0.28109),
        ("A(0.28109)", 1, PER_LINK, 0.28109),
    ],
)
def test_amplitudes(label, occurrence, system, omega):
    assert cells(label, occurrence)[0] == f"{grazing_curve(system, [omega]).clearance[0]:.13f}"


@pytest.mark.parametrize(
    ("label", "system", "which"),
    [
        ("gamma = 0.05, recurrence m = 2", DEFAULT, {"order": 2}),
        ("gamma = 0.05, resonant n = 1, SN", DEFAULT, {"bifurcation": "SN", "symmetric": False}),
        ("gamma = 0.05, resonant n = 1, PD", DEFAULT, {"bifurcation": "PD", "symmetric": False}),
        ("zeta_i = 0.05 per link, recurrence m = 2", PER_LINK, {"order": 2}),
    ],
)
def test_points_near_the_paper_s(label, system, which):
    points = codimension_two_points(system, 0.2795, 0.283, max_order=2, max_multiple=1)
    chosen = [p for p in points if all(getattr(p, name) == value for name, value in which.items())]
    assert len(chosen) == 1
    point = chosen[0]
    expected = [f"{point.omega:.12f}", f"{point.clearance:.12f}", f"{point.omega - PAPER_OMEGA:.2e}"]
    assert cells(label) == expected


@pytest.mark.parametrize(
    ("label", "kind", "near"),
    [("corner of the right stop", "corner", 0.51), ("equal clearances, double graze", "double-graze", 0.27)],
)
def test_points_of_two_harmonics(label, kind, near):
    parts = [force(k, np.array([a, 0.0, 0.0]), np.array([p, 0.0, 0.0])) for k, a, p in ((1, 1.0, 0.0), (2, 0.7, 0.3))]
    system = Oscillator.of_structure(DEFAULT.structure, DEFAULT.contact, parts, 0.8)
    points = codimension_two_points(system, near - 0.01, near + 0.01, 1, 0, VariedStop(1, together=True))
    (point,) = (point for point in points if point.kind == kind)
    assert cells(f"two harmonics, {label}") == [f"{point.omega:.12f}", f"{point.clearance:.12f}"]


def test_multiplier_and_exponent():
    point = monodromy(DEFAULT, 0.29, 1.6)
    assert cells("abs(mu_1)")[0] == f"{abs(point.multipliers[0]):.10f}"
    assert cells("largest exponent")[0] == f"{point.exponent:.10f}"


@pytest.mark.parametrize("overshoot", [1e-2, 1e-4, 1e-6, 1e-8])
def test_errors_of_the_discontinuity_mapping(overshoot):
    point = grazing_point(DEFAULT, 0.29)
    error = mapping_error(point, [overshoot * point.clearance])
    expected = [f"{x[0]:.4e}" for x in (error.displacement, error.leading, error.second)]
    assert cells(f"{overshoot:.0e}") == expected


def test_the_end_of_the_mapping_s_domain():
    point = grazing_point(DEFAULT, 0.29)
    assert cells("end of the domain, delta/b")[0] == f"{largest_overshoot(point) / point.clearance:.4f}"


@pytest.mark.parametrize("omega", [0.29, 1.1])
@pytest.mark.parametrize("overshoot", [1e-4, 1e-6, 1e-8])
def test_errors_of_the_composed_map(omega, overshoot):
    point = grazing_point(DEFAULT, omega)
    error = compare_returns(point, beyond_stop(point, overshoot * point.clearance), 2).error
    assert cells(f"{omega}, {overshoot:.0e}") == [f"{error[1]:.4e}", f"{error[2]:.4e}"]


@pytest.mark.parametrize(("order", "near"), [(2, 0.2825), (3, 0.3037), (1, 0.3501)])
def test_thresholds_of_the_next_contact(order, near):
    point = min(codimension_two_points(DEFAULT, 0.25, 0.5, 4, 0), key=lambda p: (p.order != order, abs(p.omega - near)))
    distance, lost = 1e-9, 1.0 + DEFAULT.restitution
    sign, time = (-1.0) ** order, order * math.pi / point.omega
    (value,), (slope,), _, _ = evaluate(impulse_response(modal_model(DEFAULT)), [time])
    plain = math.sqrt(distance / 2.0) / (lost * point.omega)
    square = (1.0 - lost * sign * slope) ** 2
    omega = order * math.pi / (time + (0.5 * sign * plain * (1.0 + square) - value) / slope)
    without = square < 1.0
    predicted = next_contact(DEFAULT, [omega], distance, order).order[0] == order
    assert simulated_contact(DEFAULT, omega, distance, order)[0] == (order if predicted else 0)
    words = ["yes" if answer else "no" for answer in (without, predicted, predicted)]
    assert cells(f"{order}, {point.omega:.4f}") == [f"{square:.4f}", *words]


@functools.cache
def branch(label):
    return orbit_branch(DEFAULT, default_orbit(label), 1.3, 1.75)


@pytest.mark.parametrize(
    "label",
    [
        "1-2r-2l, NS",
        "1-2r-2l, GR",
        "1-3r-3l, SN",
        "1-3r-3l, SB",
        "3-4r-4l, SN",
        "3-4r-4l, GR",
        "5-8r-8l, GR, upper",
        "5-8r-8l, SN",
        "5-8r-8l, GR, lower",
    ],
)
def test_special_points_of_branches_of_any_impacts(label):
    motion, kind, *_ = label.split(", ")
    row = cells(label)
    points = [p for p in branch(motion).special_points if p.type == kind and p.impact is None]
    near = [p for p in points if f"{p.clearance:.12f}" == row[0]]
    assert len(near) == 1, points
    assert row[1] == ("yes" if near[0].admissible else "no")
    # the ends of the interval in which it is a motion are all there
    if kind == "GR":
        assert len([p for p in points if p.admissible]) == (2 if motion == "5-8r-8l" else 1)


def test_the_graze_at_which_a_branch_of_one_impact_begins():
    motions = one_impact_motions(DEFAULT, 0.27)
    assert motions.admissible_from[0].any
    (end,) = motions.phases_of_impacts.ends
    numbers = motions.orbits.gap(end), abs(motions.orbits.speed(end)), angle_of(motions, end)
    assert cells("one impact, graze of the steady motion") == [f"{number:.12f}" for number in numbers]


@pytest.mark.parametrize(("label", "kind"), [("SN", "SN"), ("GR, with the other stop", "GR")])
def test_special_points_of_a_branch_of_one_impact(label, kind):
    motions = one_impact_motions(DEFAULT, 0.27)
    orbit = special_motion(motions, kind)
    numbers = orbit.gap, orbit.speed, angle_of(motions, orbit.phase)
    assert cells(f"one impact, {label}") == [f"{number:.12f}" for number in numbers]


@pytest.mark.parametrize(("label", "kind"), [("SN", "SN"), ("GR, with the other stop", "GR")])
def test_curves_over_the_forces(label, kind):
    """At the frequency of the branch F is the clearance of the stops over that of the branch, and v is F times its."""
    stops, known = 2.0, special_motion(one_impact_motions(DEFAULT, 0.27), kind)
    pieces = window_curves(DEFAULT, (0.27, 0.271), (1.0, 1.2), 1, 2, VariedFactor("forcing", stops, stops))
    (curve,) = (piece for piece in pieces if (piece.type, piece.symmetric) == (kind, False))
    factor, speed = curve.value[0], curve.impact_velocity[0]
    assert cells(f"factor of the forces, {label}") == [f"{factor:.12f}", f"{speed:.12f}"]
    assert factor == pytest.approx(stops / known.gap, rel=1e-13)
    assert speed == pytest.approx(factor * known.speed, rel=1e-13)


@pytest.mark.parametrize("omega", [0.1, 0.27, 0.51])
def test_margins_of_the_stops(omega):
    """The page's formulas, with two harmonics and a bias."""
    parts = [force(k, np.array([a, 0.0, 0.0]), np.zeros(3)) for k, a in ((1, 1.0), (2, 0.7))]
    bias = np.array([0.1, 0.0, 0.0])
    system = replace(Oscillator.of_structure(DEFAULT.structure, DEFAULT.contact, parts, 0.8), bias=bias)
    place, motion = contact_equilibrium(system), steady_motion(system, np.array([omega]))
    right, left = (motion.toward(stop).amplitude[0] for stop in (1, -1))
    assert right != pytest.approx(left, rel=1e-4)
    forcing, factor = Axis("forcing", np.array([0.5, 2.0])), Axis("bias", np.array([-1.0, 3.0]))
    at = ParameterPoint.of(system, omega, 1.6)
    for margins, side, largest in zip(
        grazing_margins(Plane(system, at, forcing, factor)), (1, -1), (right, left), strict=True
    ):
        expected = [[1.6 - side * beta * place - f * largest for f in forcing.values] for beta in factor.values]
        np.testing.assert_allclose(margins, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("label", "system", "start", "stop", "bifurcation"),
    [
        ("unfolding, SN", DEFAULT, 0.2795, 0.283, "SN"),
        ("unfolding, PD", DEFAULT, 0.2795, 0.283, "PD"),
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
