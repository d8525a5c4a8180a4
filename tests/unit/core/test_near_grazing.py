"""Near-grazing first impacts of chains and other structures, and grazes that round-off hides."""

import math

import numpy as np
import pytest

from grazemap_core.codes import NEAR_GRAZING
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.fifty_digits import Chain, digits, steady_amplitude
from tests.oracles.near_grazing import OVERSHOOTS, first_impacts, outcome_of, passage
from tests.oracles.steady_displacements import steady_response
from tests.slow.general_checks.near_grazing import SYSTEMS
from tests.support.oscillators import DEFAULT
from tests.support.thorough import the_first


def phases_of(oscillator: Oscillator, omegas: np.ndarray, overshoots: tuple[float, ...]) -> np.ndarray:
    """Phase from x1 = 0 on to the first impact, NaN where there is none within a period, shape (omegas, overshoots).

    The start is on the steady motion where mass 1 passes the middle, x1 = A sin(phase); the clearance is
    A (1 - overshoot).
    """
    phases = []
    for omega in omegas.tolist():
        response = steady_response(oscillator, np.array([omega]))[0, 0]
        clearances = [float(abs(response) * (1.0 - overshoot)) for overshoot in overshoots]
        phases.append(first_impacts(oscillator, omega, -math.atan2(response.imag, response.real), clearances))
    return np.array(phases)


@pytest.mark.parametrize(("masses", "stiffnesses", "damping"), the_first(1, [
    ([1.0, 0.6, 2.0, 1.3], [1.0, 2.0, 0.7, 1.1], [0.05, 0.3, 0.02, 0.1]),
    ([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05),
    ([1.0], [1.0], 0.1),
]))  # fmt: skip
@pytest.mark.parametrize("frequencies", [300, pytest.param(1000, marks=pytest.mark.thorough)])
def test_no_near_grazing_impact_is_missed_and_no_false_one_is_found(
    masses: list[float], stiffnesses: list[float], damping: float | list[float], frequencies: int
) -> None:
    count = len(masses)
    oscillator = Oscillator.create(masses, stiffnesses, damping, [1.0, *[0.0] * (count - 1)], 0.8)
    omegas = np.random.default_rng(7).uniform(0.2, 1.5, frequencies)
    above = phases_of(oscillator, omegas, tuple(-overshoot for overshoot in OVERSHOOTS))
    assert np.all(np.isnan(above))
    below = phases_of(oscillator, omegas, OVERSHOOTS)
    assert not np.any(np.isnan(below))
    # the phase moves by the change of the amplitude over the slope there; a rounding or two are allowed
    expected = np.arcsin(1.0 - np.array(OVERSHOOTS))
    assert np.all(np.abs(below - expected) < 1e-15 / np.sqrt(2.0 * np.array(OVERSHOOTS)))
    # the amplitude that all of this is measured from, to far less than the smallest overshoot
    chain = Chain(masses, stiffnesses, oscillator.link_damping.tolist(), oscillator.forcing.tolist())
    for omega in omegas[:: frequencies // 10]:
        with digits():
            exact = abs(steady_amplitude(chain, float(omega)))
            assert abs(float(abs(steady_response(oscillator, np.array([omega]))[0, 0]) / exact - 1)) < 1e-15


@pytest.mark.parametrize("name", SYSTEMS)
def test_no_near_grazing_impact_of_a_general_system_is_missed(name: str) -> None:
    system = SYSTEMS[name]
    grazes = [passage(system.oscillator, omega, system.stop) for omega in system.omegas(20)]
    outcomes = [outcome_of(graze, other=k % 2 == 0) for k, graze in enumerate(grazes) if graze is not None]
    assert len(outcomes) >= 12
    assert (sum(outcome.missed for outcome in outcomes), sum(outcome.false for outcome in outcomes)) == (0, 0)
    assert max(outcome.error for outcome in outcomes) < 1.0


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
