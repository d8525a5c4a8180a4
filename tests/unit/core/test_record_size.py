"""A record stays within its bytes: a trajectory that has more events ends with an error, and transients keep none."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from grazemap_core.errors import RecordSizeError
from grazemap_core.maps.bifurcation_diagrams import sections
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation import trajectories as module
from grazemap_core.simulation.record import EVENT_BYTES
from grazemap_core.simulation.start import State
from grazemap_core.simulation.trajectories import Trajectory, trajectories, trajectory
from tests.support.lines import line
from tests.support.oscillators import DEFAULT

ELASTIC = dataclasses.replace(DEFAULT, restitution=1.0)
# thousands of impacts a period, for ever
CLOSE = (ELASTIC, 0.29, 1e-4)


def parts(run: Trajectory) -> list[object]:
    """Return everything in a result."""
    named = [run.time, run.displacement, run.velocity, run.undecided, run.motion]
    return [*named, *vars(run.impacts).values(), *vars(run.sticking).values()]


@pytest.fixture
def longest(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The largest number of events that a record had room for."""
    largest, run_recorded = [0], module.run_recorded

    def watched(*arguments: Any) -> object:
        largest[0] = max(largest[0], len(arguments[2].events))
        return run_recorded(*arguments)

    monkeypatch.setattr(module, "run_recorded", watched)
    return largest


def test_a_trajectory_with_more_impacts_than_a_result_holds_is_refused(longest: list[int]) -> None:
    with pytest.raises(RecordSizeError, match=r"more than 1008 impacts.* at most 61500 bytes.*fewer periods") as caught:
        trajectory(*CLOSE, periods=10**6, samples_per_period=1, most_bytes=61_500)
    assert (caught.value.events, caught.value.most_bytes) == (1008, 61_500)
    assert caught.value.name == "periods"
    assert longest == [1008]


def test_an_impact_takes_these_bytes_in_a_result() -> None:
    impacts = trajectory(DEFAULT, 0.29, 1.6, periods=10).impacts
    assert sum(array.nbytes for array in vars(impacts).values()) == EVENT_BYTES * len(impacts.time)


def test_the_limit_itself_is_allowed_and_changes_nothing() -> None:
    free = trajectory(DEFAULT, 0.29, 1.6, periods=200)
    events = len(free.record.rows) - 1
    held = trajectory(DEFAULT, 0.29, 1.6, periods=200, most_bytes=events * EVENT_BYTES)
    for part, other in zip(parts(held), parts(free), strict=True):
        np.testing.assert_array_equal(part, other)
    with pytest.raises(RecordSizeError):
        trajectory(DEFAULT, 0.29, 1.6, periods=200, most_bytes=events * EVENT_BYTES - 1)


def test_trajectories_share_the_limit() -> None:
    events = len(trajectory(DEFAULT, 0.29, 1.6, periods=50).record.rows) - 1
    states = [State(np.zeros(3), np.zeros(3))] * 3
    runs = trajectories(DEFAULT, 0.29, 1.6, states, 50, most_bytes=(3 * events - 1) * EVENT_BYTES)
    next(runs)
    next(runs)
    with pytest.raises(RecordSizeError, match=f"more than {3 * events - 1} impacts"):
        next(runs)


def test_the_states_of_many_masses_count_too() -> None:
    many = Oscillator.create([1.0] * 40, [1.0] * 40, 0.05, [1.0] + [0.0] * 39, 1.0)
    with pytest.raises(RecordSizeError) as caught:
        trajectory(many, 0.29, 1e-3, periods=10**6, samples_per_period=1, most_bytes=1 << 20)
    assert caught.value.events == 2 * (1 << 20) // (8 * (6 + 80))


@pytest.mark.parametrize(("restitution", "clearance"), [(1.0, 1e-4), (0.99, 1e-2), (0.3, 1e-3)])
def test_a_long_transient_keeps_few_events_and_changes_nothing(
    monkeypatch: pytest.MonkeyPatch, longest: list[int], restitution: float, clearance: float
) -> None:
    oscillator = dataclasses.replace(DEFAULT, restitution=restitution)
    whole = trajectory(oscillator, 0.29, clearance, periods=2, transient_periods=150)
    longest[0] = 0
    monkeypatch.setattr(module, "TRANSIENT_EVENTS", 64)
    short = trajectory(oscillator, 0.29, clearance, periods=2, transient_periods=150)
    for part, other in zip(parts(short), parts(whole), strict=True):
        np.testing.assert_array_equal(part, other)
    assert longest[0] <= 4 * max(64, len(whole.impacts.time))


def test_the_impacts_of_a_diagram_are_counted_over_all_its_values() -> None:
    diagram = list(sections(line(DEFAULT, "clearance", [1.5, 1.6, 1.7], 0.29)))
    bytes_of_all = sum(section.impact_velocity.nbytes + section.impact_stop.nbytes for section in diagram)
    assert len(list(sections(line(DEFAULT, "clearance", [1.5, 1.6, 1.7], 0.29), most_bytes=bytes_of_all * 8))) == 3
    kept = sections(line(DEFAULT, "clearance", np.linspace(1.5, 1.7, 60), 0.29), most_bytes=bytes_of_all * 8)
    with pytest.raises(RecordSizeError, match=f"more than {bytes_of_all * 8 // 9} impacts"):
        list(kept)
