"""A column of an unfolding map: every clearance of one forcing frequency, run until its motion can be named.

The lanes of a lockstep group are a queue's workers: one whose motion is named takes the next clearance of the column,
at the start of the next forcing period. Serial on purpose: parallelism comes from processes.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels.cells import CellProblem
from grazemap_core.kernels.closing import BUDGET, NAMED, NOT_CLOSED, Orbit, name_motion
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.lane_tables import LaneTables
from grazemap_core.kernels.lanes import COLUMNS, LANES, Masses
from grazemap_core.kernels.lockstep import Lanes, begin, idle, run_half
from grazemap_core.kernels.simulate import counted, is_free_for_ever, reason_of_end
from grazemap_core.kernels.workspace import (
    ANCHOR,
    FOLLOWED,
    HELD_LEFT,
    HELD_RIGHT,
    LEAST_SPEED,
    LEAST_UNPRESSED,
    LEFT,
    OK,
    RIGHT,
    Workspace,
)
from grazemap_core.tolerances import CLOSING_GOAL, SETTLING_IMPACTS

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# columns of the codes of a motion
REASON, PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC, SETTLED_AFTER, STICKING, RUN, STRUCK = 0, 1, 2, 3, 4, 5, 6, 7, 8
"""The last two: half periods that were run, and impacts that were followed."""
CODES = 9

HALVES_BETWEEN_JUDGEMENTS = 6
"""Half periods that a lane runs on once its motion could not be named: judging it costs as much as several of them."""


@njit(cache=True, nogil=True, error_model="numpy")
def _enter(ring: Orbit, k: int, group: Lanes, used: int) -> None:
    """Enter every lane's state after k half periods and tally of the one before it; clear the tallies."""
    row = k % ring.least.shape[0]
    sign = 1.0 if k % 2 == 0 else -1.0
    first = 0 if (k - 1) % 2 == 0 else 1  # in the frame of z the stops change sides every half period
    for c in range(ring.states.shape[1]):
        for lane in range(min(used, LANES)):
            ring.states[row, c, lane] = sign * group.even[c * LANES + lane]
    for lane in range(min(used, LANES)):
        ring.impacts[row, first, lane] = group.tally[RIGHT, lane]
        ring.impacts[row, 1 - first, lane] = group.tally[LEFT, lane]
        ring.held[row, first, lane] = group.tally[HELD_RIGHT, lane]
        ring.held[row, 1 - first, lane] = group.tally[HELD_LEFT, lane]
        ring.least[row, lane] = group.tally[LEAST_SPEED, lane]
        ring.unpressed[row, lane] = group.tally[LEAST_UNPRESSED, lane]
        group.tally[RIGHT, lane] = 0.0
        group.tally[LEFT, lane] = 0.0
        group.tally[HELD_RIGHT, lane] = 0.0
        group.tally[HELD_LEFT, lane] = 0.0
        group.tally[FOLLOWED, lane] = 0.0
        group.tally[LEAST_SPEED, lane] = np.inf
        group.tally[LEAST_UNPRESSED, lane] = np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest_return(ring: Orbit, k: int, longest: int, nearest: FloatArray, used: int) -> None:
    """Write how near every lane's first coordinate is to where it was some 1 .. longest half periods ago."""
    size = ring.least.shape[0]
    row = k % size
    now = ring.states[row, 0]
    nearest[:] = np.inf
    for _ in range(longest):
        row = row - 1 if row > 0 else size - 1
        then = ring.states[row, 0]
        for lane in range(min(used, LANES)):
            nearest[lane] = min(nearest[lane], abs(then[lane] - now[lane]))


@njit(cache=True, nogil=True, error_model="numpy")
def _move(group: Lanes, ring: Orbit, source: int, target: int) -> None:
    """Move a trajectory to an idle lane, at the start of a half period."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + target] = group.even[c * LANES + source]
    group.clearance[target] = group.clearance[source]
    group.limit[target] = group.limit[source]
    group.reach[target] = group.reach[source]
    group.regime[target] = group.regime[source]
    group.status[target] = group.status[source]
    group.tally[:, target] = group.tally[:, source]
    group.cursor[target] = group.cursor[source]
    group.near[target] = group.near[source]
    group.resting[target] = group.resting[source]
    group.since[target] = group.since[source]
    for row in range(ring.least.shape[0]):
        ring.states[row, :, target] = ring.states[row, :, source]
        ring.impacts[row, :, target] = ring.impacts[row, :, source]
        ring.held[row, :, target] = ring.held[row, :, source]
        ring.least[row, target] = ring.least[row, source]
        ring.unpressed[row, target] = ring.unpressed[row, source]
    idle(group, source)


@njit(cache=True, nogil=True, error_model="numpy")
def settle_column(
    masses: Masses,
    problem: CellProblem,
    held: HeldProblem,
    tables: LaneTables,
    initial: FloatArray,
    clearances: FloatArray,
    max_periods: int,
    max_period: int,
    early: bool,
    group: Lanes,
    ring: Orbit,
    work: Workspace,
    codes: IntArray,
    least_speed: FloatArray,
) -> None:
    """Settle one trajectory per clearance, all from the state `initial` (N, 2) between the stops.

    Parameters
    ----------
    masses : tuple of length N
    early : bool
        Whether a trajectory stops once its motion can be named; otherwise all run for `max_periods`.
    group, ring, work
        Scratch; overwritten.
    codes : (n, CODES)
        Receives reason, period, impacts_right, impacts_left, symmetric, settled_after, sticking, as `simulate.settle`;
        and the half periods run and impacts followed.
    least_speed : (n,)
        Receives the least impact speed, NaN without impacts.
    """
    n = clearances.shape[0]
    point = np.full(LANES, -1)
    began = np.zeros(LANES, dtype=np.int64)
    struck = np.zeros(LANES)
    impacts = np.zeros(LANES)  # those that count toward SETTLING_IMPACTS
    near = np.zeros(LANES)
    nearest = np.zeros(LANES)
    again = np.zeros(LANES, dtype=np.int64)  # half periods after which a motion is judged again
    u = np.empty_like(initial)
    for lane in range(LANES):
        idle(group, lane)
    queued = 0
    done = 0
    # typed by hand: a literal 0 would have everything below compiled once more
    k = int(np.int64(0))
    used = int(np.int64(0))
    while done < n:
        if k % 2 == 0 and queued < n:
            row = k % ring.least.shape[0]
            for lane in range(LANES):
                if queued < n and point[lane] < 0:
                    begin(group, lane, problem, initial, clearances[queued])
                    for c in range(ring.states.shape[1]):
                        ring.states[row, c, lane] = initial[c // 2, c % 2]
                    near[lane] = CLOSING_GOAL * clearances[queued] / problem.closeness[0, 0]
                    point[lane] = queued
                    began[lane] = k
                    struck[lane] = 0.0
                    impacts[lane] = 0.0
                    again[lane] = 0
                    queued += 1
                    used = max(used, (lane + COLUMNS) // COLUMNS * COLUMNS)
        run_half(masses, problem, held, tables, group, k, used, u, work)
        k += 1
        for lane in range(used):
            struck[lane] += group.tally[FOLLOWED, lane]
            impacts[lane] += counted(problem.chatter_impacts, group.tally[FOLLOWED, lane])
        _enter(ring, k, group, used)
        if early:
            _nearest_return(ring, k, 2 * max_period, nearest, used)
        for lane in range(used):
            i = point[lane]
            if i < 0:
                continue
            entered = k - began[lane]
            last = entered == 2 * max_periods
            reason, period, right, left, symmetric, sticking = NOT_CLOSED, 0, 0, 0, False, False
            least, after = np.inf, -1
            reach = group.reach[lane]
            if group.status[lane] != OK:
                reason = reason_of_end(group.status[lane])
                last = True
            elif impacts[lane] > SETTLING_IMPACTS:
                reason = BUDGET
                last = True
            elif is_free_for_ever(problem, reach, group.cursor[lane, ANCHOR], clearances[i]) and (early or last):
                reason, period, right, left, symmetric = NAMED, 1, -1, -1, True
                after = (entered + 1) // 2
            elif last or (early and nearest[lane] <= near[lane] and entered >= again[lane]):
                reason, period, right, left, symmetric, least, sticking = name_motion(
                    problem, ring, lane, k, entered, max_period, clearances[i], reach
                )
                again[lane] = entered + HALVES_BETWEEN_JUDGEMENTS
                if reason == NAMED:
                    window = period if symmetric else 2 * period  # half periods after which z returns
                    after = max(0, (entered - 3 * window + 1) // 2)
            if not (last or reason == NAMED):
                continue
            codes[i, REASON] = reason
            codes[i, PERIOD] = period
            codes[i, IMPACTS_RIGHT] = right
            codes[i, IMPACTS_LEFT] = left
            codes[i, SYMMETRIC] = 1 if symmetric else 0
            codes[i, SETTLED_AFTER] = after
            codes[i, STICKING] = 1 if sticking else 0
            codes[i, RUN] = entered
            codes[i, STRUCK] = struck[lane]
            least_speed[i] = least if np.isfinite(least) else np.nan
            point[lane] = -1
            idle(group, lane)
            done += 1
        if queued == n and done < n and used - (n - done) >= 2 * COLUMNS:
            # nothing waits, and lanes lie idle: close the ranks
            target = 0
            for source in range(used):
                if point[source] < 0:
                    continue
                while target < source and point[target] >= 0:
                    target += 1
                if target < source:
                    _move(group, ring, source, target)
                    point[target], point[source] = point[source], -1
                    began[target] = began[source]
                    struck[target] = struck[source]
                    impacts[target] = impacts[source]
                    near[target] = near[source]
                    again[target] = again[source]
            used = (n - done + COLUMNS - 1) // COLUMNS * COLUMNS
