"""Orbits beyond special points, against 50-digit shooting, the tangent flow and the event-exact simulation."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from grazemap_core.continuation.branch_switching import merged, starts_beyond
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.tolerances import SWITCH_STEPS
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import differences, solved
from tests.support.orbits import from_impact, mismatch, orbit_of, parent, special, tangent_flow, two_impacts
from tests.support.oscillators import DEFAULT


def against_digits(orbit):
    """The largest difference from 50-digit shooting, phases and speeds, and that of the multipliers."""
    exact = solved(DEFAULT, orbit.omega, orbit.clearance, orbit.impacts)
    with digits():
        theirs = exact.multipliers()
    ours = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
    return max(differences(exact, orbit.impacts)), mismatch(ours, theirs)


@pytest.mark.parametrize(("kind", "label"), [("PD", "2-2r-(-1)l"), ("SB", "1-1r-1l")])
def test_the_orbit_on_the_new_branch_differs_from_its_parent(kind, label):
    point = special(parent(kind), kind)
    (beyond,) = starts_beyond(DEFAULT, point)
    orbit = orbit_of(beyond)
    assert (orbit.converged, orbit.isolated, orbit.admissible, orbit.stable) == (True,) * 4
    assert (orbit.label, orbit.symmetric, orbit.least_period) == (label, False, 2 if kind == "PD" else 1)
    assert orbit.residual <= 1e-15
    error, apart = against_digits(orbit)
    assert error <= orbit.radius
    assert apart < 1e-9
    tangent = tangent_flow(DEFAULT, orbit)
    assert tangent.closing < 1e-12
    assert mismatch(orbit.multipliers, tangent.multipliers) < 1e-9


@pytest.mark.parametrize("kind", ["PD", "SB"])
def test_the_simulation_settles_to_the_orbit_on_the_new_branch(kind):
    point = special(parent(kind), kind)
    (beyond,) = starts_beyond(DEFAULT, point)
    clearance = point.clearance + math.copysign(3e-4, beyond.clearance - point.clearance)
    orbit = periodic_orbit(DEFAULT, point.omega, clearance, beyond.impacts)
    assert orbit.stable
    beside = orbit.start.displacement * (1.0 - 1e-4), orbit.start.velocity
    run = trajectory(DEFAULT, point.omega, clearance, *beside, periods=64, transient_periods=1500)
    assert (run.motion.kind, run.motion.period, run.motion.symmetric) == ("periodic", 2 if kind == "PD" else 1, False)
    speeds = np.sort(np.abs(run.impacts.velocity))
    halves = len(speeds) // 2
    slow, fast = np.sort(np.abs(orbit.impacts.velocities))
    np.testing.assert_allclose(speeds[:halves], slow, rtol=1e-7)
    np.testing.assert_allclose(speeds[halves:], fast, rtol=1e-7)


@pytest.mark.parametrize("kind", ["PD", "SB"])
def test_amplitudes_grow_as_the_root_of_the_distance(kind):
    point = special(parent(kind), kind)
    (beyond,) = starts_beyond(DEFAULT, point)
    side = 1.0 if beyond.clearance > point.clearance else -1.0
    distances = np.array([1e-5, 4e-5])
    amplitudes = []
    for distance in distances:
        orbit = periodic_orbit(DEFAULT, point.omega, point.clearance + side * distance, beyond.impacts)
        assert (orbit.symmetric, orbit.least_period) == (False, beyond.impacts.period)
        amplitudes.append(abs(abs(orbit.impacts.velocities[0]) - abs(orbit.impacts.velocities[1])))
    exponent = np.diff(np.log(amplitudes)) / np.diff(np.log(distances))
    assert exponent == pytest.approx(0.5, abs=0.01)
    # on the other side there is none of them
    other = periodic_orbit(DEFAULT, point.omega, point.clearance - side * 1e-4, beyond.impacts)
    assert not other.converged or other.symmetric or other.least_period < other.impacts.period


@pytest.mark.parametrize("kind", ["PD", "SB"])
def test_a_new_branch_leads_back_to_its_parent(kind):
    point = special(parent(kind), kind)
    low, high = 0.995 * point.clearance, 1.005 * point.clearance
    (beyond,) = starts_beyond(DEFAULT, point)
    branch = orbit_branch(DEFAULT, orbit_of(beyond), low, high)
    (end,) = [p for p in branch.special_points if p.type == kind and abs(p.clearance - point.clearance) < 1e-6]
    assert end.status == "converged"
    assert end.clearance == pytest.approx(point.clearance, rel=1e-13)
    assert merged(end.impacts) is not None
    (back,) = starts_beyond(DEFAULT, end)
    np.testing.assert_allclose(back.impacts.velocities, point.impacts.velocities, rtol=1e-8)
    assert (back.impacts.period, back.impacts.symmetric) == (point.impacts.period, point.impacts.symmetric)
    if kind == "SB":  # through the point to the mirror image of the first half
        here = branch.velocities[:, 0] + branch.velocities[:, 1]
        assert np.min(here) < -1e-3 < 1e-3 < np.max(here)
        # an impact of the asymmetric motion vanishes where the one-impact motion meets the other stop
        other = one_impact_branch(DEFAULT, point.omega).special_points[-1]
        assert (other.type, other.stop) == ("GR", -1)
        wide = orbit_branch(DEFAULT, orbit_of(beyond), low, 1.02 * point.clearance)
        grazes = [p.clearance for p in wide.special_points if p.impact is not None]
        assert grazes == pytest.approx([other.clearance] * 2, abs=1e-10)  # one for either of the pair


def followed(point, beyond):
    """Whether the simulation from a proposed orbit has its impacts, and no others, over three periods."""
    orbit = orbit_of(beyond)
    run = from_impact(DEFAULT, orbit, periods=orbit.least_period)
    whole = orbit.impacts.whole
    turn = 2.0 * math.pi * orbit.least_period
    times = run.impacts.time * orbit.omega
    inside = times < turn * (1.0 - 1e-9)  # the first impact is at the end of the record again
    np.testing.assert_array_equal(run.impacts.stop[inside], whole.stops)
    np.testing.assert_allclose(times[inside], whole.phases - whole.phases[0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.impacts.velocity[inside], whole.velocities, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("branch", "where", "labels"),
    [
        (lambda: parent("PD"), 1.88117, ["1-1r-1l"]),  # the other stop is touched
        (lambda: parent("SB"), 1.62527, ["1-2r-2l", "1-2r-1l"]),  # both are
        (two_impacts, 1.62527, ["1-1r-1l", "1-1r-2l"]),
        (lambda: parent("SB"), 1.85499, ["1-(-1)r-1l"]),  # both impacts vanish
        (lambda: parent("one-sided"), 1.85499, ["1-1r-1l"]),
        (lambda: parent("one-sided"), 1.84424, ["1-1r-1l"]),
    ],
)
def test_beyond_a_graze_lies_the_orbit_with_an_impact_more_or_less(branch, where, labels):
    (point,) = [p for p in branch().special_points if p.type == "GR" and abs(p.clearance - where) < 1e-5]
    starts = starts_beyond(DEFAULT, point)
    assert [orbit_of(beyond).label for beyond in starts] == labels
    for beyond in starts:
        orbit = orbit_of(beyond)
        assert orbit.residual <= 1e-14
        assert beyond.admissible
        assert orbit.admissible
        assert abs(beyond.clearance - point.clearance) < SWITCH_STEPS[0]
        followed(point, beyond)
        error, _ = against_digits(orbit)
        assert error <= orbit.radius
        # its branch passes through the graze, and is no motion on the other side
        chosen = [
            b
            for b in (orbit_branch(DEFAULT, orbit_of(start), 0.99 * where, 1.01 * where) for start in starts)
            if len(b.stops) == len(beyond.impacts.stops) and b.symmetric == beyond.impacts.symmetric
        ]
        assert len(chosen) == 1
        grazes = [p for p in chosen[0].special_points if p.type == "GR" and abs(p.clearance - point.clearance) < 1e-10]
        assert grazes
        near = np.argsort(np.abs(chosen[0].clearance - point.clearance))
        assert not np.all(chosen[0].admissible[near[:4]])


def test_a_graze_solves_the_equations_of_the_orbit_beyond_it():
    """At the graze itself, the further impact's velocity being 0."""
    point = special(parent("PD"), "GR")
    (beyond,) = starts_beyond(DEFAULT, point)
    place = int(np.flatnonzero(np.abs(beyond.impacts.velocities) < 1e-2)[0])
    guess = dataclasses.replace(beyond.impacts, velocities=beyond.impacts.velocities.copy())
    guess.velocities[place] = 0.0
    orbit = periodic_orbit(DEFAULT, point.omega, point.clearance, guess)
    assert orbit.converged
    assert abs(orbit.impacts.velocities[place]) < 1e-12
    np.testing.assert_allclose(np.delete(orbit.impacts.velocities, place), point.impacts.velocities, rtol=1e-11)


def test_no_orbits_are_proposed_where_no_other_branch_passes():
    branch = two_impacts()
    for kind in ("SN", "NS"):
        assert starts_beyond(DEFAULT, next(p for p in branch.special_points if p.type == kind)) == ()
    doubled = orbit_branch(DEFAULT, orbit_of(starts_beyond(DEFAULT, special(parent("PD"), "PD"))[0]), 1.9, 1.95)
    for point in doubled.special_points:
        if point.type == "GR":  # twice as many phases at which it may graze, all of them followed by what there is
            assert all(beyond.impacts.period == 2 for beyond in starts_beyond(DEFAULT, point))
