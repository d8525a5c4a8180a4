"""Branches of periodic motions by continuation, against closed forms, the event-exact simulation and 50 digits."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.continuation.special_points import ORBITS_NOT_SOLVED, BranchSegment
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import solved
from tests.oracles.one_impact_orbits import orbit_at
from tests.support.orbits import (
    default_orbit,
    guess_of,
    mismatch,
    random_families,
    sixteen_impacts,
    start,
    tangent_flow,
    two_impacts,
)
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused


def point_of(branch, kind, clearance):
    """The special point of this type that is nearest to a clearance."""
    points = [point for point in branch.special_points if point.type == kind]
    assert points, (kind, branch.special_points)
    return min(points, key=lambda point: abs(point.clearance - clearance))


@pytest.mark.thorough
def test_branches_of_orbits_with_one_impact_have_the_closed_form_s_special_points():
    compared = {"SN": 0, "PD": 0, "SB": 0, "GR": 0}
    worst = dict.fromkeys(compared, 0.0)
    for oscillator, branch, _ in itertools.islice(random_families(41), 40):
        begin = max(branch.lowest, -1.0) + 0.3
        if oscillator.restitution == 0.0 or begin > 1.3:
            continue  # without a rebound a graze of the impact itself is a contact of another kind
        orbit = start(branch, max(begin, 0.8))
        low, high = 0.05 * branch.amplitude, 1.3 * max(orbit.clearance, branch.amplitude)
        followed = orbit_branch(oscillator, orbit, low, high)
        assert set(followed.ends) <= {"range", "closed"}, followed.ends
        assert np.max(followed.residual) <= 1e-13
        speeds = followed.velocities[:, 0]
        radius = np.hypot(
            followed.clearance + branch.position_coefficient * speeds, branch.velocity_coefficient * speeds
        )
        np.testing.assert_allclose(radius, branch.amplitude, rtol=1e-12)
        for known in branch.special_points:
            if not low * 1.01 < known.clearance < high * 0.99:
                continue
            same = [p for p in followed.special_points if p.type == known.type]
            near = [p for p in same if abs(p.clearance / known.clearance - 1.0) < 1e-6]
            near = [p for p in near if abs(p.impacts.velocities[0] - known.impact_velocity) < 1e-5]
            assert len(near) == 1, (known, followed.special_points)
            (point,) = near
            assert point.status == "converged"
            compared[known.type] += 1
            worst[known.type] = max(worst[known.type], abs(point.clearance / known.clearance - 1.0))
            assert point.admissible == known.admissible
            if known.type == "GR":
                assert point.stop == known.stop
                assert (point.impact is None) == (known.impact_velocity > 0.0)
            elif known.type == "SN":
                assert np.min(np.abs(point.multipliers - 1.0)) < 1e-6
            else:
                assert np.min(np.abs(point.multipliers + 1.0)) < 1e-8
    assert min(compared.values()) >= 4, compared
    assert max(worst.values()) < 1e-10, worst


def beside(branch, point, shift):
    """``prod v_i det(I -+ M)`` (SN: the former) in 50 digits, of the orbit at a clearance beside a special point."""
    clearance, guess = point.clearance * (1.0 + shift), point.impacts
    if point.type == "SN":  # along the branch, which is a parabola there
        index = point.segment
        share = math.sqrt((clearance - point.clearance) / (branch.clearance[index] - point.clearance))
        phases = guess.phases + share * (branch.phases[index] - guess.phases)
        velocities = guess.velocities + share * (branch.velocities[index] - guess.velocities)
        guess = dataclasses.replace(guess, phases=phases, velocities=velocities)
    near = periodic_orbit(DEFAULT, 0.27, clearance, guess)
    assert near.converged
    exact = solved(DEFAULT, 0.27, clearance, near.impacts)
    with digits():
        return clearance, float(exact.test_function(1 if point.type == "SN" else -1))


def test_a_branch_to_its_first_special_points_is_the_beginning_of_the_whole_one():
    orbit = default_orbit("5-8r-8l")
    whole, first = sixteen_impacts(), orbit_branch(DEFAULT, orbit, 1.5, 1.75, to_special=True)
    assert 0 < len(first.values) < len(whole.values)
    assert set(first.ends) == {"special"}
    known, clearances = ([point.clearance for point in branch.special_points] for branch in (whole, first))
    place = known.index(clearances[0])
    assert clearances == known[place : place + len(clearances)]
    assert {point.segment for point in first.special_points} == {0, len(first.values) - 2}


def test_test_functions_too_small_to_be_multiplied_are_compared_correctly():
    """The determinant over a hundred impacts may be 1e-200."""
    piece = object.__new__(BranchSegment)
    piece.end, piece.at = 1.0, float  # type: ignore[assignment,method-assign]
    assert piece.zero(lambda s: 1e-200 * (1.0 + s), 0.0, 1.0) is None
    assert piece.zero(lambda s: 1e-200 * (s - 0.25), 0.0, 1.0) == pytest.approx(0.25)


def test_a_special_point_between_orbits_that_are_not_solved_for_says_so(monkeypatch):
    branch = orbit_branch(DEFAULT, default_orbit("1-2r-2l"), 1.3, 1.7)
    place = next(point.segment for point in branch.special_points if point.type == "GR")
    pattern = Pattern(branch.period, branch.symmetric)
    path = ContinuationProblem(DEFAULT, pattern, branch.stops, ("clearance",), branch.points[0])
    numbers = zip(branch.phases[place : place + 2], branch.velocities[place : place + 2], strict=True)
    impacts = [ImpactSequence(branch.period, branch.stops, *each, branch.symmetric) for each in numbers]
    first, second = (
        path.evaluate(path.unknowns(each, values)) for each, values in zip(impacts, branch.points[place:], strict=False)
    )
    along = path.tangent(first.unknowns, second.unknowns - first.unknowns)
    points = BranchSegment(path, first, second, along).special_points(turns=False)
    assert [(point.status, point.reason) for point in points] == [("converged", "")] * len(points) != []
    monkeypatch.setattr(path, "correct", lambda *_: None)
    points = BranchSegment(path, first, second, along).special_points(turns=False)
    assert [(point.status, point.reason) for point in points] == [("guess", ORBITS_NOT_SOLVED)] * len(points) != []


def test_special_points_are_zeros_of_the_test_functions_in_50_digits():
    seen = set()
    branches = (sixteen_impacts(), *(orbit_branch(DEFAULT, default_orbit(k), 1.3, 1.7) for k in ("1-2r-2l", "3-4r-4l")))
    for branch in branches:
        for point in branch.special_points:
            if point.type not in ("SN", "SB"):
                continue
            if point.type == "SB":
                # the function itself passes through zero with the clearance
                (first, at_first), (second, at_second) = beside(branch, point, -1e-7), beside(branch, point, 1e-7)
                assert at_first * at_second < 0.0
            else:
                # its square does, on the side on which there are orbits
                index = point.segment
                side = math.copysign(1e-8, branch.clearance[index] - point.clearance)
                (first, at_first), (second, at_second) = beside(branch, point, side), beside(branch, point, 2.0 * side)
                at_first, at_second = at_first**2, at_second**2
            zero = (first * at_second - second * at_first) / (at_second - at_first)
            assert abs(zero - point.clearance) < 1e-10
            seen.add((point.type, len(branch.stops)))
    assert {kind for kind, _ in seen} == {"SN", "SB"}
    assert ("SN", 8) in seen


def test_an_orbit_of_sixteen_impacts_is_followed_to_where_it_ends_on_either_side():
    branch = sixteen_impacts()
    assert branch.ends == ("range", "range")
    assert np.max(branch.residual) <= 1e-12
    ends = [p for p in branch.special_points if p.type == "GR" and p.admissible and p.impact is None]
    assert len(ends) == 2
    low, high = sorted(ends, key=lambda p: p.clearance)
    assert np.all(np.diff([low.clearance, 1.626, high.clearance]) > 0.0)
    for point in (low, high):
        assert point.status == "converged"
        outward = 1.0 if point is high else -1.0
        for side, impacts in ((-outward, 16), (outward, 18)):
            # the simulation, from the orbit beside it: outside two touches more, one for either half of the period
            orbit = periodic_orbit(DEFAULT, 0.27, point.clearance + side * 1e-9, point.impacts)
            assert orbit.converged
            assert orbit.admissible == (impacts == 16)
            state = orbit.start
            run = trajectory(DEFAULT, 0.27, orbit.clearance, state.displacement, state.velocity, 0.0, periods=5)
            if impacts == 16:
                assert len(run.impacts.time) == 16
            else:
                assert len(run.impacts.time) > 16
    inside = np.flatnonzero(branch.admissible)
    assert len(inside) >= 3
    assert np.all(np.diff(inside) == 1)
    for index in inside[[0, len(inside) // 2, -1]]:
        impacts = type(low.impacts)(5, branch.stops, branch.phases[index], branch.velocities[index], True)
        run = tangent_flow(DEFAULT, periodic_orbit(DEFAULT, 0.27, float(branch.clearance[index]), impacts))
        assert mismatch(branch.multipliers[index], run.multipliers) < 1e-9


def test_a_neimark_sacker_point_is_where_the_tangent_flow_has_a_pair_on_the_unit_circle():
    branch = two_impacts()
    (point,) = [p for p in branch.special_points if p.type == "NS" and p.admissible]
    assert point.status == "converged"
    run = tangent_flow(DEFAULT, periodic_orbit(DEFAULT, 0.27, point.clearance, point.impacts))
    assert abs(abs(run.multipliers[0]) - 1.0) < 1e-10
    assert abs(run.multipliers[0].imag) > 0.1
    here = point.segment
    assert branch.stable[here] != branch.stable[here + 1]


def resonances():
    """Resonant points of the default system, ten one-sided and ten symmetric."""
    points = codimension_two_points(DEFAULT, 0.2, 1.2, max_order=1, max_multiple=3)
    resonant = [p for p in points if p.kind == "resonant"]
    chosen = [[p for p in resonant if p.symmetric == symmetric][:10] for symmetric in (False, True)]
    return chosen[0] + chosen[1]


def test_branches_pass_through_grazing_and_by_resonant_points():
    """In clearance at the resonant frequency, as near as it is a number, and in frequency at the resonant clearance."""
    points = resonances()
    assert len(points) == 20
    worst = 0.0
    for point in points:
        branch = one_impact_branch(DEFAULT, point.omega, point.multiple, point.symmetric)
        assert abs(branch.amplitude - point.clearance) < 1e-10
        orbit = start(branch, 1.5)
        scale = branch.amplitude
        followed = orbit_branch(DEFAULT, orbit, 0.9 * scale, 1.1 * scale)
        assert followed.ends == ("range", "range")
        speeds = followed.velocities[:, 0]
        assert np.min(speeds) < 0.0 < np.max(speeds)
        grazes = [p for p in followed.special_points if p.impact is not None]
        assert len(grazes) == 1
        worst = max(worst, abs(grazes[0].clearance - point.clearance))
        radius = np.hypot(
            followed.clearance + branch.position_coefficient * speeds, branch.velocity_coefficient * speeds
        )
        np.testing.assert_allclose(radius, scale, rtol=1e-12)
    assert worst < 1e-10


def test_branches_over_frequency_are_the_closed_form_s_too():
    turned = 0
    for symmetric in (False, True):
        branch = one_impact_branch(DEFAULT, 0.27, 1, symmetric)
        orbit = start(branch, 1.4)
        followed = orbit_branch(DEFAULT, orbit, 0.25, 0.32, "omega")
        assert set(followed.ends) <= {"range", "closed"}
        np.testing.assert_allclose(followed.clearance, orbit.clearance, rtol=0, atol=0)
        for omega, speed, multipliers in zip(
            followed.omega, followed.velocities[:, 0], followed.multipliers, strict=True
        ):
            known = one_impact_branch(DEFAULT, float(omega), 1, symmetric)
            c, d = known.position_coefficient, known.velocity_coefficient
            assert math.hypot(orbit.clearance + c * speed, d * speed) == pytest.approx(known.amplitude, rel=1e-12)
            if speed > 0.0:
                angle = math.atan2(orbit.clearance + c * speed, d * speed)
                theirs = orbit_at(known, angle).multipliers
                if abs(theirs[0]) < 100.0:
                    assert mismatch(multipliers, theirs) < 1e-9
        for point in followed.special_points:
            known = one_impact_branch(DEFAULT, point.omega, 1, symmetric)
            speed = point.impacts.velocities[0]
            if point.type in ("PD", "SB", "GR") and speed > 1e-9:
                (same,) = [p for p in known.special_points if p.type == point.type and p.impact_velocity > 0.0]
                assert same.clearance == pytest.approx(orbit.clearance, rel=1e-10)
                turned += 1
            if point.type == "GR" and point.impact is not None:
                assert known.amplitude == pytest.approx(orbit.clearance, rel=1e-10)
                turned += 1
    assert turned >= 3


def test_a_closed_branch_comes_back_to_where_it_began():
    """Around the resonance of one mass, where clearances below its peak are grazed at two frequencies."""
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    branch = one_impact_branch(oscillator, 1.0)
    orbit = start(branch, branch.angles(0.9 * branch.amplitude)[0])
    followed = orbit_branch(oscillator, orbit, 0.5, 2.0, "omega")
    assert followed.ends == ("closed", "closed")
    assert len([p for p in followed.special_points if p.impact is not None]) == 2
    apart = np.abs(followed.velocities[-1, 0] - followed.velocities[0, 0]) + abs(followed.omega[-1] - followed.omega[0])
    assert apart < 0.3  # one step
    cut = orbit_branch(oscillator, orbit, 0.5, 2.0, "omega", max_points=5)
    assert cut.ends == ("points", "points")
    assert len(cut.values) == 11


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("start", {"start": 1.7}),
        ("start", {"start": -1.0}),
        ("start", {"stop": math.inf}),
        ("parameter", {"parameter": "damping"}),
        ("longest_step", {"longest_step": 0.0}),
        ("max_points", {"max_points": 0}),
    ],
)
def test_invalid_branch_requests_are_refused(name, change):
    orbit = default_orbit("1-2r-2l")
    with refused(name):
        orbit_branch(DEFAULT, orbit, **({"start": 1.5, "stop": 1.6} | change))


def test_an_orbit_that_was_not_found_is_not_continued():
    branch = one_impact_branch(DEFAULT, 0.27)
    guess = guess_of(branch, orbit_at(branch, 1.2))
    orbit = periodic_orbit(DEFAULT, 0.27, 2.5, guess)
    with pytest.raises(ParameterError, match="converged"):
        orbit_branch(DEFAULT, orbit, 2.0, 3.0)
