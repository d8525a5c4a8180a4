"""Motions at a resonance without damping, or with hardly any, and beside one."""

from __future__ import annotations

import math

import mpmath as mp
import numpy as np
import pytest
from flint import arb

from grazemap_core.maps.basins import Coordinate, basin_tile
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.kernels.block_flow import response_from_rest
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.trajectories import trajectory
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.steady_displacements import contact_amplitude
from tests.slow.resonance import compare, exact_impacts, random_case
from tests.support.thorough import KERNELS_FIRST, the_first

UNDAMPED = Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.8)
# the second of its frequencies is 1 as well
CHAIN = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.0, [1.0, 0.0, 0.0], 0.8)
OMEGAS = (1.0, 1.0 + 1e-13, 1.0 + 1e-9, 1.1)


@pytest.mark.parametrize("decay", [0.0, 1e-12, 1e-3, 0.3])
@pytest.mark.parametrize("offset", [0.0, 1e-15, 1e-9, -1e-4, 0.1, -0.9])
def test_the_response_from_rest_is_accurate_at_any_distance_from_resonance(decay: float, offset: float) -> None:
    discriminant, omega = 1.3, math.sqrt(1.3) + offset
    for t in (1e-3, 0.7, 3.0, 40.0):
        with mp.workdps(50):
            z = mp.mpc(-decay, mp.sqrt(mp.mpf(discriminant)))
            w = mp.mpc(0, omega)
            near, far = ((mp.exp(w * t) - mp.exp(y * t)) / (w - y) for y in (z, mp.conj(z)))
            exact = (near - far) / (z - mp.conj(z)), (z * near - mp.conj(z) * far) / (z - mp.conj(z))
        for response, value in zip(response_from_rest(decay, discriminant, omega, t), exact, strict=True):
            assert abs(response - complex(value)) <= 1e-15 * (1.0 + t) * t


# one mass at resonance; three masses that grow apart; three masses, all impacts predictable
@pytest.mark.parametrize("lockstep", [False, pytest.param(True, marks=KERNELS_FIRST)])
@pytest.mark.parametrize("seed", [pytest.param(0, marks=KERNELS_FIRST), *the_first(1, [2, 44])])
def test_impacts_are_those_of_sixty_digits(seed: int, lockstep: bool) -> None:
    case = random_case(seed)
    outcome = compare(case, lockstep, *exact_impacts(case))
    assert (outcome.wrong, outcome.grazes) == (0, 0)
    assert outcome.compared >= 30


@pytest.mark.parametrize("omega", OMEGAS)
def test_mass_one_stays_between_the_stops(omega: float) -> None:
    result = trajectory(UNDAMPED, omega, 1.0, periods=50, samples_per_period=64)
    assert np.max(np.abs(result.displacement)) <= 1.0 + 1e-14
    assert result.undecided == 0
    assert result.motion.kind == "periodic"


def test_free_motion_at_resonance_grows_as_in_the_closed_form_and_can_be_continued() -> None:
    # from rest (sin t - t cos t)/2
    whole = trajectory(UNDAMPED, 1.0, 1e6, periods=50, samples_per_period=32)
    t = 2.0 * np.pi / 32 * np.arange(50 * 32 + 1)
    s, c = np.sin(2.0 * np.pi / 32 * (np.arange(len(t)) % 32)), np.cos(2.0 * np.pi / 32 * (np.arange(len(t)) % 32))
    rounding = 1e-15 + EPSILON * t**2  # the rounding of the time, with the speed t/2
    assert np.all(np.abs(whole.displacement[0] - (s - t * c) / 2.0) <= rounding)
    assert np.all(np.abs(whole.velocity[0] - t * s / 2.0) <= rounding)
    first = trajectory(UNDAMPED, 1.0, 1e6, periods=20, samples_per_period=1).final
    assert first is not None
    later = trajectory(UNDAMPED, 1.0, 1e6, first.displacement, first.velocity, first.phase, 30, samples_per_period=32)
    assert np.all(np.abs(later.displacement[0] - whole.displacement[0, 20 * 32 :]) <= 2.0 * rounding[20 * 32 :])


@pytest.mark.parametrize("damping", [0.0, 1e-12, [1e-12, 3e-12, 0.0]])
def test_samples_agree_with_fifty_digits(damping: float | list[float]) -> None:
    oscillator = Oscillator.create([1.0, 2.0, 1.5], [1.0, 1.5, 0.7], damping, [1.0, 0.3, 0.2], 0.7)
    omega = math.sqrt(modal_model(oscillator).frequency_squared[1])
    run = trajectory(oscillator, omega, 0.7, periods=4, samples_per_period=8)
    exact = GeneralOracle.between(oscillator, omega, 0.7)
    with digits():
        x, v, _ = exact.at(13 * arb.pi() / (4 * arb(omega)))
        assert len(exact.times) > 0
        errors = [
            abs(float(a - arb(float(b))))
            for a, b in zip([*x, *v], [*run.displacement[:, 13], *run.velocity[:, 13]], strict=True)
        ]
    assert max(errors) <= 1e-13


@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_rests_and_releases_at_resonance(restitution: float) -> None:
    oscillator = Oscillator.create([1.0, 2.0], [1.0, 1.5], 0.0, [1.0, 0.3], restitution)
    omega = math.sqrt(modal_model(oscillator).frequency_squared[0])
    run = trajectory(oscillator, omega, 0.4, periods=6, samples_per_period=1)
    exact = GeneralOracle.between(oscillator, omega, 0.4)
    exact.run(until=float(run.time[-1]), releases=4)
    assert len(exact.releases) >= 3
    count = min(len(exact.releases), len(run.sticking.start))
    assert count >= 3
    with digits():
        for k in range(count):
            assert abs(float(exact.rests[k] - arb(run.sticking.start[k]))) <= 1e-11
            assert abs(float(exact.releases[k] - arb(run.sticking.stop_time[k]))) <= 1e-11


@pytest.mark.parametrize(
    ("oscillator", "clearances", "max_periods"),
    [
        (CHAIN, [1.0, 1.7], 3000),
        pytest.param(UNDAMPED, [0.5, 1.0, 1.7], 300, marks=KERNELS_FIRST),
    ],
    ids=["three masses", "one mass"],
)
def test_maps_and_basins_are_continuous_through_a_resonance(
    oscillator: Oscillator, clearances: list[float], max_periods: int
) -> None:
    arrays = unfolding_map_tile(
        Plane.of(oscillator, np.array(OMEGAS[:3]), np.array(clearances)), MapSettings(max_periods)
    )
    assert np.all(arrays["kind"] == 1)
    for name in ("period", "impacts_right", "impacts_left", "symmetric"):
        assert np.all(arrays[name] == arrays[name][:, :1])
    np.testing.assert_allclose(arrays["multiplier"], arrays["multiplier"][:, :1] + np.zeros(3), rtol=1e-3)
    basin = basin_tile(
        oscillator,
        1.0,
        1.0,
        Coordinate("displacement", 1, np.array([-0.5, 0.5])),
        Coordinate("velocity", 1, np.array([-0.5, 0.5])),
        max_periods=max_periods,
    )
    assert np.all(basin["kind"] == 1)


def test_volumes_shrink_by_the_restitution_alone() -> None:
    orbit = monodromy(UNDAMPED, 1.0, 1.0, max_periods=300)
    assert orbit.closing < 1e-12
    assert np.linalg.det(orbit.matrix) == pytest.approx(0.8**4, rel=1e-11)


@KERNELS_FIRST
def test_with_little_damping_the_steady_motion_is_known_and_other_orbits_are_verified() -> None:
    oscillator = Oscillator.create([1.0], [1.0], 1e-3, [1.0], 0.8)
    amplitude = contact_amplitude(oscillator, 1.0)
    clearances = np.array([1.0, 0.935 * amplitude, 2.5 * amplitude])
    arrays = unfolding_map_tile(Plane.of(oscillator, np.array([1.0]), clearances), MapSettings(max_periods=3000))
    assert np.all(arrays["kind"] == 1)
    assert np.all(arrays["verified"])
    assert arrays["impacts_right"][:, 0].tolist() == [1, 1, -1]
    # on the way to some of these motions impacts are so slow that the error of the long transient may decide them
    more = unfolding_map_tile(
        Plane.of(oscillator, np.array([1.0]), amplitude * np.linspace(0.88, 0.95, 12)), MapSettings(max_periods=3000)
    )
    assert np.all(more["verified"] | (more["reason"] > 0))
    assert np.any(more["sensitive"])
    # the rate at which all free motions decay
    assert arrays["lyapunov"][2, 0] == pytest.approx(-2.0 * math.pi * 1e-3, rel=1e-12)
    assert trajectory(oscillator, 1.0, float(clearances[2]), periods=1).motion.impacts_right == -1
