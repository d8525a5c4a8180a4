"""The numbers on the theory page are the computed ones, to the last printed digit."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.discontinuity_mapping import beyond_stop, largest_overshoot, mapping_error
from grazemap_core.grazing.one_stop import VariedStop, grazing_curve
from grazemap_core.grazing.poincare_map import compare_returns
from grazemap_core.grazing.point import grazing_point
from grazemap_core.grazing.recurrence import next_contact
from grazemap_core.model.drive import force
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.monodromy import monodromy
from tests.oracles.next_contacts import simulated_contact

PAGE = Path(__file__).parents[3] / "docs" / "theory.md"
PAPER_OMEGA = 0.28109


def oscillator(damping):
    return Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], 0.8)


PROPORTIONAL, PER_LINK = oscillator(0.05), oscillator([0.05, 0.05, 0.05])


def cells(label, occurrence=0):
    """Return the cells after the first one of the table row that starts with this label."""
    rows = re.findall(rf"^\| {re.escape(label)} \|(.*)\|$", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    return [cell.strip() for cell in rows[occurrence].split("|")]


@pytest.mark.parametrize(
    ("label", "occurrence", "system", "omega"),
    [
        ("A(0.1)", 0, PROPORTIONAL, 0.1),
        ("A(0.28109)", 0, PROPORTIONAL, 0.28109),
        ("A(0.28109)", 1, PER_LINK, 0.28109),
    ],
)
def test_amplitudes(label, occurrence, system, omega):
    assert cells(label, occurrence)[0] == f"{grazing_curve(system, [omega]).clearance[0]:.13f}"


@pytest.mark.parametrize(
    ("label", "system", "which"),
    [
        ("gamma = 0.05, recurrence m = 2", PROPORTIONAL, {"order": 2}),
        ("gamma = 0.05, resonant n = 1, SN", PROPORTIONAL, {"bifurcation": "SN", "symmetric": False}),
        ("gamma = 0.05, resonant n = 1, PD", PROPORTIONAL, {"bifurcation": "PD", "symmetric": False}),
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
    system = Oscillator.of_structure(PROPORTIONAL.structure, PROPORTIONAL.contact, parts, 0.8)
    points = codimension_two_points(system, near - 0.01, near + 0.01, 1, 0, VariedStop(1, together=True))
    (point,) = (point for point in points if point.kind == kind)
    assert cells(f"two harmonics, {label}") == [f"{point.omega:.12f}", f"{point.clearance:.12f}"]


def test_multiplier_and_exponent():
    point = monodromy(PROPORTIONAL, 0.29, 1.6)
    assert cells("abs(mu_1)")[0] == f"{abs(point.multipliers[0]):.10f}"
    assert cells("largest exponent")[0] == f"{point.exponent:.10f}"


@pytest.mark.parametrize("overshoot", [1e-2, 1e-4, 1e-6, 1e-8])
def test_errors_of_the_discontinuity_mapping(overshoot):
    point = grazing_point(PROPORTIONAL, 0.29)
    error = mapping_error(point, [overshoot * point.clearance])
    expected = [f"{x[0]:.4e}" for x in (error.displacement, error.leading, error.second)]
    assert cells(f"{overshoot:.0e}") == expected


def test_the_end_of_the_mapping_s_domain():
    point = grazing_point(PROPORTIONAL, 0.29)
    assert cells("end of the domain, delta/b")[0] == f"{largest_overshoot(point) / point.clearance:.4f}"


@pytest.mark.parametrize("omega", [0.29, 1.1])
@pytest.mark.parametrize("overshoot", [1e-4, 1e-6, 1e-8])
def test_errors_of_the_composed_map(omega, overshoot):
    point = grazing_point(PROPORTIONAL, omega)
    error = compare_returns(point, beyond_stop(point, overshoot * point.clearance), 2).error
    assert cells(f"{omega}, {overshoot:.0e}") == [f"{error[1]:.4e}", f"{error[2]:.4e}"]


@pytest.mark.parametrize(("order", "near"), [(2, 0.2825), (3, 0.3037), (1, 0.3501)])
def test_thresholds_of_the_next_contact(order, near):
    point = min(
        codimension_two_points(PROPORTIONAL, 0.25, 0.5, 4, 0), key=lambda p: (p.order != order, abs(p.omega - near))
    )
    distance, lost = 1e-9, 1.0 + PROPORTIONAL.restitution
    sign, time = (-1.0) ** order, order * math.pi / point.omega
    (value,), (slope,), _, _ = evaluate(impulse_response(modal_model(PROPORTIONAL)), [time])
    plain = math.sqrt(distance / 2.0) / (lost * point.omega)
    square = (1.0 - lost * sign * slope) ** 2
    omega = order * math.pi / (time + (0.5 * sign * plain * (1.0 + square) - value) / slope)
    without = square < 1.0
    predicted = next_contact(PROPORTIONAL, [omega], distance, order).order[0] == order
    assert simulated_contact(PROPORTIONAL, omega, distance, order)[0] == (order if predicted else 0)
    said = ["yes" if answer else "no" for answer in (without, predicted, predicted)]
    assert cells(f"{order}, {point.omega:.4f}") == [f"{square:.4f}", *said]
