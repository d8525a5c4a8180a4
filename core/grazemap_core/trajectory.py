"""One trajectory: every impact and every rest on a stop exact, samples in closed form, and the motion settled to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grazemap_core.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.errors import ParameterError
from grazemap_core.kernels import closing
from grazemap_core.kernels.cells import CellProblem, bounds
from grazemap_core.kernels.closing import Orbit
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.sampling import sample_motion
from grazemap_core.kernels.simulate import RECORD_FULL, is_free_for_ever, reason_of_end, run_recorded
from grazemap_core.kernels.sticking import rest_behind_impact, start_on_stop
from grazemap_core.kernels.walk import land
from grazemap_core.kernels.workspace import (
    ANCHOR,
    CHATTER,
    DELAY,
    EVENT_COLUMNS,
    GRAZE,
    HALF,
    HELD,
    IMPACT,
    KIND,
    OK,
    RELEASE,
    REST,
    ROOTS,
    ROWS,
    STOP,
    TIME,
    UNDECIDED,
    VELOCITY,
    Workspace,
    workspace,
)
from grazemap_core.motion import Motion, motion_from_codes
from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import LARGEST_NUMBER, LEAST_NUMBER

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of mass 1: time (n,), stop (n,) +1 A or -1 C, velocity (n,) before the impact (signed), kind (n,).

    The kind is "impact"; "chatter": infinitely many more follow that one, in the time up to the start of the next
    interval of sticking, and none of them is listed; or "graze": mass 1 comes so near the stop that round-off hides
    whether it touches it. A graze is taken as a touch at zero velocity, which changes nothing.

    The same time without the rounding that a long time has: period (n,), the forcing periods completed since the record
    began, and phase_time (n,), the time since then.
    """

    time: Floats
    period: NDArray[np.int64]
    phase_time: Floats
    stop: NDArray[np.int8]
    velocity: Floats
    kind: NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class Sticking:
    """Intervals at rest on a stop: start (n,), stop_time (n,), stop (n,).

    An interval begins where the impacts of a complete chatter accumulate, at the impact itself when the restitution is
    0, or with the record; it ends with the release, or with the record.
    """

    start: Floats
    stop_time: Floats
    stop: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded trajectory; time counts from the start of the recorded part.

    Attributes
    ----------
    time : (n,)
    displacement, velocity : (N, n)
    impacts : Impacts
    sticking : Sticking
    undecided : int
        Times that round-off left a decision open, from the start of the transient on: grazes, and moments at which the
        force on a resting mass 1 is zero and may or may not release it (it is taken to stay).
    motion : Motion
        Unresolved, with the reason, when the trajectory ended early: the arrays then end there too.
    """

    time: Floats
    displacement: Floats
    velocity: Floats
    impacts: Impacts
    sticking: Sticking
    undecided: int
    motion: Motion


def trajectory(
    oscillator: Oscillator,
    omega: float,
    clearance: float,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    periods: int = 1,
    transient_periods: int = 0,
    samples_per_period: int = 200,
    max_period: int = 32,
) -> Trajectory:
    """Follow one trajectory and return samples, impacts and motion.

    Parameters
    ----------
    omega, clearance : float
        Forcing frequency and distance of the stops, > 0.
    displacement, velocity : (N,), default at rest in the middle
        State at t = 0.
    phase : float
        Forcing phase at t = 0, radians.
    periods, transient_periods : int
        Forcing periods recorded, after those that are not.
    samples_per_period : int
        Samples are at multiples of the forcing period over this, both ends included.
    max_period : int
        Longest period of a motion that is looked for.

    Raises
    ------
    ParameterError
        A number is out of range, or mass 1 starts outside the stops.
    """
    for name, value in (("omega", omega), ("clearance", clearance)):
        if not LEAST_NUMBER <= value <= LARGEST_NUMBER:
            raise ParameterError(name, f"must lie between {LEAST_NUMBER:g} and {LARGEST_NUMBER:g}")
    for name, value, least in (
        ("periods", periods, 1),
        ("transient_periods", transient_periods, 0),
        ("samples_per_period", samples_per_period, 1),
        ("max_period", max_period, 1),
    ):
        if value < least:
            raise ParameterError(name, f"must be {least} or greater")
    if not math.isfinite(phase):
        raise ParameterError("phase", "must be finite")
    x = _state("displacement", displacement, oscillator.size)
    v = _state("velocity", velocity, oscillator.size)
    if abs(x[0]) > clearance:
        raise ParameterError("displacement", "mass 1 starts outside the stops")

    models = trajectory_models(oscillator)
    steady = forced_response(oscillator, np.array([omega]))[0]
    problem, held = cell_problem(models, steady, omega, phase)
    u = free_state(models.free, steady, omega, x, v, phase)
    ring = closing.orbit(oscillator.size, max_period)
    first_half = 2 * transient_periods

    work = workspace(oscillator.size, events=64)
    closing.enter(ring, 0, u, work)
    status, done = _start(problem, held, u, clearance, float(x[0]), float(v[0]), work), 0
    if status == OK:
        status, done, work = _run_transient(problem, held, u, clearance, first_half, ring, work)
    rows = _beginning(held, u, first_half, 0.5 * problem.cells * problem.step, work)
    recorded = status == OK
    if recorded:
        status, done, work = _run_record(problem, held, u, clearance, first_half, first_half + 2 * periods, ring, work)
        rows = np.concatenate([rows, work.events[: work.cursor[ROWS]]])

    period_time = 2.0 * math.pi / omega
    event_time = (rows[:, HALF] - first_half) * (0.5 * period_time) + rows[:, TIME]
    count = periods * samples_per_period + 1
    index = np.arange(count, dtype=np.int64)
    end = periods * period_time
    if not recorded:
        index, end = index[:0], 0.0
    elif status != OK:
        # the trajectory ended with its last event, or where it stood in the half period when none was recorded
        end = event_time[-1] if len(rows) > 1 else (done - first_half) * (0.5 * period_time)
        index = index[index * (period_time / samples_per_period) <= end]
    samples_x, samples_v = sample_motion(
        problem,
        held,
        models.free.shape,
        steady * np.exp(1j * phase),
        rows,
        clearance,
        index,
        samples_per_period,
        first_half,
    )
    return Trajectory(
        time=np.asarray(index * (period_time / samples_per_period), dtype=np.float64),
        displacement=samples_x,
        velocity=samples_v,
        impacts=_impacts(rows[1:], event_time[1:], first_half, 0.5 * period_time),
        sticking=_sticking(rows, event_time, end),
        undecided=int(work.tally[UNDECIDED]),
        motion=_motion(problem, ring, u, status, done, max_period, clearance, int(work.cursor[ANCHOR])),
    )


def _state(name: str, values: Floats | None, count: int) -> Floats:
    """Return an initial displacement or velocity as an array of shape (N,)."""
    if values is None:
        return np.zeros(count)
    array = np.array(values, dtype=np.float64)
    if array.shape != (count,) or not np.all(np.isfinite(array)):
        raise ParameterError(name, "must be a list of finite numbers, one per mass")
    return array


def _start(
    problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, x1: float, v1: float, work: Workspace
) -> int:
    """Enter a start on a stop: moving into it is an impact, at rest it stays there if pressed. Returns a status."""
    if abs(x1) != clearance:
        return OK
    stop = 1 if x1 > 0.0 else -1
    if v1 == 0.0:
        return start_on_stop(problem, held, u, clearance, stop, work)
    if v1 * stop > 0.0:
        if land(problem, u, stop, v1, problem.gain[0, 1], 0, 0.0, work):
            return int(rest_behind_impact(problem, held, u, clearance, 0, 0.0, 0, work))
        return OK
    work.cursor[ANCHOR], work.cursor[ROOTS] = stop, 1
    work.near[:2] = 0.0, abs(v1)
    return OK


def _beginning(held: HeldProblem, u: Floats, first_half: int, half_time: float, work: Workspace) -> Floats:
    """Return the row with which a record begins, shape (1, EVENT_COLUMNS + 2 N)."""
    row = np.zeros((1, EVENT_COLUMNS + u.size))
    row[0, HALF] = first_half
    if work.cursor[HELD] != 0 and work.cursor[ROWS] == 0:
        since = (held.since[0] - first_half) * half_time + held.since[1]
        row[0, [STOP, KIND, DELAY]] = work.cursor[HELD], REST, max(0.0, since)
        row[0, EVENT_COLUMNS : EVENT_COLUMNS + held.state.size] = held.state.ravel()
    else:
        row[0, [KIND]] = IMPACT
        row[0, EVENT_COLUMNS:] = u.ravel()
    return row


def _impacts(rows: Floats, time: Floats, first_half: int, half_time: float) -> Impacts:
    """Pick the contacts out of the events of a record that begins with half period `first_half`."""
    there = rows[:, KIND] != RELEASE
    half = rows[there, HALF].astype(np.int64) - first_half
    return Impacts(
        time=time[there],
        period=half // 2,
        phase_time=(half % 2) * half_time + rows[there, TIME],
        stop=rows[there, STOP].astype(np.int8),
        velocity=rows[there, VELOCITY],
        kind=np.select([rows[there, KIND] == CHATTER, rows[there, KIND] == GRAZE], ["chatter", "graze"], "impact"),
    )


def _sticking(rows: Floats, time: Floats, end: float) -> Sticking:
    """Pick the intervals of rest out of the events of a record that ends at `end`."""
    begins = ~np.isin(rows[:, KIND], (IMPACT, GRAZE, RELEASE)) & (time + rows[:, DELAY] <= end)
    until = np.append(time[1:], end)  # the event behind a rest is its release
    return Sticking(
        start=(time + rows[:, DELAY])[begins], stop_time=until[begins], stop=rows[begins, STOP].astype(np.int8)
    )


def _run_transient(
    problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, halves: int, ring: Orbit, work: Workspace
) -> tuple[int, int, Workspace]:
    """Run the part that is not recorded, forgetting its impacts block by block. Returns (status, halves done, work)."""
    done = 0
    status = OK
    while done < halves and status == OK:
        status, done, work = _run_record(problem, held, u, clearance, done, min(done + 64, halves), ring, work)
        work.cursor[ROWS] = 0
    return status, done, work


def _run_record(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
    done: int,
    halves: int,
    ring: Orbit,
    work: Workspace,
) -> tuple[int, int, Workspace]:
    """Run on to `halves` half periods, growing the record of impacts as needed. Returns (status, halves done, work)."""
    while True:
        status, done = run_recorded(problem, held, u, clearance, done, halves, ring, work)
        if status != RECORD_FULL:
            return status, done, work
        events = np.zeros((2 * len(work.events), work.events.shape[1]))
        events[: len(work.events)] = work.events
        work = work._replace(events=events)


def _motion(
    problem: CellProblem,
    ring: Orbit,
    u: Floats,
    status: int,
    halves: int,
    max_period: int,
    clearance: float,
    anchor: int,
) -> Motion:
    """Name the motion at the end of a trajectory."""
    if status != OK:
        return motion_from_codes(reason_of_end(status), 0, 0, 0, False, False)
    reach, _ = bounds(problem, u)
    if is_free_for_ever(problem, reach, anchor, clearance):
        return motion_from_codes(closing.NAMED, 1, -1, -1, True, False)
    reason, period, right, left, symmetric, _, sticking = closing.name_motion(
        problem, ring, 0, halves, halves, max_period, clearance, reach
    )
    return motion_from_codes(reason, period, right, left, symmetric, sticking)
