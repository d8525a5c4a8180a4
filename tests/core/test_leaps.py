"""Lanes that are put to where their returns lead: the limit itself, and the motions that are named there."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from grazemap_core.codes import RESOLVED
from grazemap_core.contact.cell_problem import cell_problem, trajectory_models
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.maps.kernels import extrapolated_restart, lane_state
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import begin, lanes
from grazemap_core.maps.settling import Settling, settle_grid
from grazemap_core.model.harmonic_response import forced_response
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.kernels.verification import verification_scratch
from grazemap_core.simulation.kernels import fixed_point_extrapolation
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, stroboscopic_history
from grazemap_core.simulation.tolerances import APPROACH_RATE

Floats = NDArray[np.float64]

OMEGA = 0.29
LANE = 5
NAME = (lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT, lane_state.SYMMETRIC)


def default(damping: float = 0.05, restitution: float = 0.8) -> Oscillator:
    return Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], restitution)


def problem_of(oscillator: Oscillator) -> CellProblem:
    steady = forced_response(oscillator, np.array([OMEGA]))[0]
    return cell_problem(trajectory_models(oscillator), steady, OMEGA)[0]


def linear_returns(
    matrix: Floats, limit: Floats, away: Floats, m: int, returns: int
) -> tuple[StroboscopicHistory, int]:
    """A ring whose lane has come to `limit` by a linear map every m halves, and the number of halves."""
    ring = stroboscopic_history(len(limit) // 2, 32, LANES)
    k = m * returns
    for i in range(returns + 1):
        ring.states[(i * m) % len(ring.min_speed), :, LANE] = limit + np.linalg.matrix_power(matrix, i) @ away
    return ring, k


@pytest.mark.parametrize(
    ("multipliers", "m"),
    [([0.9, 0.5, 0.3, -0.7, 0.2, 0.1], 1), ([0.95, 0.0, 0.0, 0.0, 0.0, 0.0], 6), ([-0.98, 0.97, 0, 0, 0, 0], 3)],
)
def test_the_limit_of_linear_returns_is_their_fixed_point(multipliers: list[float], m: int) -> None:
    problem, rng = problem_of(default()), np.random.default_rng(3)
    basis = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    limit, away = rng.normal(size=6), 1e-3 * rng.normal(size=6)
    ring, k = linear_returns(basis @ np.diag(multipliers) @ basis.T, limit, away, m, 7)
    room = fixed_point_extrapolation.extrapolation(3)
    far = fixed_point_extrapolation.extrapolate(problem, ring, room, LANE, k, m, k)
    left = ring.states[k % len(ring.min_speed), :, LANE] - limit
    np.testing.assert_allclose(room.limit, limit, atol=1e-3 * np.max(abs(left)) / 0.02, rtol=0)
    assert far == pytest.approx(np.max(abs(left) * problem.displacement_scale.ravel()), rel=0.1)


@pytest.mark.parametrize("largest", [1.001, -1.02, 0.995])
def test_an_orbit_that_does_not_attract_enough_is_no_limit(largest: float) -> None:
    problem, rng = problem_of(default()), np.random.default_rng(4)
    limit = rng.normal(size=6)
    # nearly all of the distance shrinks: it comes closer from return to return
    away = np.array([1e-3, 1e-4, 0.0, 0.0, 0.0, 0.0])
    ring, k = linear_returns(np.diag([0.5, largest, 0.0, 0.0, 0.0, 0.0]), limit, away, 1, 7)
    assert (
        fixed_point_extrapolation.extrapolate(problem, ring, fixed_point_extrapolation.extrapolation(3), LANE, k, 1, k)
        == np.inf
    )


def test_whether_multipliers_are_small_is_what_their_moduli_say() -> None:
    room, rng = fixed_point_extrapolation.extrapolation(3), np.random.default_rng(5)
    seen = set()
    for _ in range(300):
        count = int(rng.integers(1, 7))
        roots = rng.uniform(-1.05, 1.05, count).astype(complex)
        if count > 1:
            roots[0] = rng.uniform(0.8, 1.05) * np.exp(1j * rng.uniform(0, np.pi))
            roots[1] = roots[0].conjugate()
        room.weights[1 : count + 1] = -np.poly(roots)[1:].real
        expected = np.max(abs(roots)) <= APPROACH_RATE
        assert fixed_point_extrapolation._is_stable(room, count) == expected
        seen.add((count, bool(expected)))
    assert len(seen) >= 11


def test_returns_that_no_linear_map_explains_have_no_limit() -> None:
    problem, rng = problem_of(default()), np.random.default_rng(6)
    ring = stroboscopic_history(3, 32, LANES)
    ring.states[:, :, LANE] = rng.normal(size=ring.states[:, :, LANE].shape)
    assert (
        fixed_point_extrapolation.extrapolate(problem, ring, fixed_point_extrapolation.extrapolation(3), LANE, 3, 1, 3)
        == np.inf
    )


@pytest.mark.parametrize("planted", ["farther away", "other impacts"])
def test_a_lane_that_does_not_stay_goes_back(planted: str) -> None:
    problem = problem_of(default())
    group, ring, notes, rng = (
        lanes(3),
        stroboscopic_history(3, 32, LANES),
        lane_state.lane_records(3),
        np.random.default_rng(7),
    )
    job = lane_state.ColumnTask(np.array([1.6]), np.zeros((3, 2)), np.zeros((1, 3, 2)), 100, 32, True, False, 0)
    begin(group, LANE, problem, np.zeros((3, 2)), 1.6)
    notes.left[LANE] = 1e-3 * rng.normal(size=6)
    counts = notes.counts[LANE]
    counts[lane_state.AT], counts[lane_state.SINCE], counts[lane_state.RETURNED] = lane_state.LEAPT, 6, 1
    notes.sizes[LANE, lane_state.CHANGED], notes.sizes[LANE, lane_state.GOAL] = 1e-4, 1e-3
    ring.impacts[:, 0, LANE] = 1.0
    assert extrapolated_restart.land(problem, verification_scratch(3), job, group, ring, notes, LANE, 9)
    assert extrapolated_restart.has_just_landed(notes, LANE, 9)
    if planted == "farther away":
        ring.states[9, 0, LANE] = 1.0
    else:
        ring.impacts[8, 0, LANE] = 2.0
    assert not extrapolated_restart.land(problem, verification_scratch(3), job, group, ring, notes, LANE, 9)
    assert not extrapolated_restart.has_just_landed(notes, LANE, 9)
    even = group.even.reshape(-1, LANES)[:6, LANE]
    np.testing.assert_array_equal(even, -notes.left[LANE])
    np.testing.assert_array_equal(ring.states[9, :, LANE], notes.left[LANE])
    assert counts[lane_state.SINCE] == 9


def settled(oscillator: Oscillator, omega: Floats, clearance: Floats, proven: bool, periods: int) -> NDArray[np.int64]:
    return settle_grid(oscillator, omega, clearance, Settling(periods, 8, linearised=False, verified=proven))[0][..., 0]


def test_motions_are_those_that_are_proven() -> None:
    omega, clearance = np.linspace(0.26, 0.32, 24), np.linspace(1.2, 2.1, 24)
    proven = settled(default(), omega, clearance, True, 200)
    leapt = settled(default(), omega, clearance, False, 200)
    both = (proven[lane_state.REASON] == RESOLVED) & (leapt[lane_state.REASON] == RESOLVED)
    assert both.sum() > 0.97 * np.count_nonzero(proven[lane_state.REASON] == RESOLVED)
    for column in NAME:
        np.testing.assert_array_equal(leapt[column][both], proven[column][both])
    # they close to 1e-9 in little more time than it takes to come as near as proofs begin at: 1.21 of it, and 1.25 if
    # those that have landed were looked at for a return longer
    assert leapt[lane_state.RUN][both].mean() < 1.23 * proven[lane_state.RUN][both].mean()


def test_motions_of_an_undamped_chain_are_those_that_it_comes_to_by_itself() -> None:
    oscillator = default(damping=0.0, restitution=0.5)
    omega, clearance = np.array([0.31, 0.42, 0.55]), np.linspace(0.6, 1.5, 12)
    # nothing can be proven without damping; with early false nothing is looked at before the end
    leapt = settled(oscillator, omega, clearance, True, 600)
    waited = settle_grid(oscillator, omega, clearance, Settling(600, 8, early=False, linearised=False))[0][..., 0]
    both = (waited[lane_state.REASON] == RESOLVED) & (leapt[lane_state.REASON] == RESOLVED)
    assert both.sum() >= 8
    for column in NAME:
        np.testing.assert_array_equal(leapt[column][both], waited[column][both])
    assert leapt[lane_state.RUN][both].mean() < 0.7 * waited[lane_state.RUN][both].mean()
