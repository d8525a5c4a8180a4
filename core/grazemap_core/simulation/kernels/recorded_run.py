"""A trajectory with a record of its events, half period by half period."""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import run_half
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import OK, RECORD_FULL, ROWS, UNDECIDED, Workspace
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, record_half_period


@njit(cache=True, nogil=True, error_model="numpy")
def run_recorded(
    problem: CellProblem,
    held: HeldProblem,
    u: Floats,
    clearance: float,
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
    start = np.empty_like(u)
    resting = np.empty_like(held.state)
    cursor = np.empty_like(work.cursor)
    floats = np.empty(5)
    for half in range(halves_done, halves):
        start[:] = u
        resting[:] = held.state
        cursor[:] = work.cursor
        floats[:2] = work.near[:2]
        floats[2:4] = held.since
        floats[4] = work.tally[UNDECIDED]
        status = run_half(problem, held, u, clearance, half, work)
        if work.cursor[ROWS] > work.events.shape[0]:
            u[:] = start
            held.state[:] = resting
            work.cursor[:] = cursor
            work.near[:2] = floats[:2]
            held.since[:] = floats[2:4]
            work.tally[UNDECIDED] = floats[4]
            return RECORD_FULL, half
        if status != OK:
            return status, half
        record_half_period(ring, half + 1, u, work)
    return OK, halves
