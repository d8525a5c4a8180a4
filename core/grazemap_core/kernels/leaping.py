"""Putting a trajectory to where its returns lead, where the motion there is not to be proven.

A lane whose state comes ever closer to a periodic orbit flows in; it goes on from the limit of its returns
(`extrapolating`). There it has to stay, in the same impacts, and to close by itself before its motion is named
(`closing`); a lane that does not goes back to where it leapt from.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.kernels.cells import CellProblem, first_mass
from grazemap_core.kernels.closing import Orbit, impacts_of_two, separation
from grazemap_core.kernels.compiled import kernel
from grazemap_core.kernels.extrapolating import Extrapolation, extrapolate
from grazemap_core.kernels.lane_notes import (
    AT,
    BEGAN,
    CHANGED,
    DUE,
    GOAL,
    LEAPT,
    RETURNED,
    SETTLES,
    SINCE,
    FloatArray,
    Job,
    Notes,
)
from grazemap_core.kernels.lockstep import FREE, RESTING, Lanes, begin, put
from grazemap_core.kernels.proving import Proving
from grazemap_core.kernels.workspace import OK
from grazemap_core.tolerances import APPROACH_RETRY, CLOSING_GOAL, FARTHEST_LEAP, STAYED

RETURNS = 3
"""After how many returns a lane is looked at that has leapt: as many as it takes to see whether they become shorter."""


@kernel
def _put_to(problem: CellProblem, room: Proving, group: Lanes, ring: Orbit, lane: int, k: int, z: FloatArray) -> None:
    """Let a lane go on between the stops from a state in the frame of z, after k half periods."""
    sign = 1.0 if k % 2 == 0 else -1.0
    for c in range(z.shape[0]):
        room.start[c // 2, c % 2] = sign * z[c]
        ring.states[k % ring.least.shape[0], c, lane] = z[c]
    begin(group, lane, problem, room.start, group.clearance[lane])
    put(group, lane, problem, room.start, k)


@kernel
def leap(
    problem: CellProblem,
    room: Proving,
    ahead: Extrapolation,
    job: Job,
    group: Lanes,
    ring: Orbit,
    notes: Notes,
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
    if group.regime[lane] != FREE or entered + RETURNS * returned >= 2 * job.max_periods - job.growth_halves:
        return
    far = extrapolate(problem, ring, ahead, lane, k, returned, k - counts[SINCE])
    if not far <= FARTHEST_LEAP * distance * clearance:
        return
    for j in range(room.start.shape[0]):
        room.start[j, 0], room.start[j, 1] = ahead.limit[2 * j], ahead.limit[2 * j + 1]
    x, _ = first_mass(problem, room.start, problem.gain[0, 0], problem.gain[0, 1])
    if not abs(x) < clearance:
        return
    for c in range(ahead.limit.shape[0]):
        notes.left[lane, c] = ring.states[k % ring.least.shape[0], c, lane]
    sizes[CHANGED] = separation(problem, ring, lane, k, returned, clearance, np.inf)
    _put_to(problem, room, group, ring, lane, k, ahead.limit)
    counts[AT], counts[DUE], counts[SINCE], counts[RETURNED] = LEAPT, k + RETURNS * returned, k, returned


@kernel
def land(
    problem: CellProblem, room: Proving, job: Job, group: Lanes, ring: Orbit, notes: Notes, lane: int, k: int
) -> bool:
    """Let a lane that has leapt go on from there if it stays there in the same impacts, else from where it was.

    Returns whether it stays. RETURNS of them have passed since, and k half periods in all.
    """
    counts, sizes, m = notes.counts[lane], notes.sizes[lane], notes.counts[lane, RETURNED]
    counts[AT], counts[DUE] = SETTLES, counts[BEGAN] + 2 * job.max_periods
    if group.status[lane] == OK and group.regime[lane] != RESTING:
        alike, _, _ = impacts_of_two(ring, lane, k, m)
        as_before, _, _ = impacts_of_two(ring, lane, counts[SINCE] + m, m)
        now = separation(problem, ring, lane, k, m, group.clearance[lane], np.inf)
        if alike and as_before and now < STAYED * sizes[CHANGED]:
            return True
    _put_to(problem, room, group, ring, lane, k, notes.left[lane])
    counts[SINCE], counts[RETURNED] = k, 0
    sizes[GOAL] = max(APPROACH_RETRY * sizes[GOAL], CLOSING_GOAL)
    return False


@kernel
def has_just_landed(notes: Notes, lane: int, k: int) -> bool:
    """Say whether a lane has leapt RETURNS ago, and stayed."""
    returned = notes.counts[lane, RETURNED]
    landed: bool = returned > 0 and k == notes.counts[lane, SINCE] + RETURNS * returned
    return landed
