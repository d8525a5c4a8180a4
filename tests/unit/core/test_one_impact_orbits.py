"""Motions with one impact, in the core's form, in closed form, in the event-exact simulation and in samples."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import pytest
from scipy.linalg import expm

from grazemap_core.errors import ConditioningError, ParameterError, SteadyMotionError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbit_at, orbits_at_clearance
from tests.support.orbits import angle_of, mismatch, one_impact_motions, random_families, special_motion
from tests.support.oscillators import DEFAULT, first_order


def admissible_range(branch):
    """The angles, lowest and highest, between which orbits are admissible, or None."""
    low, high = max(branch.admissible_above, branch.lowest), 0.5 * math.pi
    return (low, high) if low < high else None


@functools.cache
def stable_orbits(number):
    """Orbits that are stable and admissible, at most 4 of each kind (N, damping, symmetric or n)."""
    cases, kinds = [], {}
    for oscillator, branch, rng in random_families(5):
        span = admissible_range(branch)
        if span is not None:
            orbit = orbit_at(branch, float(rng.uniform(*span)), stop=int(rng.choice([1, -1])))
            kind = (orbit.multiple, orbit.symmetric)
            # the speed of a slow impact, found where positions are round-off of A, has an error of that over the speed
            fast = orbit.impact_velocity > 1e-3 * orbit.omega * branch.amplitude
            if orbit.stable and orbit.admissible and fast and kinds.get(kind, 0) < number // 4:
                kinds[kind] = kinds.get(kind, 0) + 1
                cases.append((oscillator, branch, orbit))
        if len(cases) == number:
            return cases
    raise AssertionError


def follow(oscillator, orbit, shift=0.0, **options):
    velocity = orbit.velocity.copy()
    velocity[-1] *= 1.0 + shift
    return trajectory(oscillator, orbit.omega, orbit.clearance, orbit.displacement, velocity, orbit.phase, **options)


@pytest.mark.thorough
def test_stable_orbits_are_the_motions_that_the_simulation_settles_to():
    orbits = stable_orbits(20)
    assert {oscillator.size for oscillator, _, _ in orbits} == {1, 2, 3, 4}
    assert {oscillator.gamma is None for oscillator, _, _ in orbits} == {True, False}
    assert len({(orbit.multiple, orbit.symmetric) for _, _, orbit in orbits}) >= 4
    for oscillator, branch, orbit in orbits:
        slowest = float(abs(orbit.multipliers[0]))
        turns = max(2, math.ceil(36.0 / -math.log(slowest))) if slowest > 0.0 else 2
        assert turns < 3000
        settled = follow(oscillator, orbit, 1e-7, periods=2 * orbit.multiple, transient_periods=turns * orbit.multiple)
        impacts, period = settled.impacts, orbit.multiple * 2.0 * math.pi / orbit.omega
        inside = (impacts.time > 0.25 * period / 2) & (impacts.time < 1.75 * period)
        expected = np.arange(1, 4) * period / 2 if orbit.symmetric else np.array([period])
        np.testing.assert_allclose(impacts.time[inside], expected, rtol=0, atol=1e-11 * period)
        stops = orbit.stop * np.array([-1, 1, -1] if orbit.symmetric else [1])
        np.testing.assert_array_equal(impacts.stop[inside], stops)
        scale = orbit.omega * branch.amplitude
        np.testing.assert_allclose(np.abs(impacts.velocity[inside]), orbit.impact_velocity, rtol=0, atol=1e-11 * scale)
        # the ellipse, with the speed that the simulation has
        speed = abs(impacts.velocity[inside][0])
        radius = math.hypot(orbit.clearance + branch.position_coefficient * speed, branch.velocity_coefficient * speed)
        assert radius == pytest.approx(branch.amplitude, rel=1e-11)
        motion = settled.motion
        assert (motion.kind, motion.symmetric) == ("periodic", orbit.symmetric)


@pytest.mark.thorough
def test_a_coefficient_wrong_in_its_eleventh_digit_is_detected():
    _, branch, orbit = stable_orbits(12)[0]
    c, d = branch.position_coefficient, branch.velocity_coefficient
    speed = orbit.impact_velocity
    for wrong in (math.hypot(orbit.clearance + c * speed, 1.001 * d * speed), math.hypot(orbit.clearance, d * speed)):
        assert abs(wrong / branch.amplitude - 1.0) > 1e-8


def test_multipliers_are_those_of_the_tangent_flow():
    worst = 0.0
    for oscillator, _, orbit in stable_orbits(12):
        period = 2.0 * math.pi / orbit.omega
        later = 0.3 * period
        x, v = follow(oscillator, orbit).at(np.array([later]))
        phase = math.remainder(orbit.phase + orbit.omega * later, 2.0 * math.pi)
        run = monodromy(oscillator, orbit.omega, orbit.clearance, x[:, 0], v[:, 0], phase, period=orbit.multiple)
        assert run.closing < 1e-11
        worst = max(worst, mismatch(orbit.multipliers, run.multipliers))
    assert worst < 1e-9


def test_multipliers_are_the_zeros_of_the_reduced_function():
    # det(mu I - M) = det(mu I - e^(A tau)) chi(mu)/v with sums of the impulse response at mu
    for oscillator, branch, rng in itertools.islice(random_families(7), 12):
        orbit = orbit_at(branch, float(rng.uniform(branch.lowest, 0.5 * math.pi)))
        count, rebound, matrix = oscillator.size, 1.0 + oscillator.restitution, first_order(oscillator)
        flow = expm(matrix * branch.pattern.spacing(branch.omega)) * (-1.0 if orbit.symmetric else 1.0)
        unit, identity = np.eye(2 * count)[count], np.eye(2 * count)

        def sums(mu, flow=flow, matrix=matrix, unit=unit, identity=identity, count=count):
            total = np.linalg.solve(mu * identity - flow, flow @ unit)
            return total[0], total[count], (matrix @ total)[count]

        speed = orbit.impact_velocity
        h, _, bend = sums(1.0)
        signed = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
        for mu in (0.7, -1.3, 0.4 + 0.9j):
            at, slope, second = sums(mu)
            chi = speed * (1.0 + rebound * slope) ** 2 + rebound * at * (
                branch.omega**2 * (orbit.clearance + rebound * speed * h) + rebound * speed * (bend - second)
            )
            expected = np.linalg.det(mu * identity - flow) * chi / speed
            assert np.prod(mu - signed) == pytest.approx(expected, rel=1e-10, abs=1e-10)


def special_cases(families):
    """Random motions, their branch in closed form, and a type of special motions that both have or that neither has."""
    for motions, branch in families:
        assert motions.has_one_interval
        known = {point.type: point for point in branch.special_points[1:]}
        for kind in motions.types:
            ours, theirs = special_motion(motions, kind), known.pop(kind, None)
            assert (ours is None) == (theirs is None), (kind, branch.pattern, branch.omega)
            if ours is not None:
                yield motions, branch, kind, ours, theirs
        assert not known


def compared(families):
    """How many special motions of each type are those of the closed form in 50 digits, of like or lone stops.

    The bound is that of the rounding of an angle, times 64 and the sensitivity of the angle to the displacement: a
    contact next to the time at which the forcing is as at the graze has hardly any influence on it.
    """
    counts = {"SN": 0, "PD": 0, "SB": 0, "GR": 0}
    for motions, branch, kind, ours, theirs in special_cases(families):
        counts[kind] += 1
        slope = branch.amplitude * (math.cos(theirs.angle) + math.tan(abs(branch.lowest)))
        rounding = 64 * 2.3e-16 * theirs.sensitivity
        lean = math.hypot(1.0, branch.position_coefficient / branch.velocity_coefficient)
        assert abs(ours.gap - theirs.clearance) <= slope * rounding + 1e-13 * branch.amplitude * lean
        speed = branch.amplitude / branch.velocity_coefficient
        assert abs(ours.speed - theirs.impact_velocity) <= speed * (rounding + 1e-13)
        assert ours.admissible == theirs.admissible
        if kind == "GR":
            assert ours.stop == theirs.stop * motions.stop
    return counts


def several_families(seed):
    """Families of `random_families`, and of `wide_families`, with a lone stop or like ones: without end."""
    wide = wide_families(seed)
    for number, (_, branch, _) in enumerate(random_families(seed)):
        yield with_motions(branch, stop=1 if number % 3 else -1, alone=number % 2 == 0 and not branch.pattern.symmetric)
        yield with_motions(next(wide))


def with_motions(branch, stop=1, alone=False):
    """The core's motions and the closed form's branch of a pattern."""
    pattern = branch.pattern
    what = branch.oscillator, branch.omega, pattern.multiple, pattern.symmetric, stop, alone
    return one_impact_motions(*what), one_impact_branch(*what)


@pytest.mark.parametrize("families", [40, pytest.param(400, marks=pytest.mark.thorough)])
def test_special_motions_are_those_of_the_closed_form_in_50_digits(families):
    counts = compared(itertools.islice(several_families(8), families))
    assert sum(counts.values()) > families
    assert min(counts.values()) > families // 16


def after_impact(oscillator, branch, orbit):
    """Just after an impact: the amplitudes of the forced part, and the free part of the state."""
    forced = branch.steady * np.exp(1j * orbit.phase)
    free = np.concatenate([orbit.displacement - forced.imag, orbit.velocity - orbit.omega * forced.real])
    free[oscillator.size] -= (1.0 + oscillator.restitution) * orbit.velocity[0]
    return forced, free


def beyond_the_stops(oscillator, branch, angle, samples=6000):
    """By how much the motion at an angle exceeds a stop between its impacts, in units of A, from samples."""
    tau = branch.pattern.spacing(branch.omega)
    orbit = orbit_at(branch, angle)
    times = np.linspace(0.0, tau, samples + 1)
    forced, free = after_impact(oscillator, branch, orbit)
    step = expm(first_order(oscillator) * (tau / samples))
    path = np.empty(samples + 1)
    for k in range(samples + 1):
        path[k] = free[0]
        free = step @ free
    path += (forced[0] * np.exp(1j * orbit.omega * times)).imag
    return np.max(np.abs(path[1:-1])) / branch.amplitude - orbit.clearance / branch.amplitude


def test_special_motions_whose_speed_is_below_round_off_are_on_their_side():
    """So long after an impact its response has decayed: speeds are below 1e-17, and their signs are those of sums."""
    oscillator, seen = Oscillator.create([1.0], [1.0], 0.4, [1.0], 0.8), set()
    for omega in np.linspace(0.25, 0.35, 9).tolist():
        motions, branch = (make(oscillator, omega, 6, alone=True) for make in (one_impact_motions, one_impact_branch))
        known = {point.type: point.impact_velocity for point in branch.special_points[1:] if point.type != "GR"}
        assert {kind for kind in ("SN", "PD") if special_motion(motions, kind) is not None} == set(known)
        assert all(speed < 1e-17 for speed in known.values())
        seen.add(frozenset(known))
    assert len(seen) > 1


def admissible_from(motions):
    """The angle above which motions are admissible, pi/2 where none is; it is decided whether there are any."""
    (begin,) = motions.admissible_from
    assert begin.any is not None
    return angle_of(motions, begin.phase) if begin.any else 0.5 * math.pi


@pytest.mark.parametrize("families", [15, pytest.param(60, marks=pytest.mark.thorough)])
def test_motions_are_admissible_exactly_down_to_their_graze(families):
    checked, never = 0, 0
    for oscillator, branch, _ in itertools.islice(random_families(9), families):
        motions, top = with_motions(branch)[0], 0.5 * math.pi
        above = admissible_from(motions)
        if above == top:
            never += 1
            for angle in (top - 1e-3, 0.5 * (top + branch.lowest)):
                assert beyond_the_stops(oscillator, branch, angle) > 0.0
            continue
        start = max(branch.lowest, above)
        for share in (0.01, 0.3, 0.99):
            assert beyond_the_stops(oscillator, branch, start + share * (top - start)) < 0.0
        graze = special_motion(motions, "GR")
        assert (graze is not None) == (above > branch.lowest + 1e-9)
        if graze:
            checked += 1
            below = above - 0.01 * (above - branch.lowest)
            assert beyond_the_stops(oscillator, branch, below) > 0.0
            assert abs(beyond_the_stops(oscillator, branch, angle_of(motions, graze.phase))) < 1e-5
    assert checked > families // 4
    assert never > families // 12


def wide_families(seed):
    """Chains of 1..5 masses, rates over two decades, from light to heavy damping, R from 0 to 1: without end."""
    rng = np.random.default_rng(seed)
    while True:
        count = int(rng.integers(1, 6))
        stiffnesses = 10.0 ** rng.uniform(-1, 1.5, count)
        damping = 10.0 ** rng.uniform(-3, 0.5, count)
        oscillator = Oscillator.create(
            10.0 ** rng.uniform(-1, 1, count),
            stiffnesses,
            damping if rng.integers(2) else float(damping[0] / np.max(stiffnesses)),
            np.concatenate(([1.0], rng.uniform(-0.5, 0.5, count - 1))),
            float(rng.choice([0.0, 0.5, 0.9, 1.0])),
        )
        multiple = int(rng.integers(1, 5))
        symmetric = bool(rng.integers(2)) and multiple % 2 == 1
        yield one_impact_branch(oscillator, float(10.0 ** rng.uniform(-1, 0.6)), multiple, symmetric)


@pytest.mark.parametrize("families", [30, pytest.param(120, marks=pytest.mark.thorough)])
def test_heavy_damping_and_impacts_without_or_with_full_rebound_are_covered_too(families):
    seen = {"admissible": 0, "never": 0}
    for branch in itertools.islice(wide_families(13), families):
        oscillator, high = branch.oscillator, 0.5 * math.pi
        above = admissible_from(with_motions(branch)[0])
        low = max(above, branch.lowest)
        if above == high:
            seen["never"] += 1
            assert beyond_the_stops(oscillator, branch, high - 1e-3 * (high - branch.lowest), 4000) > 0.0
            continue
        seen["admissible"] += 1
        for share in (0.001, 0.5, 0.999):
            assert beyond_the_stops(oscillator, branch, low + share * (high - low), 2000) < 1e-11
        if above > branch.lowest + 1e-9:
            below = above - 0.02 * (above - branch.lowest)
            assert beyond_the_stops(oscillator, branch, below, 4000) > 0.0
    assert min(seen.values()) > families // 6


def test_orbits_of_a_clearance_lie_on_their_branch():
    branch = one_impact_branch(DEFAULT, 0.27)
    saddle = next(p for p in branch.special_points if p.type == "SN")
    assert orbits_at_clearance(branch, saddle.clearance * (1 + 1e-9)) == []
    slow, fast = orbits_at_clearance(branch, 0.5 * (saddle.clearance + branch.amplitude))
    assert slow.impact_velocity < saddle.impact_velocity < fast.impact_velocity
    assert (slow.stable, fast.stable) == (False, True)
    (only,) = orbits_at_clearance(branch, 0.99 * branch.amplitude)
    assert only.impact_velocity > fast.impact_velocity
    mirrored = orbit_at(branch, fast.angle, stop=-1)
    np.testing.assert_array_equal(mirrored.displacement, -orbit_at(branch, fast.angle).displacement)
    assert mirrored.displacement[0] == -mirrored.clearance


def test_the_impact_speed_is_bounded_from_below_by_the_energy_that_is_lost():
    # D/omega > (1 - R)/(2 omega): kicks that repeat never take energy out of a damped chain
    for oscillator, branch, _ in itertools.islice(random_families(12), 200):
        family = OrbitFamily.of(oscillator, branch.pattern.multiple, branch.pattern.symmetric)
        orbits = OneImpactOrbits([family.at(branch.omega)], 1, 1.0 + oscillator.restitution)
        assert orbits.straight > 0.5 * (1.0 - oscillator.restitution)


def test_motions_of_other_kinds_are_refused():
    with pytest.raises(ParameterError, match="odd"):
        one_impact_motions(DEFAULT, 0.3, 2, symmetric=True)
    with pytest.raises(ParameterError, match="period"):
        one_impact_motions(DEFAULT, 0.3, 0)
    with pytest.raises(ParameterError, match="omega"):
        one_impact_motions(DEFAULT, -0.3)
    with pytest.raises(ParameterError, match="forcing"):
        one_impact_motions(Oscillator.create([1.0], [1.0], 0.1, [0.0], 0.8), 0.3)
    with pytest.raises(SteadyMotionError):
        one_impact_motions(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.3)
    with pytest.raises(ConditioningError, match="speed"):  # elastic, and hardly damped
        one_impact_motions(Oscillator.create([1.0], [1.0], 1e-16, [1.0], 1.0), 0.3)
