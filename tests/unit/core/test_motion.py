"""Naming motions: planted orbits that must, and must not, be named; and the unfolding map."""

import numpy as np
import pytest

from grazemap_core import codes
from grazemap_core.contact.kernels.runs import MIN_UNPRESSED_SPEED, new_run
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels import period_detection
from grazemap_core.simulation.motion import KINDS, REASONS
from grazemap_core.simulation.start import forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST


def first_named(orbit_point, impacts, halves: int, max_period: int = 32):  # type: ignore[no-untyped-def]
    """Record a planted half-period orbit until its period is detected; return the result, and when."""
    forced = forced_oscillator(DEFAULT, 0.29, 1.6)
    problem = forced.structure.kernels.free
    ring, run = period_detection.stroboscopic_history(3, max_period), new_run(3, 1)
    for k in range(halves):
        run.u[:] = (1 if k % 2 == 0 else -1) * orbit_point(k)
        run.tally[:3] = impacts(k)
        run.tally[MIN_UNPRESSED_SPEED] = run.tally[2]
        period_detection.record_half_period(ring, k, run)
        outcome = period_detection.detect_period(problem, forced.stops, ring, 0, k, max_period, k, 1.6)
        if outcome[0] == codes.RESOLVED:
            return outcome, k
    return outcome, None


def spread(rng: np.random.Generator, m: int) -> np.ndarray:
    return rng.uniform(-1, 1, (m, 3, 2))


@pytest.mark.parametrize("m", [1, 2, 3, 4, 6, 7, 12, 31, 64])
@pytest.mark.parametrize("rate", [0.5, -0.5, 0.9])
def test_planted_orbits_get_their_minimum_period(m: int, rate: float) -> None:
    rng = np.random.default_rng(m)
    points, away = spread(rng, m), spread(rng, 1)[0]
    # one impact per half period, on stop A in even halves and on C in odd ones
    outcome, k = first_named(
        lambda k: points[k % m] + away * abs(rate) ** (k / m) * (np.sign(rate) ** (k // m)),
        lambda k: (1.0, 0.0, 0.3) if k % 2 == 1 else (0.0, 1.0, 0.3),
        halves=30_000,
    )
    assert k is not None
    _, period, right, left, symmetric, least, _ = outcome
    assert period == (m if m % 2 else m // 2)
    assert symmetric == (m % 2 == 1)
    assert (right, left) == (period, period)
    assert least == 0.3


def test_the_impacts_on_either_stop_are_told_apart() -> None:
    points = spread(np.random.default_rng(5), 2)
    outcome, k = first_named(lambda k: points[k % 2], lambda k: (1.0, float(k % 2), 0.3), halves=500)
    assert k is not None
    assert outcome[:5] == (codes.RESOLVED, 1, 2, 1, False)


def test_slow_alternating_convergence_is_not_taken_for_a_doubled_period() -> None:
    rng = np.random.default_rng(1)
    point, away = spread(rng, 1)[0], spread(rng, 1)[0]
    for rate in (-0.9, -0.99, -0.997):
        outcome, k = first_named(lambda k, r=rate: point + away * r**k, lambda k: (1.0, 1.0, 0.3), halves=20_000)
        assert k is not None
        assert (outcome[1], outcome[4]) == (1, True)


def test_a_slow_drift_that_resembles_closing_is_not_named() -> None:
    point, away = np.ones((3, 2)), np.full((3, 2), 1e-10)
    outcome, k = first_named(lambda k: point + away * k, lambda k: (1.0, 1.0, 0.3), halves=500)
    assert k is None
    assert outcome[0] == codes.SLOW_CONVERGENCE


def test_an_orbit_whose_impacts_do_not_repeat_is_not_named() -> None:
    point = np.ones((3, 2))
    _, k = first_named(lambda k: point, lambda k: (float(k % 5), 1.0, 0.3), halves=200)
    assert k is None


def test_an_orbit_with_a_graze_is_not_named() -> None:
    point = np.ones((3, 2))
    outcome, k = first_named(lambda k: point, lambda k: (1.0, 1.0, 1e-7), halves=200)
    assert k is None
    assert outcome[0] == codes.NEAR_GRAZING


def test_periods_beyond_the_longest_are_not_named() -> None:
    points = spread(np.random.default_rng(5), 9)
    for m, named in ((7, True), (9, False)):
        _, k = first_named(lambda k, m=m: points[k % m], lambda k: (1.0, 1.0, 0.3), halves=400, max_period=8)
        assert (k is not None) == named


def test_map_agrees_with_single_trajectories_and_with_any_tiling() -> None:
    omega, clearance = np.linspace(0.26, 0.30, 6), np.linspace(1.4, 2.0, 7)
    whole = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance), MapSettings(max_periods=300))
    for name, array in whole.items():
        parts = [
            [
                unfolding_map_tile(Plane.of(DEFAULT, omega[j : j + 2], clearance[i : i + 3]), MapSettings(300))[name]
                for j in (0, 2, 4)
            ]
            for i in (0, 3, 6)
        ]
        assert np.block(parts).tobytes() == array.tobytes(), name
    for i, j in ((0, 0), (3, 2), (6, 5), (5, 4)):
        if KINDS[whole["kind"][i, j]] == "periodic":
            motion = trajectory(DEFAULT, omega[j], clearance[i], periods=300, samples_per_period=1).motion
            assert motion.period == whole["period"][i, j]
            assert motion.impacts_right == whole["impacts_right"][i, j]
            assert motion.impacts_left == whole["impacts_left"][i, j]


def test_unresolved_points_have_a_reason_and_no_numbers() -> None:
    result = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.29]), np.array([1.6])), MapSettings(max_periods=3))
    assert KINDS[result["kind"][0, 0]] == "unresolved"
    assert REASONS[result["reason"][0, 0]]
    assert result["period"][0, 0] == 0
    assert result["settled_after"][0, 0] == -1


@pytest.mark.thorough  # ten million impacts, and the kernels for one mass
def test_an_elastic_mass_between_close_stops_ends_with_too_many_impacts() -> None:
    elastic = Oscillator.create([1.0], [1.0], 0.0, [0.7], 1.0)
    result = unfolding_map_tile(Plane.of(elastic, np.array([0.3]), np.array([1e-3])), MapSettings(max_periods=100_000))
    assert REASONS[result["reason"][0, 0]].startswith("too many impacts")


@KERNELS_FIRST
@pytest.mark.parametrize(("omega", "clearance", "restitution", "gamma"), [
    # one mass: the return after two halves passes a turning point while that after one still falls
    (3.3736033316809624, 0.12725729995235208, 0.9557123296340648, 0.0011475639376374556),
    (3.3495614417232487, 0.12752353622824484, 0.8771692715348258, 0.022179725385727687),
    (0.8531689121777564, 1.1881504982214424, 0.9899980539650735, 0.000371274722242579),
])  # fmt: skip
def test_nearly_equal_multipliers_do_not_reduce_the_estimated_distance(
    omega: float, clearance: float, restitution: float, gamma: float
) -> None:
    oscillator = Oscillator.create([1.0], [1.0], gamma, [1.0], restitution)
    column = np.array([clearance])
    early = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), column))
    late = trajectory(oscillator, omega, clearance, transient_periods=6000, periods=4, samples_per_period=1).motion
    if KINDS[early["kind"][0, 0]] == "periodic":
        named = (early["period"][0, 0], early["impacts_right"][0, 0], early["impacts_left"][0, 0])
        assert named == (late.period, late.impacts_right, late.impacts_left)
        assert early["symmetric"][0, 0] == late.symmetric


def test_a_planted_spiral_between_two_equal_negative_multipliers_gets_its_minimum_period() -> None:
    point = np.ones((3, 2))
    first, second = spread(np.random.default_rng(9), 2)
    for rate in (0.97, 0.99):
        # nearly equal negative rates: the difference of two decays grows before it falls
        outcome, k = first_named(
            lambda k, r=rate: point + (-r) ** k * (first * (1.0 - 0.004 * k) + second * 1e-3),
            lambda k: (1.0, 1.0, 0.3),
            halves=20_000,
        )
        assert k is not None
        assert (outcome[1], outcome[4]) == (1, True)
