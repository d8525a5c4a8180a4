"""Putting a trajectory to where its returns lead, where the motion there is not to be proven.

A lane whose state comes ever closer to a periodic orbit flows in; it goes on from the limit of its returns
(`extrapolating`). There it has to stay, in the same impacts, and to close by itself before its motion is named
(`closing`); a lane that does not goes back to where it leapt from.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem, first_mass
from grazemap_core.contact.kernels.workspace import OK
from grazemap_core.maps.kernels.lane_state import (
    AT,
    BEGAN,
    CHANGED,
    DUE,
    GOAL,
    LEAPT,
    RETURNED,
    SETTLES,
    SINCE,
    ColumnTask,
    LaneRecords,
)
from grazemap_core.maps.kernels.lockstep import FREE, RESTING, Lanes, begin, put
from grazemap_core.maps.tolerances import APPROACH_RETRY, FARTHEST_LEAP, STAYED
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.kernels.verification import VerificationScratch
from grazemap_core.simulation.kernels.fixed_point_extrapolation import Extrapolation, extrapolate
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, impacts_of_two, separation
from grazemap_core.simulation.tolerances import CLOSING_GOAL

RETURNS = 3
"""After how many returns a lane is looked at that has leapt: as many as it takes to see whether they become shorter."""


@kernel
def _put_to(
    problem: CellProblem,
    scratch: VerificationScratch,
    group: Lanes,
    ring: StroboscopicHistory,
    lane: int,
    k: int,
    z: Floats,
) -> None:
    """Let a lane go on between the stops from a state in the frame of z, after k half periods."""
    sign = 1.0 if k % 2 == 0 else -1.0
    for c in range(z.shape[0]):
        scratch.start[c // 2, c % 2] = sign * z[c]
        ring.states[k % ring.min_speed.shape[0], c, lane] = z[c]
    begin(group, lane, problem, scratch.start, group.clearance[lane])
    put(group, lane, problem, scratch.start, k)


@kernel
def leap(
    problem: CellProblem,
    scratch: VerificationScratch,
    ahead: Extrapolation,
    task: ColumnTask,
    group: Lanes,
    ring: StroboscopicHistory,
    notes: LaneRecords,
    lane: int,
    k: int,
    returned: int,
    distance: float,
) -> None:
    """Put a lane to where its returns lead, if that can be told.

    Parameters
    ----------
    k, returned : int
        Half periods done, an even number, and those after which the lane returns.
    distance : float
        `closing.orbit_nearby`.
    """
    counts, sizes, clearance = notes.counts[lane], notes.sizes[lane], group.clearance[lane]
    entered = k - counts[BEGAN]
    if group.regime[lane] != FREE or entered + RETURNS * returned >= 2 * task.max_periods - task.growth_halves:
        return
    far = extrapolate(problem, ring, ahead, lane, k, returned, k - counts[SINCE])
    if not far <= FARTHEST_LEAP * distance * clearance:
        return
    for j in range(scratch.start.shape[0]):
        scratch.start[j, 0], scratch.start[j, 1] = ahead.limit[2 * j], ahead.limit[2 * j + 1]
    x, _ = first_mass(problem, scratch.start, problem.steady_table[0, 0], problem.steady_table[0, 1])
    if not abs(x) < clearance:
        return
    for c in range(ahead.limit.shape[0]):
        notes.left[lane, c] = ring.states[k % ring.min_speed.shape[0], c, lane]
    sizes[CHANGED] = separation(problem, ring, lane, k, returned, clearance, np.inf)
    _put_to(problem, scratch, group, ring, lane, k, ahead.limit)
    counts[AT], counts[DUE], counts[SINCE], counts[RETURNED] = LEAPT, k + RETURNS * returned, k, returned


@kernel
def land(
    problem: CellProblem,
    scratch: VerificationScratch,
    task: ColumnTask,
    group: Lanes,
    ring: StroboscopicHistory,
    notes: LaneRecords,
    lane: int,
    k: int,
) -> bool:
    """Let a lane that has leapt go on from there if it stays there in the same impacts, else from where it was.

    Returns whether it stays. RETURNS of them have passed since, and k half periods in all.
    """
    counts, sizes, m = notes.counts[lane], notes.sizes[lane], notes.counts[lane, RETURNED]
    counts[AT], counts[DUE] = SETTLES, counts[BEGAN] + 2 * task.max_periods
    if group.status[lane] == OK and group.regime[lane] != RESTING:
        alike, _, _ = impacts_of_two(ring, lane, k, m)
        as_before, _, _ = impacts_of_two(ring, lane, counts[SINCE] + m, m)
        now = separation(problem, ring, lane, k, m, group.clearance[lane], np.inf)
        if alike and as_before and now < STAYED * sizes[CHANGED]:
            return True
    _put_to(problem, scratch, group, ring, lane, k, notes.left[lane])
    counts[SINCE], counts[RETURNED] = k, 0
    sizes[GOAL] = max(APPROACH_RETRY * sizes[GOAL], CLOSING_GOAL)
    return False


@kernel
def has_just_landed(notes: LaneRecords, lane: int, k: int) -> bool:
    """Say whether a lane has leapt RETURNS ago, and stayed."""
    returned = notes.counts[lane, RETURNED]
    landed: bool = returned > 0 and k == notes.counts[lane, SINCE] + RETURNS * returned
    return landed
