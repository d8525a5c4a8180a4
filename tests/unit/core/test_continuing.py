"""A trajectory continues from the end of a record: impacts, rests and releases as without interruption."""

import math
from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
from flint import arb

from grazemap_core.contact.kernels.runs import ANCHOR
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.start import State, forced_oscillator, start, state_at, wrapped
from grazemap_core.simulation.trajectories import Trajectory, trajectory
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.impact_accuracy import random_point
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import STICKING, sticking_case
from tests.support.thorough import every_fourth

PERIODS = 4
CHANGE = 1e-12
"""Relative change of a state from which amplifications are read: far above round-off, too small to bend them."""

Run = Callable[[State | None, int], Trajectory]


def runs(oscillator: Oscillator, omega: float, clearance: float, phase: float = 0.0, usual: State | None = None) -> Run:
    """Trajectories of one chain over so many periods, from a state or else from the usual one: at rest at `phase`."""

    def run(state: State | None, periods: int) -> Trajectory:
        at = state or usual or State(np.zeros(oscillator.size), np.zeros(oscillator.size), phase)
        start = (at.displacement, at.velocity, at.phase)
        return trajectory(oscillator, omega, clearance, *start, periods=periods, samples_per_period=64)

    return run


def events(run: Trajectory, skip: int, period: float) -> np.ndarray:
    """Times of the impacts after `skip` periods, and of the releases there, from then on, without a long time's
    rounding in the impacts'."""
    impacts, end = run.impacts, run.record.end
    late = impacts.period >= skip
    releases = run.sticking.stop_time[run.sticking.stop_time < end] - skip * period
    return np.concatenate(
        [(impacts.period[late] - skip) * period + impacts.phase_time[late], releases[releases >= 0.0]]
    )


def round_off(run: Run, whole: Trajectory, state: State, periods: int, period: float, clearance: float) -> np.ndarray:
    """What the roundings of two runs from `state` may differ by in the times of their events.

    Each coordinate of the state, and of those at the following ends of a forcing period, is changed by CHANGE of its
    size; the times change by so many times that. In going over from blocks to masses and back, and with every event of
    a period in the sums behind it, a coordinate has some 4 N roundings for either run.
    """
    size = len(state.displacement)
    reach = np.concatenate([np.abs(whole.displacement).max(axis=1), np.abs(whole.velocity).max(axis=1)])
    count = len(events(run(state, periods), 0, period))
    total = np.zeros(count)
    for m in range(periods):
        here = state if m == 0 else run(state, m).final
        assert here is not None
        base = events(run(here, periods - m), 0, period)
        for i in range(2 * size):
            if i % size == 0 and abs(here.displacement[0]) == clearance:
                continue  # on the stop by definition, at a speed that the impact law gives
            changed = [here.displacement.copy(), here.velocity.copy()]
            changed[i // size][i % size] += CHANGE * reach[i]
            moved = events(run(State(*changed, here.phase), periods - m), 0, period)
            assert len(moved) == len(base)
            total[count - len(base) :] += np.abs(moved - base) / CHANGE
    return 8 * size * EPSILON * total + 8 * EPSILON * period * periods


def shift(run: Run, omega: float, clearance: float) -> tuple[np.ndarray, np.ndarray, Trajectory]:
    """Run twice PERIODS at once, and in two parts; return the shift of all events, its bound, and the second part."""
    period = 2 * math.pi / omega
    whole, first = run(None, 2 * PERIODS), run(None, PERIODS)
    assert first.final is not None
    second = run(first.final, PERIODS)
    late = whole.impacts.period >= PERIODS
    np.testing.assert_array_equal(whole.impacts.stop[late], second.impacts.stop)
    np.testing.assert_array_equal(whole.impacts.kind[late], second.impacts.kind)
    before, after = events(whole, PERIODS, period), events(second, 0, period)
    assert len(before) == len(after) > 3
    bound = round_off(run, whole, first.final, PERIODS, period, clearance)
    return np.abs(after - before), bound, second


@pytest.mark.parametrize("seed", every_fourth(range(12)))
def test_random_chains_continue_from_where_they_ended(seed: int) -> None:
    oscillator, omega, clearance = random_point(seed)
    run = runs(oscillator, omega, clearance, phase=0.7 * seed)
    moved, bound, _ = shift(run, omega, clearance)
    assert np.all(moved <= bound)
    # the bound would notice an end that is off by 1e-11 of the clearance
    final = run(None, PERIODS).final
    assert final is not None
    other = final.velocity.copy()
    other[0] += 1e-11 * omega * clearance
    off = run(State(final.displacement, other, final.phase), PERIODS)
    there = np.abs(events(off, 0, 2 * math.pi / omega) - events(run(final, PERIODS), 0, 2 * math.pi / omega))
    assert np.any(there > bound)


@pytest.mark.parametrize("seed", every_fourth(seed for seed in STICKING if seed not in (17, 38)))
def test_motions_with_chatter_and_rest_continue_from_where_they_ended(seed: int) -> None:
    oscillator, omega, clearance = sticking_case(seed)
    run = runs(oscillator, omega, clearance)
    moved, bound, _ = shift(run, omega, clearance)
    assert np.all(moved <= bound)
    # and from such a start that the first part ends in the middle of a rest, or of the last bounces before it
    long, period = run(None, 2 * PERIODS), 2 * math.pi / omega
    rests, impacts = long.sticking, long.impacts
    late = np.flatnonzero(rests.start > PERIODS * period)
    ends = [(k, 0.5 * (rests.start[k] + rests.stop_time[k])) for k in late[:2]]
    if oscillator.restitution > 0.0:
        last = impacts.time[impacts.kind == "chatter"]
        ends += [(k, 0.5 * (last[last < rests.start[k]][-1] + rests.start[k])) for k in late[:1]]
    for k, end in ends:
        time = end - PERIODS * period
        x, v = long.at(np.array([time]))
        run = runs(oscillator, omega, clearance, usual=State(x[:, 0], v[:, 0], omega * time))
        moved, bound, second = shift(run, omega, clearance)
        assert np.all(moved <= bound)
        final = run(None, PERIODS).final
        assert final is not None
        assert (final.displacement[0], final.velocity[0]) == (rests.stop[k] * clearance, 0.0)
        assert second.sticking.start[0] == 0.0
        assert second.displacement[0, 0] == final.displacement[0]


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_an_impact_at_the_very_end_is_neither_lost_nor_doubled(restitution: float, seed: int) -> None:
    free = Oscillator.create([1.0], [1.0], 0.0, [0.0], restitution)
    # x = w sin t meets the stop at t = 1, where the first period ends, to a rounding on either side
    speed = float(np.random.default_rng(seed).uniform(0.5, 2.0))
    clearance = speed * math.sin(1.0)
    for stop in (1.0, -1.0):
        start = {"velocity": np.array([stop * speed]), "samples_per_period": 1}
        whole = trajectory(free, 2 * math.pi, clearance, periods=4, **start)
        first = trajectory(free, 2 * math.pi, clearance, periods=1, **start)
        assert first.final is not None
        assert abs(first.final.displacement[0]) <= clearance
        assert first.final.displacement[0] == pytest.approx(stop * clearance, rel=4 * EPSILON)
        second = trajectory(
            free,
            2 * math.pi,
            clearance,
            first.final.displacement,
            first.final.velocity,
            periods=3,
            samples_per_period=1,
        )
        times = np.concatenate([first.impacts.time, second.impacts.time + 1.0])
        assert len(times) == len(whole.impacts.time) >= 1
        # 4 roundings of the time, and of the place over the speed there
        slowest = np.abs(whole.impacts.velocity).min()
        np.testing.assert_allclose(times, whole.impacts.time, rtol=0, atol=4 * EPSILON * (4.0 + speed / slowest))
        np.testing.assert_array_equal(np.concatenate([first.impacts.stop, second.impacts.stop]), whole.impacts.stop)


@pytest.mark.parametrize("seed", [1, 5, 9, 12, 22])
def test_the_end_is_that_of_50_digits(seed: int) -> None:
    oscillator, omega, clearance = sticking_case(seed)
    size = oscillator.size
    for phase in (0.0, 2.7):
        run = runs(oscillator, omega, clearance, phase)
        final = run(None, 1).final
        assert final is not None
        exact = GeneralOracle.between(oscillator, omega, clearance, phase=phase)
        with digits():
            x, v, _ = exact.at(2 * arb.pi() / arb(omega))
        # as large as the end answers to a change of the start, and of every number given, by some roundings
        scale = np.zeros(2 * size)
        for i in range(2 * size):
            start = np.zeros(2 * size)
            start[i] = 1e-9 * clearance * (1.0 if i < size else omega)
            moved = run(State(start[:size], start[size:], phase), 1).final
            assert moved is not None
            change = np.concatenate([moved.displacement - final.displacement, moved.velocity - final.velocity])
            scale += np.abs(change) / 1e-9
        whole = run(None, 1)
        reach = np.concatenate([np.abs(whole.displacement).max(axis=1), np.abs(whole.velocity).max(axis=1)])
        bound = 64 * EPSILON * (scale + reach)
        ends = zip([*x, *v], [*final.displacement, *final.velocity], strict=True)
        with digits():
            error = np.array([abs(float(e - arb(float(f)))) for e, f in ends])
        assert np.all(error <= bound)


def test_round_off_does_not_move_the_final_state_beyond_a_stop() -> None:
    forced = forced_oscillator(DEFAULT, 0.29, 1.6)
    rng = np.random.default_rng(0)
    beyond = 0
    for _ in range(50):
        v = rng.uniform(-1.0, 1.0, 3)
        begun = start(forced, State(np.array([1.6, *rng.uniform(-2.0, 2.0, 2)]), np.array([-abs(v[0]), *v[1:]]), 0.3))
        begun.run.cursor[ANCHOR] = 0  # as on the way to a stop: the place comes from the blocks alone
        raw = float((begun.forced.held.from_free @ begun.run.u.ravel())[0] + begun.steady[0, 0, 0].imag)
        beyond += raw > 1.6
        assert state_at(forced, begun.stops, begun.run, 0.3).displacement[0] == min(raw, 1.6)
    assert beyond > 0


def test_the_phase_of_the_end_is_wrapped_and_exact_where_it_was_in_range() -> None:
    for phase in (0.0, 0.3, -math.pi, math.pi, 3.0):
        final = trajectory(DEFAULT, 0.29, 1.6, phase=phase, periods=1).final
        assert final is not None
        assert final.phase == phase
    for phase in (4.0, -3.2, 1e3, -1e9, 1e15):
        with mp.workdps(40):
            plain = mp.mpf(phase) - 2 * mp.pi * mp.nint(mp.mpf(phase) / (2 * mp.pi))
        assert wrapped(phase) == pytest.approx(float(plain), rel=4 * EPSILON)


@pytest.mark.thorough
def test_a_trajectory_with_too_many_impacts_ends_after_its_last_impact() -> None:
    ball = Oscillator.create([1.0], [1e-13], 0.0, [1.0], 1.0)
    result = trajectory(ball, 1e-3, 1.0, np.array([1.0]), np.array([-1e-5]), math.pi / 2, samples_per_period=1)
    assert (result.motion.reason or "").startswith("too many impacts")
    final = result.final
    assert final is not None
    assert (final.displacement[0], final.velocity[0]) == (1.0, -result.impacts.velocity[-1])
    with mp.workdps(40):
        angle = math.pi / 2 + mp.mpf(1e-3) * mp.mpf(result.impacts.phase_time[-1])
    assert final.phase == pytest.approx(float(angle), rel=4 * EPSILON)
    # bounces of 2 v under a unit force go on
    again = trajectory(ball, 1e-3, 1.0, final.displacement, final.velocity, final.phase, samples_per_period=1)
    assert again.impacts.time[0] == pytest.approx(2 * abs(final.velocity[0]), rel=1e-3)


def test_a_trajectory_that_ended_before_its_record_has_no_end_in_it() -> None:
    oscillator = Oscillator.create([1.0, 1.0], [1.0, 1.0], 0.0, [5.0, 1.0], 0.5)
    x = np.array([0.1, 0.0])
    result = trajectory(oscillator, math.sqrt(2.0), 0.1, x, np.zeros(2), phase=math.pi / 2, periods=2)
    assert result.motion.kind == "unresolved"
    assert "resonance" in (result.motion.reason or "")
    assert result.final is None
    assert len(result.time) == 0
    with pytest.raises(ValueError, match="times"):
        result.at(np.array([0.0]))
