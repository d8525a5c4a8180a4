"""Near-grazing first impacts: the steady motion of mass 1 passes a stop by a small fraction of its amplitude."""

import math

import numpy as np
import pytest
from oracles import Chain, digits, steady_amplitude

from grazemap_core.codes import NEAR_GRAZING
from grazemap_core.contact.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.workspace import HALF, OK, ROWS, TIME, UNDECIDED, clear_tally, workspace
from grazemap_core.model.harmonic_response import steady_response
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.trajectories import trajectory

DEFAULT = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)

OVERSHOOTS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-13)


def first_impacts(oscillator: Oscillator, omegas: np.ndarray, overshoots: tuple[float, ...]) -> np.ndarray:
    """Phase of the first impact within a period, NaN where there is none, shape (omegas, overshoots).

    The start is on the steady motion where mass 1 passes the middle, x1 = A sin(phase); the clearance is
    A (1 - overshoot).
    """
    models = trajectory_models(oscillator)
    work = workspace(oscillator.size, events=64)
    phases = np.full((len(omegas), len(overshoots)), np.nan)
    for i, (omega, response) in enumerate(zip(omegas, steady_response(oscillator, omegas), strict=True)):
        phase = -math.atan2(response[0].imag, response[0].real)
        turned = response * np.exp(1j * phase)
        problem, held = cell_problem(models, response, omega, phase)
        start = free_state(models.free, response, omega, turned.imag, omega * turned.real, phase)
        for k, overshoot in enumerate(overshoots):
            u = start.copy()
            work.cursor[:] = 0
            work.tally[UNDECIDED] = 0.0
            clear_tally(work.tally)
            for half in range(2):
                assert run_half(problem, held, u, abs(response[0]) * (1.0 - overshoot), half, work) == OK
            assert work.tally[UNDECIDED] == 0.0
            if work.cursor[ROWS] > 0:
                phases[i, k] = math.pi * work.events[0, HALF] + omega * work.events[0, TIME]
    return phases


@pytest.mark.parametrize(("masses", "stiffnesses", "damping"), [
    ([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05),
    ([1.0], [1.0], 0.1),
    ([1.0, 0.6, 2.0, 1.3], [1.0, 2.0, 0.7, 1.1], [0.05, 0.3, 0.02, 0.1]),
])  # fmt: skip
def test_no_near_grazing_impact_is_missed_and_no_false_one_is_found(
    masses: list[float], stiffnesses: list[float], damping: float | list[float]
) -> None:
    count = len(masses)
    oscillator = Oscillator.create(masses, stiffnesses, damping, [1.0, *[0.0] * (count - 1)], 0.8)
    omegas = np.random.default_rng(7).uniform(0.2, 1.5, 1000)
    above = first_impacts(oscillator, omegas, tuple(-overshoot for overshoot in OVERSHOOTS))
    assert np.all(np.isnan(above))
    below = first_impacts(oscillator, omegas, OVERSHOOTS)
    assert not np.any(np.isnan(below))
    # the phase moves by the change of the amplitude over the slope there; a rounding or two are allowed
    expected = np.arcsin(1.0 - np.array(OVERSHOOTS))
    assert np.all(np.abs(below - expected) < 1e-15 / np.sqrt(2.0 * np.array(OVERSHOOTS)))
    # the amplitude that all of this is measured from, to far less than the smallest overshoot
    chain = Chain(masses, stiffnesses, oscillator.link_damping.tolist(), oscillator.forcing.tolist())
    for omega in omegas[::100]:
        with digits():
            exact = abs(steady_amplitude(chain, float(omega)))
            assert abs(float(abs(steady_response(oscillator, np.array([omega]))[0, 0]) / exact - 1)) < 1e-15


@pytest.mark.parametrize("overshoot", [0.0, 1e-15, -1e-15])
def test_a_graze_within_round_off_is_marked_and_does_not_change_the_motion(overshoot: float) -> None:
    rng = np.random.default_rng(11)
    for omega in rng.uniform(0.2, 1.5, 20):
        response = steady_response(DEFAULT, np.array([omega]))[0]
        phase = -math.atan2(response[0].imag, response[0].real)
        turned = response * np.exp(1j * phase)
        clearance = abs(response[0]) * (1.0 - overshoot)
        result = trajectory(DEFAULT, omega, clearance, turned.imag, omega * turned.real, phase, periods=6)
        period = 2 * math.pi / omega
        # at every quarter and three quarters, to within the time that x1 spends within round-off of the stop
        np.testing.assert_allclose(
            result.impacts.time, (np.arange(12) + 0.5) * 0.5 * period, rtol=0, atol=1e-6 * period
        )
        assert set(result.impacts.kind.tolist()) == {"graze"}
        assert not np.any(result.impacts.velocity)
        np.testing.assert_array_equal(result.impacts.stop, [1, -1] * 6)
        assert result.undecided == 12
        steady = np.imag(turned[:, None] * np.exp(1j * omega * result.time))
        np.testing.assert_allclose(result.displacement, steady, rtol=0, atol=1e-13)
        # no limit can be told apart from one without the graze
        assert result.motion.kind == "unresolved"
        assert result.motion.reason == REASONS[NEAR_GRAZING]
        assert len(result.sticking.start) == 0


def test_an_impact_at_the_boundary_of_two_cells_is_one_impact_and_no_graze() -> None:
    # x = sqrt(2) sin t meets the stop at pi/4, where the second of 16 cells ends, or a few roundings away
    free = Oscillator.create([1.0], [1.0], 0.0, [0.0], 0.5)
    for roundings in range(-40, 41):
        clearance = 1.0 + roundings * 2.0**-52
        result = trajectory(free, 1.0, clearance, velocity=np.array([math.sqrt(2.0)]), periods=1, samples_per_period=1)
        assert result.impacts.time[0] == pytest.approx(math.pi / 4, abs=2e-14)
        assert abs(result.impacts.velocity[0]) == pytest.approx(1.0, abs=2e-14)
        assert set(result.impacts.kind.tolist()) == {"impact"}
        assert result.undecided == 0
