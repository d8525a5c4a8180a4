"""Curves inside a window: pieces of the closed forms, and their ends."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.contact.stops import stops_between
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.single_impact.orbits import one_impact_sequences
from grazemap_core.orbits.single_impact.window_curves import window_curves
from tests.oracles.closed_form import one_impact_branch
from tests.support.orbits import random_chain
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused

WINDOW = ((0.26, 0.30), (1.3, 2.05))


@pytest.fixture(scope="module")
def pieces():
    return window_curves(DEFAULT, *WINDOW)


def test_pieces_lie_inside_the_window_and_on_the_closed_forms(pieces):
    assert {piece.type for piece in pieces} >= {"SN", "PD", "SB", "GR"}
    for piece in pieces:
        assert piece.omega.size == piece.value.size == piece.impact_velocity.size >= 2
        assert np.all((piece.value >= 1.3) & (piece.value <= 2.05))
        assert np.all(np.diff(piece.omega) > 0.0)
        middle = len(piece.omega) // 2
        branch = one_impact_branch(DEFAULT, float(piece.omega[middle]), piece.period, piece.symmetric)
        (point,) = [point for point in branch.special_points[1:] if point.type == piece.type]
        assert piece.value[middle] == pytest.approx(point.clearance, rel=1e-12)
        assert piece.impact_velocity[middle] == pytest.approx(point.impact_velocity, abs=1e-12)
        assert piece.admissible is point.admissible
        assert piece.stop == (point.stop or 0)


def test_pieces_say_where_a_motion_beside_them_is_stable():
    verdicts = set()
    for oscillator in (DEFAULT, random_chain(np.random.default_rng(2), 2, True, 0.7)):
        steady = grazing_curve(oscillator, [0.28]).clearance[0]
        for piece in window_curves(oscillator, (0.26, 0.30), (0.5 * steady, 1.5 * steady), 3, 40):
            if piece.type == "GR":
                continue
            for index in np.flatnonzero(piece.impact_velocity > 0.1 * piece.impact_velocity.max())[::5].tolist():
                omega, gap = float(piece.omega[index]), float(piece.value[index])
                sides = [orbits_near(oscillator, omega, gap * (1.0 + side), piece, index) for side in (1e-8, -1e-8)]
                assert sorted(map(len, sides)) == ([0, 2] if piece.type == "SN" else [1, 1])
                stable = [orbit.stable for orbits in sides for orbit in orbits]
                assert stable.count(True) == int(piece.stable_beside[index])
                verdicts.add(bool(piece.stable_beside[index]))
    assert verdicts == {True, False}


def orbits_near(oscillator, omega, gap, piece, index):
    """The orbits of the motion of a piece whose impacts have nearly the speed at one of its points."""
    forced = OrbitFamily.of(oscillator, piece.period, piece.symmetric).at(omega)
    stops = stops_between(oscillator, gap, forced.steady_size)
    near = [
        sequence
        for sequence in one_impact_sequences(forced, stops, 1)
        if abs(sequence.velocities[0] / piece.impact_velocity[index] - 1.0) < 0.05
    ]
    return [periodic_orbit(oscillator, omega, gap, sequence) for sequence in near]


def test_a_piece_reaches_the_edge_of_the_window_or_the_next_piece():
    """However few frequencies sample a steep curve."""
    ends = set()
    for oscillator in (DEFAULT, random_chain(np.random.default_rng(2), 2, True, 0.7)):
        steady = grazing_curve(oscillator, [0.28]).clearance[0]
        edges = 0.5 * steady, 1.5 * steady
        pieces = window_curves(oscillator, (0.26, 0.30), edges, 3, 12)
        for piece in pieces:
            for place, end in zip((0, -1), piece.ends, strict=True):
                omega, value = piece.omega[place], piece.value[place]
                ends.add(end)
                if end == "window":
                    assert omega in (0.26, 0.30) or min(abs(value / edge - 1.0) for edge in edges) < 1e-7
                elif end == "admissible":
                    assert any(
                        other.omega[-1 - place] == pytest.approx(omega, rel=1e-9)
                        and other.value[-1 - place] == pytest.approx(value, rel=1e-9)
                        for other in pieces
                        if other.type == piece.type and other.ends[-1 - place] == "admissible"
                    )
    assert ends >= {"window", "admissible", "grazing"}


def test_a_coarse_sample_has_the_ends_of_a_fine_sample():
    coarse, fine = (window_curves(DEFAULT, *WINDOW, 2, points) for points in (50, 600))
    for piece, finer in zip(coarse, fine, strict=True):
        assert (piece.type, piece.period, piece.ends) == (finer.type, finer.period, finer.ends)
        for place in (0, -1):
            assert piece.omega[place] == pytest.approx(finer.omega[place], rel=1e-7)
            assert piece.value[place] == pytest.approx(finer.value[place], rel=1e-7)


def test_curves_leave_the_grazing_curve_at_its_resonant_points(pieces):
    points = codimension_two_points(DEFAULT, 0.26, 0.30, max_multiple=2)
    leaving = [
        (piece, piece.omega[place])
        for piece in pieces
        for place, end in zip((0, -1), piece.ends, strict=True)
        if end == "grazing" and piece.type != "GR"  # that of a GR is no resonant point
    ]
    assert len(leaving) >= 4
    for piece, omega in leaving:
        assert any(
            point.kind == "resonant"
            and point.bifurcation == piece.type
            and (point.multiple, point.symmetric) == (piece.period, piece.symmetric)
            and abs(point.omega - omega) <= 1e-9 * omega
            for point in points
        ), (piece.type, omega)
    # and at every one of them whose curve begins inside the window
    inside = [point for point in points if point.unfolding is not None and 0.2605 < point.omega < 0.2995]
    for point in inside:
        if not point.unfolding.velocity_slope > 0.0 or point.clearance > 2.04:
            continue
        assert any(
            piece.type == point.bifurcation and abs(piece_omega - point.omega) <= 1e-9 for piece, piece_omega in leaving
        ), point


def test_an_empty_window_has_no_curves():
    assert window_curves(DEFAULT, (0.26, 0.30), (50.0, 60.0)) == []


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (((0.3, 0.26), (1.3, 2.0)), "omega"),
        (((0.26, 0.3), (0.0, 2.0)), "clearance"),
        (((0.26, 0.3), (1.3, np.inf)), "clearance"),
        (((0.26, 0.3), (1.3, 2.0), 0), "max_multiple"),
        (((0.26, 0.3), (1.3, 2.0), 1, 1), "points"),
    ],
)
def test_an_invalid_window_is_refused(arguments, name):
    with refused(name):
        window_curves(DEFAULT, *arguments)
