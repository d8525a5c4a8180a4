"""A trajectory with a record of its events, half period by half period."""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import Forced
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.runs import EVENT_COUNT, OK, RECORD_FULL, UNDECIDED, Run
from grazemap_core.contact.kernels.stops import Stops
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
    """(4,) As in `runs.Run`."""
    floats: Floats
    """(6,) The first three entries of `near`, `HeldRun.since`, and the number of undecided events."""


def half_period(blocks: int) -> HalfPeriod:
    """Return new scratch for an oscillator of `blocks` masses."""
    return HalfPeriod(
        state=np.zeros((blocks, 2)),
        resting=np.zeros((blocks - 1, 2)),
        cursor=np.zeros(4, dtype=np.int64),
        floats=np.zeros(6),
    )


@kernel
def save_start(began: HalfPeriod, run: Run) -> None:
    """Save the state and the regime of a trajectory."""
    copy_matrix(began.state, run.u)
    copy_matrix(began.resting, run.held.state)
    copy_vector(began.cursor, run.cursor)
    copy_vector(began.floats[:3], run.near)
    copy_vector(began.floats[3:5], run.held.since)
    began.floats[5] = run.tally[UNDECIDED]


@kernel
def restore_start(began: HalfPeriod, run: Run) -> None:
    """Restore what `save_start` saved."""
    copy_matrix(run.u, began.state)
    copy_matrix(run.held.state, began.resting)
    copy_vector(run.cursor, began.cursor)
    copy_vector(run.near[:3], began.floats)
    copy_vector(run.held.since, began.floats[3:5])
    run.tally[UNDECIDED] = began.floats[5]


@njit(cache=True, nogil=True, error_model="numpy")
def run_recorded(
    forced: Forced, stops: Stops, run: Run, halves_done: int, halves: int, ring: StroboscopicHistory
) -> tuple[int, int]:
    """Advance a run to `halves` half periods, with events recorded in run.events and half periods in the ring.

    The caller sets run.cursor and records half period 0 before the first call.

    Returns
    -------
    status : OK, RECORD_FULL when the record must be enlarged, or the status with which the trajectory ended.
    done : int
        Half periods completed. With RECORD_FULL the state is that after these, otherwise that at the end.
    """
    began = HalfPeriod(np.empty_like(run.u), np.empty_like(run.held.state), np.empty_like(run.cursor), np.empty(6))
    for half in range(halves_done, halves):
        save_start(began, run)
        status = run_half(forced, stops, run, half)
        if run.cursor[EVENT_COUNT] > run.events.shape[0]:
            restore_start(began, run)
            return RECORD_FULL, half
        if status != OK:
            return status, half
        record_half_period(ring, half + 1, run)
    return OK, halves
