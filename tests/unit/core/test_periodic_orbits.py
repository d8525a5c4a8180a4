"""Periodic motions with any impacts, against closed forms, the event-exact simulation and 50-digit shooting."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest
from scipy.linalg import expm

from grazemap_core.contact.stops import stops_between
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT
from grazemap_core.orbits.kernels.equations import OrbitImpacts, assemble, assemble_doubled
from grazemap_core.orbits.kernels.newton import CONVERGED
from grazemap_core.orbits.periodic_orbits import periodic_orbit, solve_sequences
from grazemap_core.orbits.tolerances import ORBIT_FLOOR
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import differences, solved
from tests.oracles.one_impact_orbits import orbit_at
from tests.support.orbits import default_orbit, from_impact, guess_of, mismatch, random_families, settled, tangent_flow
from tests.support.oscillators import DEFAULT, first_order
from tests.support.random_chains import random_oscillator
from tests.support.refused import refused


@functools.cache
def random_orbits():
    """Orbits that trajectories of random chains settle to, at most two of each kind (N, damping)."""
    rng = np.random.default_rng(11)
    kinds, cases = {}, []
    for number in itertools.count():
        count, per_link = 1 + number % 4, bool(number // 4 % 2)
        oscillator = random_oscillator(rng, count, per_link)
        omega = float(rng.uniform(0.3, 2.0))
        clearance = float(rng.uniform(0.2, 0.95) * grazing_curve(oscillator, [omega]).clearance[0])
        run = settled(oscillator, omega, clearance, 400)
        kind = (count, per_link)
        if run.motion.kind != "periodic" or not len(run.impacts.time) or kinds.get(kind, 0) == 2:
            continue
        if run.motion.sticking or np.any(run.impacts.kind != "impact") or not 2 <= (k := impacts(run)) <= 12:
            continue
        kinds[kind] = kinds.get(kind, 0) + 1
        cases.append((oscillator, run, periodic_orbit(oscillator, omega, clearance, impacts_of(run))))
        if len(cases) == 16:
            return cases
    raise AssertionError(k)


def impacts(run):
    return max(run.motion.impacts_right, 0) + max(run.motion.impacts_left, 0)


def test_orbits_with_one_impact_are_those_of_the_closed_form():
    worst = np.zeros(5)
    for oscillator, branch, rng in itertools.islice(random_families(31), 60):
        known = orbit_at(branch, float(rng.uniform(branch.lowest, 0.5 * math.pi)), stop=int(rng.choice([1, -1])))
        guess = guess_of(branch, known, 1e-3)
        orbit = periodic_orbit(oscillator, branch.omega, known.clearance, guess)
        assert orbit.converged
        scale = branch.omega * max(branch.amplitude, known.clearance)
        assert orbit.residual <= 1e-14
        assert orbit.kantorovich < 0.5
        phase = math.remainder(orbit.phase - known.phase, 2.0 * math.pi)
        state = max(
            np.max(np.abs(orbit.displacement - known.displacement)), np.max(np.abs(orbit.velocity - known.velocity))
        )
        errors = [
            abs(phase),
            abs(orbit.impacts.velocities[0] - known.stop * known.impact_velocity) / scale,
            state / max(np.max(np.abs(known.displacement)), np.max(np.abs(known.velocity))),
            mismatch(orbit.multipliers, known.multipliers) if known.half_multipliers is None else 0.0,
            0.0 if known.half_multipliers is None else mismatch(orbit.half_multipliers, known.half_multipliers),
        ]
        # what round-off of the equations allows is what the orbit says of itself
        assert max(errors[:2]) <= orbit.radius
        worst = np.maximum(worst, errors)
        assert orbit.admissible == known.admissible
        assert orbit.stable == known.stable
        assert orbit.symmetric == known.symmetric
        assert orbit.least_period == known.multiple
    assert np.all(worst < [1e-12, 1e-12, 1e-12, 1e-10, 1e-10]), worst


def test_orbits_and_multipliers_are_those_of_50_digit_shooting():
    orbits = [(oscillator, orbit) for oscillator, _, orbit in random_orbits()] + [
        (DEFAULT, default_orbit(label)) for label in ("3-4r-4l", "1-2r-2l", "1-3r-3l")
    ]
    worst, closest = 0.0, 0.0
    for oscillator, orbit in orbits:
        assert orbit.isolated
        exact = solved(oscillator, orbit.omega, orbit.clearance, orbit.impacts)
        with digits():
            theirs = exact.multipliers()
        phase, speed = differences(exact, orbit.impacts)
        scale = orbit.omega * max(orbit.clearance, grazing_curve(oscillator, [orbit.omega]).clearance[0])
        error = max(phase, speed / scale)
        assert error <= orbit.radius
        closest = max(closest, error / orbit.radius)
        worst = max(worst, error)
        ours = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
        assert mismatch(ours, theirs) < 1e-9
    assert worst < 1e-11
    assert closest > 1e-5  # the radius is no empty promise


def test_small_multipliers_keep_their_digits():
    """Beside others of ordinary size; a product of matrices leaves 1e-16 of the largest."""
    orbit = default_orbit("3-4r-4l")
    exact = solved(DEFAULT, orbit.omega, orbit.clearance, orbit.impacts)
    with digits():
        theirs = sorted(exact.multipliers(), key=abs)
    ours = sorted(orbit.half_multipliers, key=abs)
    assert abs(ours[0] / theirs[0] - 1.0) < 1e-9


def test_an_orbit_of_sixteen_impacts_is_the_motion_that_the_simulation_settles_to():
    orbit = default_orbit("5-8r-8l")
    assert orbit.label == "5-8r-8l"
    assert len(orbit.impacts.whole.stops) == 16
    assert orbit.residual <= 1e-12
    assert (orbit.converged, orbit.isolated, orbit.admissible, orbit.symmetric, orbit.stable) == (True,) * 5
    run = tangent_flow(DEFAULT, orbit)
    assert run.closing < 1e-13
    assert mismatch(orbit.multipliers, run.multipliers) < 1e-9
    follow = from_impact(DEFAULT, orbit, periods=5)
    shifted = orbit.impacts.whole.phases - orbit.impacts.phases[0]
    np.testing.assert_allclose(follow.impacts.time[:16] * 0.27, shifted, rtol=0, atol=1e-11)
    np.testing.assert_allclose(follow.impacts.velocity[:16], orbit.impacts.whole.velocities, rtol=0, atol=1e-11)
    np.testing.assert_array_equal(follow.impacts.stop[:16], orbit.impacts.whole.stops)


def test_settled_trajectories_of_random_chains_are_orbits_with_the_tangent_flow_s_multipliers():
    orbits = random_orbits()
    assert {(oscillator.size, oscillator.gamma is None) for oscillator, _, _ in orbits} == set(
        itertools.product([1, 2, 3, 4], [False, True])
    )
    assert len({orbit.label for _, _, orbit in orbits}) >= 4
    for oscillator, run, orbit in orbits:
        assert orbit.converged, orbit.reason
        assert orbit.admissible
        assert (orbit.least_period, orbit.symmetric) == (run.motion.period, run.motion.symmetric)
        tangent = tangent_flow(oscillator, orbit)
        assert tangent.closing < 1e-11
        assert mismatch(orbit.multipliers, tangent.multipliers) < 1e-9


@pytest.mark.parametrize("families", [150, pytest.param(300, marks=pytest.mark.thorough)])
def test_admissible_orbits_are_followed_by_the_simulation_and_others_are_not(families):
    """From just before the first impact over one span: the same impacts, or others."""
    seen = set()
    for oscillator, branch, rng in itertools.islice(random_families(32), families):
        known = orbit_at(branch, float(rng.uniform(branch.lowest, 0.5 * math.pi)))
        orbit = periodic_orbit(oscillator, branch.omega, known.clearance, guess_of(branch, known))
        if oscillator.restitution == 0.0 or abs(orbit.excess) < 1e-6:
            continue
        run = from_impact(oscillator, orbit, periods=orbit.impacts.period)
        end = branch.pattern.half_periods * math.pi / branch.omega
        between = np.sum((run.impacts.time > 1e-9 * end) & (run.impacts.time < (1.0 - 1e-9) * end))
        assert orbit.admissible == (between == 0)
        seen.add((orbit.admissible, orbit.symmetric))
    assert len(seen) == 4


def test_the_derivatives_are_those_of_the_equations():
    rng = np.random.default_rng(4)
    for symmetric in (False, True):
        for damping in (0.08, [0.05, 0.2, 1.5]):
            oscillator = Oscillator.create([1.0, 2.0, 1.5], [1.0, 1.5, 0.7], damping, [1.0, 0.3, -0.2], 0.7)
            family, omega, count = OrbitFamily.of(oscillator, 1, symmetric), 0.9, 3
            sides, stops = np.array([1.0, -1.0, 1.0]), stops_between(oscillator, 0.7, 0.0)
            phases, speeds = np.array([0.3, 1.1, 2.4]), rng.normal(size=count)

            def residual(phases, speeds, omega, family=family, sides=sides, stops=stops):
                problem = family.at(omega).problem(2.0)
                left, matrix, before = np.zeros(6), np.zeros((6, 7)), np.zeros((3, 3))
                assemble(problem, OrbitImpacts(stops, sides, phases, speeds), left, matrix, before)
                return left, matrix, before

            _, matrix, before = residual(phases, speeds, omega)
            step = 1e-5
            for column in range(7):
                ends = []
                for sign in (1.0, -1.0):
                    point = np.concatenate([phases, speeds, [omega]])
                    point[column] += sign * step
                    ends.append(residual(point[:3], point[3:6], point[6])[0])
                np.testing.assert_allclose((ends[0] - ends[1]) / (2.0 * step), matrix[:, column], rtol=0, atol=3e-8)
            # changes that come back with the opposite sign are those of the doubled (of the whole) period
            whole = OrbitFamily.of(oscillator, 1 if symmetric else 2, False)
            turn = family.turn
            both = np.zeros((12, 13))
            sign = -1.0 if symmetric else 1.0
            assemble(
                whole.at(omega).problem(2.0),
                OrbitImpacts(
                    stops,
                    np.concatenate([sides, sign * sides]),
                    np.concatenate([phases, phases + turn]),
                    np.concatenate([speeds, sign * speeds]),
                ),
                np.zeros(12),
                both,
                np.zeros((6, 3)),
            )
            doubled = np.zeros((6, 6))
            problem = family.at(omega).problem(2.0)
            assemble_doubled(problem, OrbitImpacts(stops, sides, phases, speeds), before, doubled)
            rows, first = np.r_[0:3, 6:9], both[np.r_[0:3, 6:9]]
            assert rows.shape == (6,)
            # a change of velocities is mirrored too: phases come back with -1, velocities with -sign
            second = np.concatenate([-np.ones(3), -sign * np.ones(3)])
            combined = first[:, np.r_[0:3, 6:9]] + first[:, np.r_[3:6, 9:12]] * second
            np.testing.assert_allclose(combined, doubled, rtol=0, atol=1e-12)


def test_the_test_functions_are_those_of_the_monodromy_matrix():
    """``prod v_i det(M -+ I)`` over that of the free flow, in units of omega and one length."""
    for oscillator, orbit in [(o, p) for o, _, p in random_orbits()] + [(DEFAULT, default_orbit("3-4r-4l"))]:
        values = ParameterPoint.of(oscillator, orbit.omega, orbit.clearance)
        path, unknowns = ContinuationProblem.through(oscillator, orbit.impacts, "clearance", values)
        count, sign = len(orbit.impacts.stops), -1.0 if orbit.impacts.symmetric else 1.0
        free = sign * np.linalg.eigvals(expm(first_order(oscillator) * path.pattern.spacing(orbit.omega)))
        impacting = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
        point = path.evaluate(unknowns)
        for ours, mu in ((point.fold_test, 1.0), (point.doubling_test, -1.0)):
            theirs = np.prod(unknowns[count : 2 * count]) * (np.prod(mu - impacting) / np.prod(mu - free)).real
            assert abs(ours) == pytest.approx(abs(theirs), rel=1e-9)


def test_orbits_solved_together_equal_those_solved_one_by_one():
    orbit = default_orbit("1-2r-2l")
    rng = np.random.default_rng(5)
    clearances = orbit.clearance + rng.uniform(-0.01, 0.01, 20)
    family = OrbitFamily.of(DEFAULT, orbit.impacts.period, orbit.impacts.symmetric).at(0.27)
    problem = family.problem(max(family.steady_size, float(np.max(clearances))))
    stops = [stops_between(DEFAULT, float(clearance), 0.0) for clearance in clearances]
    guesses = [np.tile(values, (20, 1)) for values in (orbit.impacts.phases, orbit.impacts.velocities)]
    phases, speeds, many = solve_sequences(problem, orbit.impacts, stops, *guesses, floor=-ORBIT_FLOOR)
    multipliers = many.real + 1j * many.imaginary
    assert np.all(many.status == CONVERGED)
    assert np.all(many.contact_status == NO_FURTHER_CONTACT)
    assert np.all(np.abs(multipliers) < 1.0)
    assert np.max(many.kantorovich) < 0.5
    for i in (0, 7, 19):
        single = periodic_orbit(DEFAULT, 0.27, clearances[i], orbit.impacts)
        np.testing.assert_allclose(phases[i], single.impacts.phases, rtol=0, atol=1e-13)
        velocities = speeds[i] * (problem.omega * problem.length)
        np.testing.assert_allclose(velocities, single.impacts.velocities, rtol=0, atol=1e-13)
        assert mismatch(multipliers[i], single.half_multipliers) < 1e-12


def test_an_orbit_solved_for_as_a_multiple_or_as_a_whole_is_marked():
    orbit = default_orbit("1-2r-2l")
    whole = orbit.impacts.whole
    tripled = ImpactSequence.create(
        3,
        np.tile(whole.stops, 3),
        np.concatenate([whole.phases + 2.0 * math.pi * i for i in range(3)]),
        np.tile(whole.velocities, 3),
    )
    tripled_orbit = periodic_orbit(DEFAULT, 0.27, orbit.clearance, tripled)
    assert (
        tripled_orbit.least_period,
        tripled_orbit.label,
        tripled_orbit.symmetric,
        tripled_orbit.half_multipliers,
    ) == (1, "1-2r-2l", True, None)
    assert mismatch(tripled_orbit.multipliers, orbit.multipliers**3) < 1e-12
    assert tripled_orbit.impacts.half().symmetric


def test_a_virtual_orbit_solves_the_equations_and_is_no_motion():
    branch = one_impact_branch(DEFAULT, 0.27)
    clearance = 1.84
    upper = orbit_at(branch, 1.45)
    guess = ImpactSequence.create(1, [1], [upper.phase % (2 * math.pi) + 0.1], [-0.05])
    orbit = periodic_orbit(DEFAULT, 0.27, clearance, guess)
    assert orbit.converged
    assert orbit.impacts.velocities[0] < 0.0
    assert (orbit.physical, orbit.admissible, orbit.contacts) == (False, False, "some")


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("period", {"period": 0}),
        ("period", {"period": 2, "symmetric": True}),
        ("stops", {"stops": []}),
        ("stops", {"stops": [1, 0]}),
        ("phases", {"phases": [1.0]}),
        ("phases", {"phases": [2.0, 1.0]}),
        ("phases", {"phases": [0.0, 7.0]}),
        ("phases", {"phases": [0.0, 3.5], "symmetric": True}),
        ("phases", {"phases": [0.0, math.nan]}),
        ("velocities", {"velocities": [0.1]}),
    ],
)
def test_invalid_sequences_are_refused(name, change):
    numbers = {"period": 1, "stops": [1, -1], "phases": [0.0, 3.0], "velocities": [0.1, -0.1]} | change
    with refused(name):
        ImpactSequence.create(**numbers)


def test_without_an_orbit_the_result_has_a_reason():
    impacts = default_orbit("1-2r-2l").impacts
    far = dataclasses.replace(impacts, phases=impacts.phases + 2.0, velocities=-30.0 * impacts.velocities)
    orbit = periodic_orbit(DEFAULT, 0.27, 5.0, far)
    assert not orbit.converged
    assert orbit.reason
    assert (orbit.stable, orbit.admissible, orbit.isolated) == (False, False, False)
    assert np.all(np.isnan(orbit.multipliers))
    # far above the grazing curve there is no orbit with one impact at all
    orbit = periodic_orbit(DEFAULT, 0.27, 2.5, ImpactSequence.create(1, [1], [1.5], [0.1]))
    assert not orbit.converged


@pytest.mark.parametrize(
    ("name", "oscillator", "omega", "clearance"),
    [
        ("omega", DEFAULT, 0.0, 1.0),
        ("clearance", DEFAULT, 0.27, -1.0),
        ("clearance", DEFAULT, 0.27, math.nan),
        ("forcing", Oscillator.create([1.0], [1.0], 0.1, [0.0], 0.8), 0.27, 1.0),
        ("damping", Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.27, 1.0),
    ],
)
def test_systems_without_such_orbits_are_refused(name, oscillator, omega, clearance):
    guess = ImpactSequence.create(1, [1], [1.0], [0.1])
    with pytest.raises(ParameterError) as caught:
        periodic_orbit(oscillator, omega, clearance, guess)
    assert caught.value.name == name
    assert isinstance(caught.value, SteadyMotionError) == (name == "damping")


def test_trajectories_that_are_no_sequence_of_impacts_are_refused():
    free = trajectory(DEFAULT, 0.27, 2.5, periods=2, transient_periods=200)
    with pytest.raises(ParameterError, match="without impacts"):
        impacts_of(free)
    with pytest.raises(ParameterError, match="not settled"):
        impacts_of(trajectory(DEFAULT, 0.27, 1.5, periods=1))
    short = trajectory(DEFAULT, 0.27, 1.626, periods=1, transient_periods=2500)
    with pytest.raises(ParameterError, match="recorded"):
        impacts_of(short)


def test_impacts_without_rebound_and_without_loss():
    for restitution in (0.0, 1.0):
        oscillator = Oscillator.create([1.0, 2.0], [1.0, 1.0], 0.1, [1.0, 0.0], restitution)
        branch = one_impact_branch(oscillator, 1.1)
        known = orbit_at(branch, 1.2)
        orbit = periodic_orbit(oscillator, 1.1, known.clearance, guess_of(branch, known, 1e-3))
        assert orbit.converged
        assert orbit.admissible == known.admissible
        assert mismatch(orbit.multipliers, known.multipliers) < 1e-10
