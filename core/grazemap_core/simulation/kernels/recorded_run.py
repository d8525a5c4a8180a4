"""A trajectory with a record of its events, half period by half period."""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.kernels.workspace import EVENT_COUNT, OK, RECORD_FULL, UNDECIDED, Workspace
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, record_half_period


class HalfPeriod(NamedTuple):
    """The state at the start of a half period, so that it can be repeated."""

    state: Floats
    """(N, 2) The free state."""
    resting: Floats
    """(N - 1, 2) The held state."""
    cursor: Integers
    """(4,) As in `workspace.Workspace`."""
    floats: Floats
    """(6,) The first three entries of `near`, `HeldProblem.since`, and the number of undecided events."""


def half_period(blocks: int) -> HalfPeriod:
    """Return new scratch for an oscillator of `blocks` masses."""
    return HalfPeriod(
        state=np.zeros((blocks, 2)),
        resting=np.zeros((blocks - 1, 2)),
        cursor=np.zeros(4, dtype=np.int64),
        floats=np.zeros(6),
    )


@kernel
def save_start(began: HalfPeriod, held: HeldProblem, u: Floats, work: Workspace) -> None:
    """Save the state and the regime of a trajectory."""
    copy_matrix(began.state, u)
    copy_matrix(began.resting, held.state)
    copy_vector(began.cursor, work.cursor)
    copy_vector(began.floats[:3], work.near)
    copy_vector(began.floats[3:5], held.since)
    began.floats[5] = work.tally[UNDECIDED]


@kernel
def restore_start(began: HalfPeriod, held: HeldProblem, u: Floats, work: Workspace) -> None:
    """Restore what `save_start` saved."""
    copy_matrix(u, began.state)
    copy_matrix(held.state, began.resting)
    copy_vector(work.cursor, began.cursor)
    copy_vector(work.near[:3], began.floats)
    copy_vector(held.since, began.floats[3:5])
    work.tally[UNDECIDED] = began.floats[5]


@njit(cache=True, nogil=True, error_model="numpy")
def run_recorded(
    problem: CellProblem,
    held: HeldProblem,
    stops: Stops,
    u: Floats,
    halves_done: int,
    halves: int,
    ring: StroboscopicHistory,
    work: Workspace,
) -> tuple[int, int]:
    """Advance a state to `halves` half periods, with events recorded in work.events and half periods in the ring.

    The caller sets work.cursor and records half period 0 before the first call.

    Returns
    -------
    status : OK, RECORD_FULL when the record must be enlarged, or the status with which the trajectory ended.
    done : int
        Half periods completed. With RECORD_FULL u is the state after these, otherwise that at the end.
    """
    began = HalfPeriod(np.empty_like(u), np.empty_like(held.state), np.empty_like(work.cursor), np.empty(6))
    for half in range(halves_done, halves):
        save_start(began, held, u, work)
        status = run_half(problem, held, stops, u, half, work)
        if work.cursor[EVENT_COUNT] > work.events.shape[0]:
            restore_start(began, held, u, work)
            return RECORD_FULL, half
        if status != OK:
            return status, half
        record_half_period(ring, half + 1, u, work)
    return OK, halves
