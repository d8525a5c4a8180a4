"""The numbers on the theory page are the computed ones, to the last printed digit."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from grazemap_core.codim2 import codimension_two_points
from grazemap_core.grazing import grazing_curve
from grazemap_core.monodromy import monodromy
from grazemap_core.oscillator import Oscillator

PAGE = Path(__file__).parents[2] / "docs" / "theory.md"
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


def test_multiplier_and_exponent():
    point = monodromy(PROPORTIONAL, 0.29, 1.6)
    assert cells("abs(mu_1)")[0] == f"{abs(point.multipliers[0]):.10f}"
    assert cells("largest exponent")[0] == f"{point.exponent:.10f}"
