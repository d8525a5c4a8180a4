"""Samples at any time of a record, in closed form: against 50 digits, and the same however they are asked for."""

import math

import mpmath as mp
import numpy as np
import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.recorded_run import split_times
from grazemap_core.simulation.trajectories import trajectory
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.impact_accuracy import random_point
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import sticking_case


@settings(max_examples=200, deadline=None)
@given(
    omega=st.floats(1e-3, 1e3), periods=st.floats(0.0, 1e6), low=st.sampled_from([0.0, 1e-15, -1e-15, 1e-9, 0.5, 1 / 3])
)
def test_a_time_keeps_its_digits_within_its_period(omega: float, periods: float, low: float) -> None:
    for time in (periods * 2 * math.pi / omega, abs(round(periods) + low) * (2 * math.pi / omega)):
        whole, within = split_times(np.array([time]), omega)
        with mp.workdps(50):
            period = 2 * mp.pi / mp.mpf(omega)
            error = abs(mp.mpf(time) - int(whole[0]) * period - mp.mpf(float(within[0])))
            assert -1e-9 * period < within[0] < period * (1 + mp.mpf(10) ** -9)
        # roundings of the result, and the second order of those of a long time
        assert error <= 2 * EPSILON * abs(within[0]) + 8 * EPSILON**2 * time


@pytest.mark.parametrize(
    ("case", "seed"), [("free", seed) for seed in range(5)] + [("rest", 5), ("rest", 9), ("rest", 24)]
)
def test_samples_at_any_time_are_those_of_50_digits(case: str, seed: int) -> None:
    oscillator, omega, clearance = random_point(seed) if case == "free" else sticking_case(seed)
    size, period = oscillator.size, 2 * math.pi / omega
    times = np.sort(np.random.default_rng(seed).uniform(0.0, 2 * period, 12))
    run = trajectory(oscillator, omega, clearance, phase=0.4, periods=2)
    x, v = run.at(times)
    # how the samples answer to a change of the start, coordinate by coordinate
    scale = np.abs(np.concatenate([x, v]))
    for i in range(2 * size):
        start = np.zeros(2 * size)
        start[i] = 1e-9 * clearance * (1.0 if i < size else omega)
        moved = trajectory(oscillator, omega, clearance, start[:size], start[size:], 0.4, periods=2).at(times)
        scale += np.abs(np.concatenate(moved) - np.concatenate([x, v])) / 1e-9
    scale += np.concatenate([np.full((size, 1), clearance), np.full((size, 1), omega * clearance)])
    oracle = GeneralOracle.between(oscillator, omega, clearance, phase=0.4)
    resting = 0
    for n, time in enumerate(times):
        with digits():
            places, speeds, _ = oracle.at(arb(float(time)))
            pairs = zip([*places, *speeds], [*x[:, n], *v[:, n]], strict=True)
            error = [abs(float(e - arb(float(f)))) for e, f in pairs]
        assert np.all(error <= 128 * EPSILON * scale[:, n])
        resting += abs(x[0, n]) == clearance
    assert (resting > 0) == (case == "rest")


def test_samples_at_the_times_of_even_samples_equal_the_even_samples() -> None:
    for oscillator, omega, clearance in (random_point(3), sticking_case(9)):
        run = trajectory(oscillator, omega, clearance, periods=3, transient_periods=4, samples_per_period=32)
        x, v = run.at(run.time)
        # a listed time is rounded, which moves a sample by its speed times that
        speed = np.abs(run.velocity).max() + omega * np.abs(run.displacement).max()
        rounding = 8 * EPSILON * (np.abs(run.displacement).max() + speed * run.time[-1])
        np.testing.assert_allclose(x, run.displacement, rtol=0, atol=rounding)
        change = np.abs(np.diff(run.velocity)).max() / (run.time[1] - run.time[0])
        np.testing.assert_allclose(v, run.velocity, rtol=0, atol=8 * EPSILON * (speed + change * run.time[-1]))


def test_a_sample_at_the_listed_time_of_an_impact_is_after_it() -> None:
    run = trajectory(DEFAULT, 0.29, 1.6, periods=200, samples_per_period=1)
    x, v = run.at(run.impacts.time)
    late = run.impacts.time[-1]
    # the listed time of a late impact is rounded
    np.testing.assert_allclose(x[0], 1.6 * run.impacts.stop, rtol=0, atol=EPSILON * late * np.abs(v[0]).max())
    np.testing.assert_allclose(v[0], -0.8 * run.impacts.velocity, rtol=0, atol=1e-13 + EPSILON * late)
    before = run.at(np.nextafter(np.nextafter(run.impacts.time, 0.0), 0.0))[1]
    np.testing.assert_allclose(before[0], run.impacts.velocity, rtol=0, atol=1e-13 + 3 * EPSILON * late)


def test_requested_times_give_samples_there_and_change_nothing_else() -> None:
    times = np.array([0.0, 0.1, 17.3, 2 * 2 * math.pi / 0.29])
    asked = trajectory(DEFAULT, 0.29, 1.6, periods=2, transient_periods=3, times=times)
    plain = trajectory(DEFAULT, 0.29, 1.6, periods=2, transient_periods=3)
    np.testing.assert_array_equal(asked.time, times)
    np.testing.assert_array_equal(asked.displacement, plain.at(times)[0])
    np.testing.assert_array_equal(asked.velocity, plain.at(times)[1])
    np.testing.assert_array_equal(asked.impacts.time, plain.impacts.time)
    assert asked.final is not None
    assert plain.final is not None
    np.testing.assert_array_equal(asked.final.displacement, plain.final.displacement)
    # the order does not matter to one that is there already
    np.testing.assert_array_equal(plain.at(times[::-1])[0], asked.displacement[:, ::-1])
    assert plain.at(np.zeros(0))[0].shape == (3, 0)


def test_times_after_an_early_end_are_left_out() -> None:
    # it rests on a stop after bounces, and mass 2 is then at an undamped resonance
    place = Oscillator.create([1.0, 1.0], [1.0, 1.0], 0.0, [5.0, 1.0], 0.5), math.sqrt(2.0), 0.1
    end = trajectory(*place, phase=math.pi / 2).record.end
    assert 0.0 < end < 2 * math.pi / place[1]
    run = trajectory(*place, phase=math.pi / 2, times=np.array([0.0, 0.5 * end, end, 2 * end]))
    np.testing.assert_array_equal(run.time, [0.0, 0.5 * end, end])
    assert run.displacement.shape == (2, 3)
    with pytest.raises(ParameterError, match="times"):
        run.at(np.array([2 * end]))


@pytest.mark.parametrize("times", [[-1e-9], [0.0, math.nan], [43.4], [math.inf], [[0.0]], 3.0])
def test_times_outside_the_record_are_refused(times: object) -> None:
    with pytest.raises(ParameterError, match="times"):
        trajectory(DEFAULT, 0.29, 1.6, periods=2, times=np.array(times))
    with pytest.raises(ParameterError, match="times"):
        trajectory(DEFAULT, 0.29, 1.6, periods=2).at(np.array(times))
