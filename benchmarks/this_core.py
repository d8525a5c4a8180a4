"""The impact core as the benchmarks call it: everything that depends on which of its kernels is used stands here.

Flows in: the numbers of a `Work` or a `Start`; flows out: arrays. Nothing is timed here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from benchmarks.work import Floats, Integers, Start
from grazemap_core.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.kernels.cells import CellProblem, bounds
from grazemap_core.kernels.closing import NAMED, Orbit, enter, name_motion, orbit
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.simulate import reason_of_end, run_half
from grazemap_core.kernels.workspace import FOLLOWED, HALF, OK, ROWS, TIME, Workspace, clear_tally, workspace
from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import TAYLOR_DEGREE
from grazemap_core.trajectory import trajectory
from grazemap_core.unfolding import unfolding_map_tile

KERNEL = "scalar"
"""Which of the core's kernels runs; goes into the result."""

DEGREE = TAYLOR_DEGREE
"""Degree of the local series in which a contact is solved for."""

LONGEST_PERIOD = 32
"""Longest motion that is looked for when a pixel is classified."""


class Classified(NamedTuple):
    """What became of the pixels of a map; every array has the shape (clearances, omegas).

    Attributes
    ----------
    named : bool
        Whether the motion was recognised.
    impacts : int
        Impacts followed one by one; -1 where the computation does not count them.
    """

    named: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    impacts: Integers


class _Problem(NamedTuple):
    """The kernels' view of an oscillator at one frequency, and scratch for one lane."""

    cells: CellProblem
    held: HeldProblem
    initial: Floats
    work: Workspace


def _problem(oscillator: Oscillator, omega: float, start: Start | None = None, events: int = 0) -> _Problem:
    """Set up an oscillator, from rest unless a start is given."""
    models = trajectory_models(oscillator)
    steady = forced_response(oscillator, np.array([omega]))[0]
    at_rest = np.zeros(oscillator.size)
    x, v, phase = (at_rest, at_rest, 0.0) if start is None else (start.displacement, start.velocity, start.phase)
    problem, held = cell_problem(models, steady, omega, phase)
    initial = free_state(models.free, steady, omega, x, v, phase)
    return _Problem(problem, held, initial, workspace(oscillator.size, events))


def cells_per_period(oscillator: Oscillator, omega: float) -> int:
    """Return the number of cells that the core cuts a forcing period into."""
    return _problem(oscillator, omega).cells.cells


def fixed_length(oscillator: Oscillator, omega: float, clearances: Floats, periods: int) -> Integers:
    """Run every lane from rest for so many forcing periods. Returns the impacts of every lane, shape (lanes,)."""
    problem = _problem(oscillator, omega)
    impacts = np.empty(len(clearances), dtype=np.int64)
    _run_lanes(problem.cells, problem.held, problem.initial, clearances, 2 * periods, problem.work, impacts)
    return impacts


def impact_times(oscillator: Oscillator, omega: float, clearance: float, periods: int) -> Floats:
    """Return the times of all impacts within so many forcing periods, from rest."""
    return trajectory(oscillator, omega, clearance, periods=periods, samples_per_period=1).impacts.time


def first_contacts(oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
    """Return the time of the first contact within one forcing period, NaN if there is none, shape (clearances,)."""
    problem = _problem(oscillator, start.omega, start, events=1)
    times = np.empty(len(clearances))
    _first_contacts(problem.cells, problem.held, problem.initial, clearances, problem.work, times)
    return times


def map_of_fixed_length(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Run every pixel of a grid for so many forcing periods, whatever it does, then classify it."""
    ring = orbit(oscillator.size, LONGEST_PERIOD)
    named = np.empty((len(clearances), len(omegas)), dtype=np.bool_)
    impacts = np.empty(named.shape, dtype=np.int64)
    reasons, counts = np.empty(len(clearances), dtype=np.int64), np.empty(len(clearances), dtype=np.int64)
    for i, omega in enumerate(omegas):
        problem = _problem(oscillator, float(omega))
        _classify_lanes(
            problem.cells, problem.held, problem.initial, clearances, 2 * periods, LONGEST_PERIOD, ring, problem.work,
            reasons, counts,
        )  # fmt: skip
        named[:, i] = reasons == NAMED
        impacts[:, i] = counts
    return Classified(named, impacts)


def map_with_settling(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Run every pixel of a grid until its motion can be named, for so many forcing periods at most."""
    tile = unfolding_map_tile(oscillator, omegas, clearances, max_periods=periods, max_period=LONGEST_PERIOD)
    return Classified(tile["kind"] == 1, np.full((len(clearances), len(omegas)), -1))


@njit(cache=True, nogil=True, error_model="numpy")
def _run_lanes(
    problem: CellProblem,
    held: HeldProblem,
    initial: Floats,
    clearances: Floats,
    halves: int,
    work: Workspace,
    impacts: Integers,
) -> None:
    """Run lanes one after the other, counting impacts."""
    u = np.empty_like(initial)
    for lane in range(clearances.shape[0]):
        u[:] = initial
        work.cursor[:] = 0
        clear_tally(work.tally)
        count = 0.0
        for half in range(halves):
            if run_half(problem, held, u, clearances[lane], half, work) != OK:
                break
            count += work.tally[FOLLOWED]
        impacts[lane] = int(count)


@njit(cache=True, nogil=True, error_model="numpy")
def _first_contacts(
    problem: CellProblem, held: HeldProblem, initial: Floats, clearances: Floats, work: Workspace, times: Floats
) -> None:
    """Run lanes until their first event, for one forcing period at most."""
    u = np.empty_like(initial)
    half_time = 0.5 * problem.cells * problem.step
    for lane in range(clearances.shape[0]):
        u[:] = initial
        work.cursor[:] = 0
        clear_tally(work.tally)
        times[lane] = np.nan
        for half in range(2):
            status = run_half(problem, held, u, clearances[lane], half, work)
            if work.cursor[ROWS] > 0:
                times[lane] = work.events[0, HALF] * half_time + work.events[0, TIME]
                break
            if status != OK:
                break


@njit(cache=True, nogil=True, error_model="numpy")
def _classify_lanes(
    problem: CellProblem,
    held: HeldProblem,
    initial: Floats,
    clearances: Floats,
    halves: int,
    max_period: int,
    ring: Orbit,
    work: Workspace,
    reasons: Integers,
    impacts: Integers,
) -> None:
    """Run lanes to their end and judge the orbit there."""
    u = np.empty_like(initial)
    for lane in range(clearances.shape[0]):
        u[:] = initial
        work.cursor[:] = 0
        clear_tally(work.tally)
        enter(ring, 0, u, work)
        count = 0.0
        reason = NAMED
        for half in range(halves):
            status = run_half(problem, held, u, clearances[lane], half, work)
            if status != OK:
                reason = reason_of_end(status)
                break
            count += work.tally[FOLLOWED]
            enter(ring, half + 1, u, work)
        if reason == NAMED:
            reach, _ = bounds(problem, u)
            reason = name_motion(problem, ring, halves, max_period, clearances[lane], reach)[0]
        reasons[lane] = reason
        impacts[lane] = int(count)
