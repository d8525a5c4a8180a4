"""Where trajectories of maps, basins and fractions begin: the impacts of each are those of its recorded trajectory."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.codes import NO_STICKING_FLOW, ROUNDING_DECIDES
from grazemap_core.contact.stops import Clearance, both_clearances
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.maps.basin_fractions import from_rest
from grazemap_core.maps.basins import Coordinate, initial_states, run_states
from grazemap_core.maps.kernels.lane_state import CODES, FIGURES, HALVES_RUN, IMPACTS, REASON, UNVERIFIED
from grazemap_core.maps.map_settings import AtRest, Conditions, RunSettings, random_starts
from grazemap_core.maps.planes import Axis, Plane, PlaneRunner
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.sensitive_points import Resolution, Resolver, resolve_grid
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST

PERIODS = 6
SHORT = RunSettings(PERIODS, 2, early=False, linearised=False)
ONE_MASS = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
PRELOADED = (-0.2, 1.0)


def impacts(forced: ForcedOscillator, displacement, velocity, phase: float = 0.0) -> int:
    run = trajectory(forced.oscillator, forced.omega, forced.clearance, displacement, velocity, phase, periods=PERIODS)
    return len(run.impacts.stop)


def about_middle(forced: ForcedOscillator, starts):
    """States of an ensemble (theory): displacements along the structure that is pushed at its contact."""
    right, left = forced.clearances
    oscillator = forced.oscillator
    pushed = np.linalg.solve(oscillator.stiffness_matrix, oscillator.contact)
    states = forced.stops.unit * starts * np.array([1.0, forced.omega])[:, None]
    states[:, 0] += 0.5 * (right - left) * pushed / (oscillator.contact @ pushed)
    return states


@pytest.mark.parametrize(
    ("oscillator", "omega"),
    [(DEFAULT, 0.29), pytest.param(ONE_MASS, 0.7, marks=KERNELS_FIRST)],
    ids=["chain", "one mass"],
)
@pytest.mark.parametrize("clearance", [PRELOADED, (1.0, -0.2), (0.3, 1.0), (0.0, 1.0)])
def test_the_states_of_an_ensemble_begin_where_they_are(oscillator, omega: float, clearance: Clearance):
    starts = random_starts(oscillator, 12, 4)
    plane = Plane.of(oscillator, np.array([omega]), np.array([both_clearances(clearance)]))
    codes, _ = PlaneRunner(plane, SHORT._replace(starts=starts)).points(np.array([0]), np.array([0]))
    forced = forced_oscillator(oscillator, omega, clearance)
    alone = [impacts(forced, *state) for state in about_middle(forced, starts)]
    assert codes[0, :, HALVES_RUN].tolist() == [2 * PERIODS] * len(starts)
    assert codes[0, :, IMPACTS].tolist() == alone
    assert len(set(alone)) > 1


@pytest.mark.parametrize(
    ("oscillator", "omega", "clearance"),
    [
        *(pytest.param(ONE_MASS, 0.7, both, marks=KERNELS_FIRST) for both in (PRELOADED, (0.0, 1.0), (0.4, 1.0))),
        (DEFAULT, 0.29, (0.0, 1.0)),
        (DEFAULT, 0.29, PRELOADED),
    ],
)
def test_the_states_of_basins_begin_where_they_are(oscillator, omega: float, clearance: Clearance):
    forced = forced_oscillator(oscillator, omega, clearance)
    across = Coordinate("displacement", 1, np.array([-0.95, -0.6, -0.21]))
    up = Coordinate("velocity", 1, np.array([-0.4, 0.0, 0.7]))
    state, added = initial_states(forced, across, up, None, None)
    for part in (added, added[1:2, 1:2]):  # a single state is no other case
        codes, _ = run_states(Runner(oscillator, SHORT), forced, state, part, 0.5)
        alone = [impacts(forced, *start, 0.5) for start in (state + part).reshape(-1, *state.shape)]
        assert codes[:, IMPACTS].tolist() == alone


def test_random_states_of_fractions_begin_where_they_are_with_a_bias_that_preloads_a_stop():
    stiffness = [[3.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 5.0]]
    structure = Matrices.create(np.diag([2.0, 1.0, 1.0]), stiffness, damping=0.2 * np.eye(3))
    forces = [force(1, np.array([1.0, 0.0, 0.0]))]
    pressed = Oscillator.of_structure(structure, [1.0, -1.0, 0.0], forces, 0.7, [-0.5, 1.0, 0.0], 0.5)
    forced = forced_oscillator(pressed, 2.5, (0.4, 0.3))
    assert forced.stops.left < 0.0
    rng = np.random.default_rng(2)
    states = rng.uniform(-0.3, 0.3, (10, 2, 3))
    states = states[np.abs(states[:, 0] @ pressed.contact) < 0.29]
    codes, _ = run_states(Runner(pressed, SHORT), forced, *from_rest(forced, states), 0.0)
    assert codes[:, IMPACTS].tolist() == [impacts(forced, *state) for state in states]


def test_a_sensitive_point_of_an_ensemble_is_decided_from_the_state_of_the_map(monkeypatch):
    seen = []

    def kept(resolver, clearance, state=None, phase=0.0):
        seen.append(state)
        return Resolution("not asked", 0, np.zeros(CODES, dtype=np.int64), np.zeros(FIGURES))

    monkeypatch.setattr(Resolver, "resolve", kept)
    starts, clearance = random_starts(DEFAULT, 3, 1), (1.9, 0.4)
    plane = Plane.of(DEFAULT, np.array([0.29]), np.array([clearance]))
    codes, figures = np.zeros((CODES, 1, 1, 3), dtype=np.int64), np.zeros((FIGURES, 1, 1, 3))
    codes[UNVERIFIED] = ROUNDING_DECIDES
    runner = PlaneRunner(plane, SHORT._replace(starts=starts))
    resolve_grid(runner, codes[UNVERIFIED] == ROUNDING_DECIDES, codes, figures)
    expected = about_middle(forced_oscillator(DEFAULT, 0.29, clearance), starts)
    np.testing.assert_allclose(np.stack(seen), expected, rtol=1e-12)


def at_resonance() -> Oscillator:
    """Three masses, of which the second one is at an undamped resonance while the first one is held, at omega 1.

    At phase 0 the force pulls the contact off its preloaded right stop.
    """
    stiffness = [[2.0, -0.5, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 3.0]]
    structure = Matrices.create(np.eye(3), stiffness, damping=np.diag([0.2, 0.0, 0.1]))
    drive = [force(1, np.array([1.0, 0.3, 0.0]), np.array([-np.pi / 2, 0.0, 0.0]))]
    return Oscillator.of_structure(structure, [1.0, 0.0, 0.0], drive, 0.8, np.zeros(3), 0.8)


@pytest.mark.parametrize("by_kernels", [True, False])
def test_a_sweep_starts_from_rest_on_a_preloaded_stop_after_a_trajectory_that_ended_early(by_kernels, monkeypatch):
    monkeypatch.setattr(Plane, "is_swept_by_kernels", by_kernels)
    oscillator = at_resonance()
    at = ParameterPoint.of(oscillator, 1.0, (-0.1, 1.0))
    plane = Plane(oscillator, at, Axis("omega", np.array([1.0, 1.1])), Axis("restitution", np.array([0.0, 0.9])))
    swept, _, end = PlaneRunner(plane, SHORT._replace(follow=True)).sweep(np.arange(2), 0)
    _, _, alone = PlaneRunner(plane, SHORT._replace(follow=True)).sweep(np.array([1]), 0)
    np.testing.assert_array_equal(end.run_end.state, alone.run_end.state)
    assert swept[0, 0, REASON] == NO_STICKING_FLOW
    (from_rest_at_second,), _ = PlaneRunner(plane, SHORT).points(np.array([1]), np.array([0]))
    np.testing.assert_array_equal(swept[1], from_rest_at_second)
    assert swept[1, 0, HALVES_RUN] == 2 * PERIODS


def test_nothing_is_handed_on_before_a_run():
    runner = Runner(DEFAULT, SHORT._replace(follow=True))
    conditions = Plane.of(DEFAULT, np.array([0.29]), np.array([1.0])).conditions(np.array([0]), np.array([0]))
    assert runner.final_state(runner.at(0.29), conditions) is None


@pytest.mark.parametrize("by_kernels", [True, False])
def test_a_sweep_that_goes_on_later_is_the_one_that_was_not_left(by_kernels, monkeypatch):
    """Also where it was left for other runs, and a trajectory begins with the error of the one before."""
    monkeypatch.setattr(Plane, "is_swept_by_kernels", by_kernels)
    plane = Plane.of(DEFAULT, np.array([0.28]), np.array([1.383333, 1.390909, 1.398485, 1.45]))
    task, down = RunSettings(300, 8, follow=True), np.array([3, 2, 1, 0])
    whole, whole_figures, _ = PlaneRunner(plane, task).sweep(down, 0)
    runner = PlaneRunner(plane, task)
    first, first_figures, end = runner.sweep(down[:2], 0)
    runner.sweep(np.full(3, 2), 0, end)
    second, second_figures, _ = runner.sweep(down[2:], 0, end)
    np.testing.assert_array_equal(np.concatenate([first, second]), whole)
    np.testing.assert_array_equal(np.concatenate([first_figures, second_figures]), whole_figures)


@pytest.mark.parametrize("order", [2, 3])
def test_a_contact_that_rests_when_a_sweep_goes_on_has_the_state_of_its_trajectory(order: int) -> None:
    """The second harmonic is in resonance with the first mode, in which the free structure hardly loses energy."""
    chain = Oscillator.create([1.0, 1.0], [1.0, 1.0], 1e-4, [0.0, 0.0], 0.5).structure
    drive = [force(1, np.array([0.1, 0.0])), force(order, np.array([0.0, 0.05]))]
    pressed = Oscillator.of_structure(chain, [1.0, 0.0], drive, 0.5, [3.0, 0.0])
    omega, clearance = 0.6186 / order, np.array([[1.0, np.inf]])
    runner = Runner(pressed, RunSettings(3, 2, early=False, linearised=False, follow=True))
    forced = runner.at(omega)
    runner.run(forced, clearance, AtRest())
    state = runner.final_state(forced, Conditions.of(pressed, clearance))
    final = trajectory(pressed, omega, (1.0, None), periods=3).final
    np.testing.assert_allclose(state, [final.displacement, final.velocity], atol=1e-13)
