"""The impact core as the benchmarks call it: everything that depends on which of its kernels is used stands here.

Flows in: the numbers of a `Work` or a `Start`; flows out: arrays. Nothing is timed here.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.work import Floats, Integers, Start
from grazemap_core.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.held_problem import HeldModel
from grazemap_core.kernels.cells import CellProblem, bounds
from grazemap_core.kernels.closing import NAMED, Orbit, enter, name_motion, orbit
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.simulate import RECORD_FULL, is_free_for_ever, run_half, run_recorded
from grazemap_core.kernels.workspace import ANCHOR, FOLLOWED, HALF, OK, ROWS, TIME, Workspace, clear_tally, workspace
from grazemap_core.oscillator import Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import TAYLOR_DEGREE
from grazemap_core.trajectory import trajectory
from grazemap_core.unfolding import unfolding_map_tile

Booleans = NDArray[np.bool_]

KERNEL = "scalar"
"""Which of the core's kernels runs; goes into the result."""

DEGREE = TAYLOR_DEGREE
"""Degree of the local series in which a contact is solved for."""

PIXEL_LANES = 4
"""Copies of one pixel that are run together to time it: enough to fill the kernel and to hide the set-up."""

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

    named: Booleans
    impacts: Integers


class _Problem(NamedTuple):
    """The kernels' view of an oscillator at one frequency, and scratch for one lane."""

    cells: CellProblem
    held: HeldProblem
    initial: Floats
    work: Workspace


@lru_cache
def _models(oscillator: Oscillator) -> HeldModel:
    """Return the modal models of an oscillator, as a map computes them: once."""
    return trajectory_models(oscillator)


def _problem(oscillator: Oscillator, omega: float, start: Start | None = None, events: int = 0) -> _Problem:
    """Set up an oscillator, from rest unless a start is given."""
    models = _models(oscillator)
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
    return _lanes(problem, clearances, periods, classified=False)[0]


def impact_times(oscillator: Oscillator, omega: float, clearance: float, periods: int) -> Floats:
    """Return the times of all impacts within so many forcing periods, from rest."""
    return trajectory(oscillator, omega, clearance, periods=periods, samples_per_period=1).impacts.time


def first_contacts(oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
    """Return the time of the first contact within one forcing period, NaN if there is none, shape (clearances,)."""
    cells, held, initial, work = _problem(oscillator, start.omega, start, events=64)
    ring = orbit(oscillator.size, 1)
    half_time = 0.5 * cells.cells * cells.step
    times = np.full(len(clearances), np.nan)
    for i, clearance in enumerate(clearances):
        work.cursor[:] = 0
        clear_tally(work.tally)
        status, _ = run_recorded(cells, held, initial.copy(), float(clearance), 0, 2, ring, work)
        if status == RECORD_FULL or work.cursor[ROWS] > 0:
            times[i] = work.events[0, HALF] * half_time + work.events[0, TIME]
    return times


def map_of_fixed_length(oscillator: Oscillator, omegas: Floats, clearances: Floats, periods: int) -> Classified:
    """Run every pixel of a grid for so many forcing periods, whatever it does, then classify it."""
    columns = [_lanes(_problem(oscillator, float(omega)), clearances, periods, classified=True) for omega in omegas]
    return Classified(np.stack([named for _, named in columns], 1), np.stack([impacts for impacts, _ in columns], 1))


def _lanes(problem: _Problem, clearances: Floats, periods: int, classified: bool) -> tuple[Integers, Booleans]:
    """Return impacts and whether the motion was recognised, both of shape (lanes,)."""
    impacts, named = np.empty(len(clearances), dtype=np.int64), np.empty(len(clearances), dtype=np.bool_)
    ring = orbit(problem.initial.shape[0], LONGEST_PERIOD)
    _run_lanes(
        problem.cells, problem.held, problem.initial, clearances, 2 * periods, ring, classified, problem.work,
        impacts, named,
    )  # fmt: skip
    return impacts, named


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
    ring: Orbit,
    classified: bool,
    work: Workspace,
    impacts: Integers,
    named: Booleans,
) -> None:
    """Run lanes one after the other to their end, counting impacts; judge the orbit there if `classified`."""
    u = np.empty_like(initial)
    for lane in range(clearances.shape[0]):
        u[:] = initial
        work.cursor[:] = 0
        clear_tally(work.tally)
        if classified:
            enter(ring, 0, u, work)
        count = 0.0
        status = OK
        for half in range(halves):
            status = run_half(problem, held, u, clearances[lane], half, work)
            if status != OK:
                break
            count += work.tally[FOLLOWED]
            if classified:
                enter(ring, half + 1, u, work)
        impacts[lane] = int(count)
        named[lane] = False
        if classified and status == OK:
            reach, _ = bounds(problem, u)
            if is_free_for_ever(problem, reach, work.cursor[ANCHOR], clearances[lane]):
                named[lane] = True
            else:
                named[lane] = name_motion(problem, ring, halves, LONGEST_PERIOD, clearances[lane], reach)[0] == NAMED
