"""One trajectory: every impact exact, samples in closed form, and the motion that it settles to."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grazemap_core.cell_problem import cell_problem, free_state
from grazemap_core.errors import ParameterError
from grazemap_core.kernels import closing, contact
from grazemap_core.kernels.cells import CellProblem, bounds
from grazemap_core.kernels.closing import Orbit
from grazemap_core.kernels.contact import Workspace
from grazemap_core.kernels.sampling import sample_motion
from grazemap_core.kernels.simulate import RECORD_FULL, run_recorded
from grazemap_core.modal import modal_model
from grazemap_core.motion import Motion, motion_from_codes
from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import CLEARED, LARGEST_NUMBER, LEAST_NUMBER

Floats = NDArray[np.float64]

_ENDINGS = {
    contact.COMPLETE_CHATTER: closing.CHATTERS,
    contact.IMPACT_BUDGET_SPENT: closing.BUDGET,
    contact.NOT_FINITE: closing.OVERFLOWS,
}


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of mass 1: time (n,), stop (n,) +1 A or -1 C, velocity (n,) before the impact (signed), kind (n,)."""

    time: Floats
    stop: NDArray[np.int8]
    velocity: Floats
    kind: NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class Sticking:
    """Intervals at rest on a stop: start (n,), stop_time (n,), stop (n,)."""

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
    motion : Motion
        Unresolved, with the reason, when the trajectory ended early: the arrays then end there too.
    """

    time: Floats
    displacement: Floats
    velocity: Floats
    impacts: Impacts
    sticking: Sticking
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

    model = modal_model(oscillator)
    steady = forced_response(oscillator, np.array([omega]))[0]
    problem = cell_problem(model, steady, omega, oscillator.restitution, phase)
    u = free_state(model, steady, omega, x, v, phase)
    ring = closing.orbit(oscillator.size, max_period)
    first_half = 2 * transient_periods

    work = contact.workspace(oscillator.size, events=64)
    work.tally[2] = np.inf
    closing.enter(ring, 0, u, work)
    if abs(x[0]) == clearance:
        work.cursor[0] = 1 if x[0] > 0.0 else -1
        if v[0] * x[0] > 0.0:  # moving into the stop that it starts on
            contact.strike(problem, u, clearance, int(work.cursor[0]), float(v[0]), 0, 0.0, work)
    status, done, work = _run_transient(problem, u, clearance, first_half, ring, work)
    rows = np.concatenate([[first_half, 0.0, 0.0, 0.0], u.ravel()])[None, :]
    recorded = status == contact.OK
    if recorded:
        status, done, work = _run_record(problem, u, clearance, first_half, first_half + 2 * periods, ring, work)
        rows = np.concatenate([rows, work.events[: work.cursor[1]]])

    period_time = 2.0 * math.pi / omega
    impact_time = (rows[1:, 0] - first_half) * (0.5 * period_time) + rows[1:, 1]
    count = periods * samples_per_period + 1
    index = np.arange(count, dtype=np.int64)
    if not recorded:
        index = index[:0]
    elif status != contact.OK:
        # the trajectory ended with its last impact, or where it stood in the half period when none was recorded
        end = impact_time[-1] if len(impact_time) else (done - first_half) * (0.5 * period_time)
        index = index[index * (period_time / samples_per_period) <= end]
    samples_x, samples_v = sample_motion(
        problem, model.shape, steady * np.exp(1j * phase), rows, index, samples_per_period, first_half
    )
    return Trajectory(
        time=np.asarray(index * (period_time / samples_per_period), dtype=np.float64),
        displacement=samples_x,
        velocity=samples_v,
        impacts=Impacts(
            time=impact_time,
            stop=rows[1:, 2].astype(np.int8),
            velocity=rows[1:, 3].copy(),
            kind=np.full(len(rows) - 1, "impact"),
        ),
        sticking=Sticking(np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int8)),
        motion=_motion(problem, ring, u, status, done, max_period, clearance, int(work.cursor[0])),
    )


def _state(name: str, values: Floats | None, count: int) -> Floats:
    """Return an initial displacement or velocity as an array of shape (N,)."""
    if values is None:
        return np.zeros(count)
    array = np.array(values, dtype=np.float64)
    if array.shape != (count,) or not np.all(np.isfinite(array)):
        raise ParameterError(name, "must be a list of finite numbers, one per mass")
    return array


def _run_transient(
    problem: CellProblem, u: Floats, clearance: float, halves: int, ring: Orbit, work: Workspace
) -> tuple[int, int, Workspace]:
    """Run the part that is not recorded, forgetting its impacts block by block. Returns (status, halves done, work)."""
    done = 0
    status = contact.OK
    while done < halves and status == contact.OK:
        status, done, work = _run_record(problem, u, clearance, done, min(done + 64, halves), ring, work)
        work.cursor[1] = 0
    return status, done, work


def _run_record(
    problem: CellProblem, u: Floats, clearance: float, done: int, halves: int, ring: Orbit, work: Workspace
) -> tuple[int, int, Workspace]:
    """Run on to `halves` half periods, growing the record of impacts as needed. Returns (status, halves done, work)."""
    while True:
        status, done = run_recorded(problem, u, clearance, done, halves, ring, work)
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
    stop_left: int,
) -> Motion:
    """Name the motion at the end of a trajectory."""
    if status != contact.OK:
        return motion_from_codes(_ENDINGS[status], 0, 0, 0, False)
    reach, _ = bounds(problem, u)
    if stop_left == 0 and problem.damped and reach < CLEARED * clearance:
        return motion_from_codes(closing.NAMED, 1, -1, -1, True)
    reason, period, right, left, symmetric, _ = closing.name_motion(problem, ring, halves, max_period, clearance, reach)
    return motion_from_codes(reason, period, right, left, symmetric)
