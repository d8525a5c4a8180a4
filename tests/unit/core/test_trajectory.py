"""Trajectories against an independent 40-digit simulation, and limiting cases that must have a defined result."""

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

from grazemap_core.codes import TOO_MANY_IMPACTS
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.trajectories import Trajectory, trajectory
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.impact_accuracy import compare, random_point
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import the_first

oracle = GeneralOracle.between


def test_reference_trajectory_has_every_impact_of_the_40_digit_simulation() -> None:
    result = trajectory(DEFAULT, 0.29, 1.6, periods=200)
    exact = oracle(DEFAULT, 0.29, 1.6)
    exact.run(798)
    assert len(result.impacts.time) == 798
    np.testing.assert_array_equal(result.impacts.stop, exact.stops)
    with digits():
        period = 2 * arb.pi() / arb(0.29)
        errors = np.array(
            [
                float(int(k) * period + arb(t) - e)
                for k, t, e in zip(result.impacts.period, result.impacts.phase_time, exact.times, strict=True)
            ]
        )
    assert np.abs(errors).max() < 1e-13 * 2 * math.pi / 0.29
    assert np.abs(errors[:20]).max() < 5e-14
    np.testing.assert_allclose(result.impacts.time, [float(t) for t in exact.times], rtol=3 * EPSILON, atol=5e-14)
    np.testing.assert_allclose(result.impacts.velocity, [float(v) for v in exact.speeds], rtol=0, atol=1e-13)
    motion = result.motion
    assert (motion.kind, motion.period, motion.impacts_right, motion.impacts_left) == ("periodic", 1, 2, 2)
    assert motion.symmetric


@pytest.mark.parametrize("seed", the_first(2, range(50)))
def test_random_chains_have_the_impacts_of_the_40_digit_simulation_to_a_few_roundings_of_the_inputs(seed: int) -> None:
    accuracy = compare(*random_point(seed))
    assert accuracy.complete
    assert accuracy.worst < 8 * EPSILON, accuracy.error / accuracy.amplification


def test_samples_are_exact_between_and_after_impacts() -> None:
    result = trajectory(DEFAULT, 0.29, 1.6, periods=3, samples_per_period=16)
    exact = oracle(DEFAULT, 0.29, 1.6)
    for index in (0, 5, 11, 14, 23, 40):
        time = float(result.time[index])
        x, v, _ = exact.at(time)
        np.testing.assert_allclose(result.displacement[:, index], [float(a) for a in x], rtol=0, atol=2e-13)
        np.testing.assert_allclose(result.velocity[:, index], [float(a) for a in v], rtol=0, atol=2e-13)


def energy(oscillator: Oscillator, result: Trajectory) -> np.ndarray:
    """Kinetic and potential energy of every sample."""
    kinetic = np.einsum("in,ij,jn->n", result.velocity, oscillator.mass_matrix, result.velocity)
    return 0.5 * (
        kinetic + np.einsum("in,ij,jn->n", result.displacement, oscillator.stiffness_matrix, result.displacement)
    )


@settings(max_examples=60, deadline=None)
@given(
    chain=st.sampled_from([([1.0], [1.0]), ([1.0, 2.0], [1.0, 3.0]), ([0.7, 3.0, 1.1], [2.0, 0.4, 1.0])]),
    x=st.floats(-1.0, 1.0),
    v=st.floats(-3, 3),
    others=st.floats(-1.0, 1.0),
    damping=st.just(0.0) | st.floats(1e-6, 0.4) | st.floats(1.0, 3.0),
    link_by_link=st.booleans(),
    restitution=st.just(0.0) | st.just(1.0) | st.floats(0.0, 1.0),
)
def test_energy_never_rises_without_forcing(
    chain: tuple[list[float], list[float]],
    x: float,
    v: float,
    others: float,
    damping: float,
    link_by_link: bool,
    restitution: float,
) -> None:
    masses, stiffnesses = chain
    count = len(masses)
    dampings = [damping / (1.0 + i) for i in range(count)] if link_by_link else damping
    oscillator = Oscillator.create(masses, stiffnesses, dampings, [0.0] * count, restitution)
    start = np.full(count, others), np.full(count, -others)
    start[0][0], start[1][0] = x, v
    result = trajectory(oscillator, 1.0, 1.0, *start, periods=5, samples_per_period=64)
    # an elastic contact that is pressed on its stop at next to no speed has impacts without end
    stuck = restitution > 0.9 and result.motion.reason == REASONS[TOO_MANY_IMPACTS]
    assert stuck or len(result.time) == 5 * 64 + 1
    level = energy(oscillator, result)
    # squares below the normal numbers have absolute roundings
    assert np.all(np.diff(level) <= 1e-14 * level[0] + np.finfo(float).tiny)


@pytest.mark.parametrize(("masses", "stiffnesses", "x", "v"), [
    ([1.0], [1.0], [0.3], [1.5]),
    ([1.3], [1.7], [0.3], [1.7]),
    ([1.0, 2.0], [1.0, 3.0], [0.2, 0.3], [2.0, -0.7]),
    ([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], [0.3, 0.1, -0.4], [1.0, 0.4, 0.8]),
])  # fmt: skip
def test_ten_thousand_elastic_impacts_keep_the_energy(
    masses: list[float], stiffnesses: list[float], x: list[float], v: list[float]
) -> None:
    free = Oscillator.create(masses, stiffnesses, 0.0, [0.0] * len(masses), 1.0)
    # the forcing frequency only sets the length of the cells here: with the smaller one many lie between two impacts
    for omega, periods in ((0.5, 2500), (4.0, 20000)):
        result = trajectory(
            free, omega, 1.0, np.array(x), np.array(v), periods=periods, samples_per_period=1, max_period=1
        )
        assert len(result.impacts.time) > 10_000
        level = energy(free, result)
        assert np.abs(level / level[0] - 1.0).max() < 1e-12


def test_a_large_phase_is_the_phase_that_it_is_modulo_a_turn() -> None:
    for phase in (1e3, 1e9, 1e15):
        with mp.workdps(40):
            plain = float(mp.fmod(mp.mpf(phase), 2 * mp.pi))
        run = trajectory(DEFAULT, 0.29, 1.6, phase=phase, periods=3)
        other = trajectory(DEFAULT, 0.29, 1.6, phase=plain, periods=3)
        np.testing.assert_allclose(run.impacts.time, other.impacts.time, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("displacement", {"displacement": np.array([1.7, 0.0, 0.0])}),
        ("phase", {"phase": math.nan}),
        # too stiff for the frequency
        ("omega", {"oscillator": Oscillator.create([1.0, 1e-9], [1.0, 1e9], 0.05, [1.0, 0.0], 0.8)}),
        *((name, {name: size}) for name in ("omega", "clearance") for size in (1e-70, 1e-250, 1e70, 1e250)),
    ],
)
def test_what_cannot_be_simulated_is_refused_by_name(name: str, changes: dict[str, Any]) -> None:
    with refused(name):
        trajectory(**({"oscillator": DEFAULT, "omega": 0.29, "clearance": 1.6, "periods": 1} | changes))
