"""Motions with one impact in closed form, against the event-exact simulation, 50-digit matrices and the literature."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np
import pytest
from flint import arb
from scipy.linalg import expm

from grazemap_core.errors import ParameterError, SteadyMotionError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_branches import one_impact_branch
from grazemap_core.orbits.one_impact_curves import one_impact_curves
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import OneImpact
from tests.oracles.one_impact_orbits import orbit_at, orbits_at_clearance
from tests.support.orbits import mismatch, random_families
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
    _, branch, orbit = stable_orbits(20)[0]
    c, d = branch.position_coefficient, branch.velocity_coefficient
    speed = orbit.impact_velocity
    for wrong in (math.hypot(orbit.clearance + c * speed, 1.001 * d * speed), math.hypot(orbit.clearance, d * speed)):
        assert abs(wrong / branch.amplitude - 1.0) > 1e-8


def test_multipliers_are_those_of_the_tangent_flow():
    worst = 0.0
    for oscillator, _, orbit in stable_orbits(20):
        period = 2.0 * math.pi / orbit.omega
        later = 0.3 * period
        x, v = follow(oscillator, orbit).at(np.array([later]))
        phase = math.remainder(orbit.phase + orbit.omega * later, 2.0 * math.pi)
        run = monodromy(oscillator, orbit.omega, orbit.clearance, x[:, 0], v[:, 0], phase, period=orbit.multiple)
        assert run.closing < 1e-11
        worst = max(worst, mismatch(orbit.multipliers, run.multipliers))
    assert worst < 1e-9


def test_multipliers_are_those_of_50_digit_flow_and_saltation_matrices():
    worst = 0.0
    for number, (oscillator, branch, rng) in zip(range(60), random_families(6), strict=False):
        angle = float(rng.uniform(branch.lowest, 0.5 * math.pi))
        if number % 3 == 0:
            angle = 0.5 * math.pi - 10.0 ** rng.uniform(-9, -2)  # hardly any impact: one multiplier is large
        orbit = orbit_at(branch, angle)
        with digits():
            sign = -1 if orbit.symmetric else 1
            family = OneImpact(oscillator, arb(orbit.omega), branch.pattern.half_periods, sign)
            ((_, _, steady),) = family.linear.amplitudes(family.omega)
            phase = arb(angle) - steady[0].arg()
            state = family.state(phase)
            exact = [float(state[i, 0]) for i in range(2 * oscillator.size)]
            speed = float(family.speed(phase))
            exact_multipliers = family.multipliers(phase)
        size = np.max(np.abs(exact))
        np.testing.assert_allclose([*orbit.displacement, *orbit.velocity], exact, rtol=0, atol=1e-12 * size)
        assert orbit.impact_velocity == pytest.approx(speed, rel=1e-12, abs=1e-15 * size)
        signed = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
        if orbit.half_multipliers is not None:
            assert mismatch(orbit.multipliers, signed**2) == 0.0
        # the angle is rounded: that moves a large multiplier, which goes as one over the speed
        rounding = 2.2e-16 * branch.amplitude / (branch.velocity_coefficient * orbit.impact_velocity)
        worst = max(worst, mismatch(signed, exact_multipliers) - 4.0 * rounding)
    assert worst < 1e-10


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


def test_special_points_have_the_multipliers_that_name_them():
    kinds = set()
    for _, branch, _ in itertools.islice(random_families(8), 60):
        for point in branch.special_points[1:]:
            radius = math.hypot(
                point.clearance + branch.position_coefficient * point.impact_velocity,
                branch.velocity_coefficient * point.impact_velocity,
            )
            assert radius == pytest.approx(branch.amplitude, rel=1e-12)
            assert point.clearance == pytest.approx(branch.clearance(point.angle), abs=1e-13 * branch.amplitude)
            if point.type == "GR":
                continue
            orbit = orbit_at(branch, point.angle)
            signed = orbit.multipliers if orbit.half_multipliers is None else orbit.half_multipliers
            expected = 1.0 if point.type == "SN" else -1.0
            size = float(np.max(np.abs(signed)))
            assert np.min(np.abs(signed - expected)) < 1e-6 * max(1.0, size), (point, signed)
            assert point.admissible == orbit.admissible
            kinds.add(point.type)
    assert kinds == {"SN", "PD", "SB"}


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


@pytest.mark.parametrize("families", [15, pytest.param(60, marks=pytest.mark.thorough)])
def test_branches_are_admissible_exactly_down_to_their_graze(families):
    checked, never = 0, 0
    for oscillator, branch, _ in itertools.islice(random_families(9), families):
        assert branch.admissibility == "decided"
        top = 0.5 * math.pi
        if branch.admissible_above == top:
            never += 1
            for angle in (top - 1e-3, 0.5 * (top + branch.lowest)):
                assert beyond_the_stops(oscillator, branch, angle) > 0.0
            continue
        start = max(branch.lowest, branch.admissible_above)
        for share in (0.01, 0.3, 0.99):
            assert beyond_the_stops(oscillator, branch, start + share * (top - start)) < 0.0
        graze = [p for p in branch.special_points[1:] if p.type == "GR"]
        assert bool(graze) == (branch.admissible_above > branch.lowest)
        if graze:
            checked += 1
            below = branch.admissible_above - 0.01 * (branch.admissible_above - branch.lowest)
            assert beyond_the_stops(oscillator, branch, below) > 0.0
            assert abs(beyond_the_stops(oscillator, branch, graze[0].angle)) < 1e-5
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
        yield oscillator, one_impact_branch(oscillator, float(10.0 ** rng.uniform(-1, 0.6)), multiple, symmetric)


@pytest.mark.parametrize("families", [30, pytest.param(120, marks=pytest.mark.thorough)])
def test_heavy_damping_and_impacts_without_or_with_full_rebound_are_covered_too(families):
    seen = {"admissible": 0, "never": 0}
    for oscillator, branch in itertools.islice(wide_families(13), families):
        assert branch.admissibility == "decided"
        span = admissible_range(branch)
        if span is None:
            seen["never"] += 1
            near = 0.5 * math.pi - 1e-3 * (0.5 * math.pi - branch.lowest)
            assert beyond_the_stops(oscillator, branch, near, 4000) > 0.0
            continue
        seen["admissible"] += 1
        low, high = span
        for share in (0.001, 0.5, 0.999):
            assert beyond_the_stops(oscillator, branch, low + share * (high - low), 2000) < 1e-11
        if branch.admissible_above > branch.lowest:
            below = branch.admissible_above - 0.02 * (branch.admissible_above - branch.lowest)
            assert beyond_the_stops(oscillator, branch, below, 4000) > 0.0
    assert min(seen.values()) > families // 6


def test_a_graze_is_located_to_round_off():
    # at the time that is given the motion touches the stop that is given, with no velocity
    for oscillator, branch, _ in itertools.islice(random_families(10), 40):
        for point in branch.special_points[1:]:
            if point.type != "GR" or point.time == 0.0:
                continue
            orbit = orbit_at(branch, point.angle)
            forced, free = after_impact(oscillator, branch, orbit)
            free = expm(first_order(oscillator) * point.time) @ free
            forced = forced * np.exp(1j * orbit.omega * point.time)
            assert free[0] + forced[0].imag == pytest.approx(point.stop * point.clearance, abs=1e-12 * branch.amplitude)
            assert abs(free[oscillator.size] + orbit.omega * forced[0].real) < 1e-6 * branch.amplitude * orbit.omega


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
    # d > (1 - R)/(2 omega): kicks that repeat never take energy out of a damped chain
    for oscillator, branch, _ in itertools.islice(random_families(12), 200):
        assert branch.velocity_coefficient > (1.0 - oscillator.restitution) / (2.0 * branch.omega)


def test_curves_are_those_of_their_branches():
    omega = np.linspace(0.25, 1.1, 40)
    for multiple, symmetric in ((1, False), (1, True), (2, False)):
        curves = one_impact_curves(DEFAULT, omega, multiple, symmetric)
        columns = {"SN": curves.saddle_node, "SB" if symmetric else "PD": curves.doubling, "GR": curves.contact}
        for i, value in enumerate(omega):
            branch = one_impact_branch(DEFAULT, float(value), multiple, symmetric)
            points = {p.type: p for p in branch.special_points[1:]}
            for kind, curve in columns.items():
                if kind in points:
                    assert curve.clearance[i] == points[kind].clearance
                    assert curve.impact_velocity[i] == points[kind].impact_velocity
                    assert curve.admissible[i] == points[kind].admissible
                else:
                    assert np.isnan(curve.clearance[i])
                    assert not curve.admissible[i]


def test_motions_of_other_kinds_are_refused():
    with pytest.raises(ParameterError, match="odd"):
        one_impact_branch(DEFAULT, 0.3, 2, symmetric=True)
    with pytest.raises(ParameterError, match="multiple"):
        one_impact_branch(DEFAULT, 0.3, 0)
    with pytest.raises(ParameterError, match="omega"):
        one_impact_branch(DEFAULT, -0.3)
    with pytest.raises(ParameterError, match="forcing"):
        one_impact_branch(Oscillator.create([1.0], [1.0], 0.1, [0.0], 0.8), 0.3)
    with pytest.raises(SteadyMotionError):
        one_impact_branch(Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8), 0.3)
    branch = one_impact_branch(DEFAULT, 0.3)
    for angle in (math.nan, 2.0, branch.lowest - 0.01):
        with pytest.raises(ParameterError, match="angle"):
            orbit_at(branch, angle)
    with pytest.raises(ParameterError, match="stop"):
        orbit_at(branch, 1.5, stop=0)
    with pytest.raises(ParameterError, match="clearance"):
        orbits_at_clearance(branch, 0.0)
