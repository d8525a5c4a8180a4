"""Trajectories from many states: each as it would be alone, with a common preparation."""

import math

import numpy as np
import pytest

import grazemap_core.contact.trajectory_models as preparation
from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation import start
from grazemap_core.simulation.start import State
from grazemap_core.simulation.trajectories import trajectories, trajectory
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import sticking_case
from tests.support.refused import refused


def states(oscillator: Oscillator, clearance: float, count: int) -> list[State]:
    """States of every kind: between the stops, on one and moving into it, and at rest on one; with several phases."""
    rng = np.random.default_rng(0)
    starts = []
    for k in range(count):
        x, v = rng.uniform(-0.5, 0.5, (2, oscillator.size)) * clearance
        if k % 3:
            x[0] = clearance * (-1) ** k
        if k % 3 == 1:
            v[0] = 0.0
        starts.append(State(x, v, [0.0, 1.3, -2.0, 0.0, 50.0][k % 5]))
    return starts


@pytest.mark.parametrize("seed", [None, 8, 9, 31])
def test_each_result_has_the_bytes_that_it_has_alone(seed: int | None) -> None:
    oscillator, omega, clearance = (DEFAULT, 0.29, 1.6) if seed is None else sticking_case(seed)
    starts = states(oscillator, clearance, 10)
    times = np.linspace(0.0, 5 * math.pi / omega, 40)
    kept = []
    for state, run in zip(starts, trajectories(oscillator, omega, clearance, starts, 3, 1, times=times), strict=True):
        alone = trajectory(
            oscillator, omega, clearance, state.displacement, state.velocity, state.phase, 3, 1, times=times
        )
        for name in ("time", "displacement", "velocity"):
            np.testing.assert_array_equal(getattr(run, name), getattr(alone, name))
        for events in ("impacts", "sticking"):
            for name in vars(getattr(run, events)):
                np.testing.assert_array_equal(
                    getattr(getattr(run, events), name), getattr(getattr(alone, events), name)
                )
        assert (run.motion, run.undecided) == (alone.motion, alone.undecided)
        assert run.final is not None
        assert alone.final is not None
        np.testing.assert_array_equal(run.final.displacement, alone.final.displacement)
        np.testing.assert_array_equal(run.final.velocity, alone.final.velocity)
        kept.append((run, alone))
    # none is changed by those that came after it
    for run, alone in kept:
        np.testing.assert_array_equal(run.at(times)[0], alone.displacement)


def test_what_several_states_share_is_prepared_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = {"trajectory_models": 0, "forced_structures": 0}
    for name in calls:

        def counted(*arguments: object, name: str = name, whole: object = getattr(start, name)) -> object:
            calls[name] += 1
            return whole(*arguments)  # type: ignore[operator]

        monkeypatch.setattr(start, name, counted)
    assert len(list(trajectories(DEFAULT, 0.29, 1.6, states(DEFAULT, 1.6, 6)))) == 6
    assert calls == {"trajectory_models": 1, "forced_structures": 1}


@pytest.mark.parametrize("size", [1, 3])
def test_the_arrays_at_a_phase_are_those_at_phase_zero_turned_by_it(size: int) -> None:
    oscillator = Oscillator.create([1.0, 2.0, 3.0][:size], [1.0] * size, 0.1, [1.0, 0.3, -0.2][:size], 0.5)
    (structure,) = forced_structures(trajectory_models(oscillator), np.array([0.3]))
    (other,) = forced_structures(trajectory_models(oscillator), np.array([0.3]))
    at_zero = structure.kernels
    for phase in (0.7, -3.0, 1e6):
        turned, turn = structure.at_phase(phase), np.exp(1j * phase)
        for name, changed, before in (
            ("free", turned.free.steady_table, at_zero.free.steady_table),
            ("held", turned.held.steady_table, at_zero.held.steady_table),
        ):
            here, there = (table[..., 0] + 1j * table[..., 1] for table in (changed, before))
            np.testing.assert_allclose(here, turn * there, rtol=0.0, atol=1e-15 * np.abs(there).max(), err_msg=name)
    for part, fresh in zip(at_zero, other.kernels, strict=True):  # those at phase 0 stay as they were
        for field in part._fields:
            np.testing.assert_array_equal(getattr(part, field), getattr(fresh, field), err_msg=field)


def test_a_refused_state_is_named_before_any_is_simulated() -> None:
    good = State(np.zeros(3), np.zeros(3))
    for bad, name in (
        (State(np.array([1.7, 0, 0]), np.zeros(3)), "states[1].displacement"),
        (State(np.zeros(3), np.zeros(2)), "states[1].velocity"),
        (State(np.zeros(3), np.zeros(3), math.inf), "states[1].phase"),
    ):
        with refused(name):
            trajectories(DEFAULT, 0.29, 1.6, [good, bad, good])
    with pytest.raises(ParameterError, match="periods"):
        trajectories(DEFAULT, 0.29, 1.6, [good], periods=0)


def test_trajectories_of_one_oscillator_share_its_models(monkeypatch):
    """The structure with its contact held is decomposed once, not for every call."""
    oscillator, calls = Oscillator.create([1.0, 2.0], [1.0, 1.0], 0.1, [1.0, 0.0], 0.6), []
    held = preparation.held_structure

    def counted(chain):
        calls.append(chain)
        return held(chain)

    monkeypatch.setattr(preparation, "held_structure", counted)
    known = preparation.free_arrays.cache_info().hits
    first, second = (trajectory(oscillator, 0.5, 0.8, periods=3) for _ in range(2))
    assert calls == [oscillator]
    assert preparation.free_arrays.cache_info().hits > known
    np.testing.assert_array_equal(first.displacement, second.displacement)
