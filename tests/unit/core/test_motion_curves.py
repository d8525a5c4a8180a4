"""The curves that are found from one motion in a window, against closed forms and the tangent flow."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.motion_curves import lies_on, motion_curves
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import explicit_sequences
from tests.oracles.closed_form import one_impact_branch
from tests.support.orbits import in_window, orbit_of, orbit_on, parent, special, tangent_flow
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused

WINDOW = ((0.265, 0.295), (1.5, 2.0))


@functools.cache
def orbit_of_stops(*stops):
    return in_window(DEFAULT, *WINDOW, 1, list(stops))


@functools.cache
def curves_of(*stops):
    return motion_curves(DEFAULT, orbit_of_stops(*stops), *WINDOW)


@pytest.mark.parametrize("stops", [(1, -1), pytest.param((1,), marks=pytest.mark.thorough)])
def test_the_curves_of_motions_with_one_impact_are_the_closed_form_s(stops):
    """Every one that passes through the window, each once, and no other."""
    symmetric = len(stops) == 2
    curves = curves_of(*stops)
    kinds = [(curve.type, curve.impact) for curve in curves]
    assert len(set(kinds)) == len(kinds)
    assert {kind for kind, _ in kinds} == ({"SB", "GR"} if symmetric else {"SN", "PD", "GR", "NS"})
    for curve in curves:
        if curve.type == "NS":  # the closed form has none
            assert_complex_pairs_on_the_circle(curve)
            continue
        assert curve.ends == ("range", "range")
        compared = 0
        for omega, clearance, speed in zip(curve.omega, curve.clearance, curve.velocities[:, 0], strict=True):
            if curve.impact == 0:
                assert clearance == pytest.approx(grazing_curve(DEFAULT, [omega]).clearance[0], rel=1e-11)
            elif speed > 1e-6:
                known = one_impact_branch(DEFAULT, float(omega), 1, symmetric)
                same = [p for p in known.special_points if p.type == curve.type and p.impact_velocity > 0.0]
                if same:
                    assert min(abs(p.clearance - clearance) for p in same) < 1e-9
                    compared += 1
        assert compared >= 5 or curve.impact == 0


def assert_complex_pairs_on_the_circle(curve):
    for omega, clearance, phases, speeds in zip(
        curve.omega[1:-1], curve.clearance[1:-1], curve.phases[1:-1], curve.velocities[1:-1], strict=True
    ):
        sequence = ImpactSequence.create(1, [1], phases, speeds)
        multipliers = periodic_orbit(DEFAULT, float(omega), float(clearance), sequence).multipliers
        turning = multipliers[np.abs(multipliers.imag) > 1e-6]
        assert np.min(np.abs(np.abs(turning) - 1.0)) < 1e-8


def test_a_motion_with_four_impacts_has_each_of_its_curves_once():
    start, curves = orbit_of_stops(1, 1, -1, -1), curves_of(1, 1, -1, -1)
    assert start.label == "1-2r-2l"
    assert {curve.type for curve in curves} == {"SN", "SB", "NS", "GR"}
    over_omega = orbit_branch(DEFAULT, start, *WINDOW[0], "omega", 0.05, 500)
    over_clearance = orbit_branch(DEFAULT, start, *WINDOW[1], "clearance", 0.05, 500)
    special_points = [*over_clearance.special_points, *over_omega.special_points]
    for number, curve in enumerate(curves):
        assert np.max(curve.residual) <= 1e-12
        points = [p for p in special_points if lies_on(p, curve)]
        assert points
        assert not any(lies_on(p, other) for p in points for other in curves[:number])
    # and every special point is on one of them, by its place in the plane too
    for point in (p for p in special_points if p.status == "converged"):
        near = [
            np.min(np.hypot(curve.omega - point.omega, curve.clearance - point.clearance))
            for curve in curves
            if lies_on(point, curve)
        ]
        assert len(near) == 1
        assert near[0] < 0.02  # points of a curve are as far apart
    (turning,) = [c for c in curves if c.type == "NS" and np.all(c.admissible)]
    run = tangent_flow(DEFAULT, orbit_on(DEFAULT, turning, len(turning.omega) // 2))
    assert abs(abs(run.multipliers[0]) - 1.0) < 1e-7


def test_a_doubled_motion_leads_to_the_curve_at_which_it_appears():
    """Its branch ends there, so the point is followed as one of the motion of half the period."""
    point = special(parent("PD"), "PD")
    (beyond,) = starts_beyond(DEFAULT, point)
    close = (point.omega - 2e-3, point.omega + 2e-3), (point.clearance - 5e-3, point.clearance + 5e-3)
    curves = motion_curves(DEFAULT, orbit_of(beyond), *close)
    (born,) = [c for c in curves if c.type == "PD" and c.period == 1]
    assert born.residual.max() <= 1e-14
    for omega, clearance in zip(born.omega, born.clearance, strict=True):
        known = one_impact_branch(DEFAULT, float(omega))
        places = [p.clearance for p in known.special_points if p.type == "PD"]
        assert places == [pytest.approx(clearance, rel=1e-10)]


def test_a_motion_that_does_not_exist_in_a_window_is_not_found():
    assert in_window(DEFAULT, (0.27, 0.28), (2.2, 2.3), 1, [1]) is None
    place = in_window(DEFAULT, (0.27, 0.27), (1.85, 1.85), 1, [1])
    assert (place.omega, place.clearance, place.label) == (0.27, 1.85, "1-1r-(-1)l")


def test_windows_that_do_not_contain_the_orbit_are_refused():
    orbit = orbit_of_stops(1)
    for name, window in (("omega", ((0.3, 0.4), WINDOW[1])), ("clearance", (WINDOW[0], (0.1, 0.2)))):
        with refused(name):
            motion_curves(DEFAULT, orbit, *window)
    with pytest.raises(ParameterError, match="converged"):
        motion_curves(DEFAULT, dataclasses.replace(orbit, converged=False), *WINDOW)


@functools.cache
def nearly_symmetric(offset):
    """The default oscillator with its equilibrium moved toward the right stop."""
    push = np.array([offset, 0.0, 0.0]) / np.linalg.inv(DEFAULT.stiffness_matrix)[0, 0]
    return dataclasses.replace(DEFAULT, bias=push)


@pytest.mark.thorough
def test_the_pitchfork_that_unfolds_is_found_on_both_sides():
    """From an orbit of either branch: of that which goes on, and of that which turns at a saddle-node.

    Beyond the saddle-node curve there are two orbits more, by the search that is explicit in the lag of the impacts.
    """
    oscillator, window = nearly_symmetric(1e-3), ((0.268, 0.272), (1.78, 1.9))
    stops = np.array([1, -1])
    orbits = [
        periodic_orbit(oscillator, 0.27, 1.835, sequence)
        for sequence in explicit_sequences(oscillator, 0.27, 1.835, 1, stops)
    ]
    assert len(orbits) == 3
    kinds = []
    for orbit in orbits:
        assert orbit.admissible
        curves = motion_curves(oscillator, orbit, *window)
        assert not [curve for curve in curves if curve.type == "SB"]
        kinds.append(sorted(curve.type for curve in curves))
        (fold,) = [curve for curve in curves if curve.type == "SN" and np.all(curve.admissible)]
        for place in (0, len(fold.omega) // 2, -1):
            assert np.min(np.abs(fold.multipliers[place] - 1.0)) < 1e-5
            number = [
                len(explicit_sequences(oscillator, fold.horizontal[place], at, 1, stops))
                for at in fold.vertical[place] * np.array([0.995, 1.005])
            ]
            assert number == [1, 3]
    assert kinds[0] == kinds[1] == kinds[2]


def test_other_branches_are_looked_for_between_unlike_stops_only(monkeypatch):
    monkeypatch.setattr("grazemap_core.continuation.motion_curves.mirrored", lambda _: pytest.fail("looked for"))
    motion_curves(DEFAULT, orbit_of_stops(1, -1), *WINDOW, max_points=2)
    with pytest.raises(pytest.fail.Exception):
        motion_curves(nearly_symmetric(1e-3), orbit_of_unlike(), *WINDOW, max_points=2)


def orbit_of_unlike():
    return in_window(nearly_symmetric(1e-3), *WINDOW, 1, [1, -1])


@pytest.mark.thorough
def test_motions_of_several_impacts_between_unlike_stops_have_curves_over_one_clearance():
    """A motion that trajectories settle to; the orbits of its curves are special by their multipliers."""
    window = (0.265, 0.28), (1.45, 1.8)
    orbit = in_window(DEFAULT, *window, 1, [1, 1, -1, -1], "clearance_right", 1.61)
    assert orbit is not None
    assert orbit.clearance[1] == 1.61
    curves = motion_curves(DEFAULT, orbit, *window, plane=("omega", "clearance_right"), max_points=40)
    assert curves
    for curve in curves:
        assert curve.plane == ("omega", "clearance_right")
        assert not curve.symmetric
        assert np.all(curve.values_of("clearance_left") == 1.61)
        assert np.max(curve.residual) < 1e-11
        target = {"SN": 1.0, "PD": -1.0}.get(curve.type)
        if target is not None:
            assert np.max(np.min(np.abs(curve.multipliers - target), axis=1)) < 1e-5
