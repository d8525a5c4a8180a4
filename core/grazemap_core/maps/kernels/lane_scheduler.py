"""A column of an unfolding map: every clearance of one forcing frequency, run until its motion can be named.

The lanes of a lockstep group are a queue's workers: one whose motion is named takes the next trajectory of the column,
at the start of the next forcing period. Serial on purpose: parallelism comes from processes.

What becomes of a lane is said in `judging`. A sweep, in which every trajectory begins where the last one ended, is a
queue with one worker.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem, first_mass
from grazemap_core.contact.kernels.half_period import counted
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import FOLLOWED as TALLIED
from grazemap_core.contact.kernels.workspace import (
    HELD_LEFT,
    HELD_RIGHT,
    LEFT,
    MIN_SPEED,
    MIN_UNPRESSED_SPEED,
    OK,
    RIGHT,
    ROWS,
    Workspace,
)
from grazemap_core.contact.tolerances import CLEARED
from grazemap_core.maps.kernels.classification import begin_growths, judge, make_room
from grazemap_core.maps.kernels.lane_state import (
    AT,
    BEGAN,
    COUNTED,
    DUE,
    FOLLOWED,
    GOAL,
    GROWS,
    LEAVES,
    LOOK,
    POINT,
    RUN,
    SETTLES,
    SINCE,
    STRUCK,
    ColumnTask,
    Found,
    LaneRecords,
    enter_lane,
    lane_records,
)
from grazemap_core.maps.kernels.lane_tables import LaneTables
from grazemap_core.maps.kernels.lane_tangents import (
    NOTHING,
    LaneTangents,
    carry_lanes,
    keep,
    move_changes,
)
from grazemap_core.maps.kernels.lanes import COLUMNS, LANES, Masses
from grazemap_core.maps.kernels.lockstep import RESTING, Lanes, begin, begin_on_stop, idle, run_half
from grazemap_core.maps.tolerances import GROWTH_SKIPPED, SETTLING_IMPACTS
from grazemap_core.numerics.jit.by_reference import reference
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel
from grazemap_core.orbits.kernels.verification import ImpulseBlocks, VerificationScratch
from grazemap_core.simulation.kernels.fixed_point_extrapolation import Extrapolation, extrapolation
from grazemap_core.simulation.kernels.period_detection import ReturnSearch, StroboscopicHistory, nearest_returns
from grazemap_core.simulation.tolerances import CLOSING_GOAL

HALVES_BETWEEN_LOOKS = 6
"""Half periods between looks for returns: one costs as much as one of them. An even number, so that trajectories, which
begin with a look, begin with a forcing period."""


class Queue(NamedTuple):
    """Scratch of a column.

    Attributes
    ----------
    notes : Notes
    ahead : Extrapolation
    bound, enough, known, length, nearest, distance : (LANES,)
        As in `closing.nearest_returns`.
    u, handed_on : (N, 2)
    """

    notes: LaneRecords
    ahead: Extrapolation
    bound: Floats
    enough: Floats
    known: Floats
    length: Floats
    nearest: Floats
    distance: Floats
    u: Floats
    handed_on: Floats


def queue(masses: int) -> Queue:
    """Return fresh scratch for an oscillator."""
    return Queue(
        notes=lane_records(masses),
        ahead=extrapolation(masses),
        bound=np.zeros(LANES),
        enough=np.zeros(LANES),
        known=np.zeros(LANES),
        length=np.zeros(LANES),
        nearest=np.zeros(LANES),
        distance=np.zeros(LANES),
        u=np.zeros((masses, 2)),
        handed_on=np.zeros((masses, 2)),
    )


@kernel
def _enter(ring: StroboscopicHistory, k: int, group: Lanes, used: int) -> None:
    """Enter every lane's state after k half periods and tally of the one before it; clear the tallies."""
    states, impacts, held, least, unpressed = (
        ring.states,
        ring.impacts,
        ring.held,
        ring.min_speed,
        ring.min_unpressed_speed,
    )
    even, tally = group.even, group.tally
    row = k % least.shape[0]
    sign = 1.0 if k % 2 == 0 else -1.0
    first = 0 if (k - 1) % 2 == 0 else 1  # in the frame of z the stops change sides every half period
    for c in range(states.shape[1]):
        for lane in range(min(used, LANES)):
            states[row, c, lane] = sign * even[c * LANES + lane]
    for lane in range(min(used, LANES)):
        impacts[row, first, lane] = tally[RIGHT, lane]
        impacts[row, 1 - first, lane] = tally[LEFT, lane]
        held[row, first, lane] = tally[HELD_RIGHT, lane]
        held[row, 1 - first, lane] = tally[HELD_LEFT, lane]
        least[row, lane] = tally[MIN_SPEED, lane]
        unpressed[row, lane] = tally[MIN_UNPRESSED_SPEED, lane]
        tally[RIGHT, lane] = 0.0
        tally[LEFT, lane] = 0.0
        tally[HELD_RIGHT, lane] = 0.0
        tally[HELD_LEFT, lane] = 0.0
        tally[TALLIED, lane] = 0.0
        tally[MIN_SPEED, lane] = np.inf
        tally[MIN_UNPRESSED_SPEED, lane] = np.inf


@kernel
def _move(group: Lanes, ring: StroboscopicHistory, source: int, target: int) -> None:
    """Move a trajectory to an idle lane, at the start of a half period."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + target] = group.even[c * LANES + source]
    group.clearance[target] = group.clearance[source]
    group.limit[target] = group.limit[source]
    group.reach[target] = group.reach[source]
    group.regime[target] = group.regime[source]
    group.status[target] = group.status[source]
    copy_vector(group.tally[:, target], group.tally[:, source])
    copy_vector(group.cursor[target], group.cursor[source])
    copy_vector(group.near[target], group.near[source])
    copy_matrix(group.resting[target], group.resting[source])
    copy_vector(group.since[target], group.since[source])
    for row in range(min(group.cursor[source, ROWS], group.events.shape[1])):
        copy_vector(group.events[target, row], group.events[source, row])
    for row in range(ring.min_speed.shape[0]):
        copy_vector(ring.states[row, :, target], ring.states[row, :, source])
        copy_vector(ring.impacts[row, :, target], ring.impacts[row, :, source])
        copy_vector(ring.held[row, :, target], ring.held[row, :, source])
        ring.min_speed[row, target] = ring.min_speed[row, source]
        ring.min_unpressed_speed[row, target] = ring.min_unpressed_speed[row, source]
    idle(group, source)


@kernel
def _take_place(
    group: Lanes, lane: int, problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, rested: bool
) -> None:
    """Begin at the state u in which another trajectory ended, moved onto the stop where it is beyond it.

    Mass 1 bounces off that stop at once if it moves into it, or stands on it if it was at rest (`rested`). u is
    overwritten.
    """
    x, v = first_mass(problem, u, problem.steady_table[0, 0], problem.steady_table[0, 1])
    if abs(x) < clearance:
        begin(group, lane, problem, u, clearance)
        return
    stop = 1 if x > 0.0 else -1
    unit_impulse = 0.0
    if rested:
        unit_impulse = -v
    elif stop * v > 0.0:
        unit_impulse = -(1.0 + problem.restitution) * v
    count = u.shape[0]
    for j in range(count):
        for c in range(2):
            u[j, c] += (
                held.to_free[2 * j + c, 0] * (stop * clearance - x) + held.to_free[2 * j + c, count] * unit_impulse
            )
    begin_on_stop(group, lane, problem, u, clearance, stop)


@kernel
def settle_column(
    masses: Masses,
    problem: CellProblem,
    held: HeldProblem,
    tables: LaneTables,
    chain: ImpulseBlocks,
    task: ColumnTask,
    group: Lanes,
    ring: StroboscopicHistory,
    changes: LaneTangents,
    work: Workspace,
    proving: VerificationScratch,
    scratch: Queue,
    found: Found,
) -> None:
    """Settle all trajectories of a column.

    Parameters
    ----------
    masses : tuple of length N
    group, ring, changes, work, proving, scratch
        Scratch; overwritten. Lanes and work with room for RECORD events, or for none when neither proofs nor growth are
        wanted; changes with room for job.growth_halves.
    found : Found
        Receives the result.
    """
    problem, held, tables, task = reference(problem), reference(held), reference(tables), reference(task)
    group, ring, changes, work = reference(group), reference(ring), reference(changes), reference(work)
    chain, proving, scratch, found = reference(chain), reference(proving), reference(scratch), reference(found)
    codes = found.codes
    growth_halves = task.growth_halves
    starts = task.directions.shape[0]
    n = task.clearances.shape[0] * starts
    linearised = growth_halves > 0
    skipped = 2 * (growth_halves // GROWTH_SKIPPED)
    notes, counts, sizes = scratch.notes, scratch.notes.counts, scratch.notes.sizes
    bound, enough, known, length = scratch.bound, scratch.enough, scratch.known, scratch.length
    nearest, distance = scratch.nearest, scratch.distance
    u, handed_on = scratch.u, scratch.handed_on
    for lane in range(LANES):
        idle(group, lane)
        counts[lane, POINT] = -1
        counts[lane, AT] = LEAVES
        changes.carried[lane] = NOTHING
    queued = 0
    done = 0
    workers = 1 if task.follow else LANES
    # typed by hand: a literal 0 would have everything below compiled once more
    k = int(np.int64(0))
    used = int(np.int64(0))
    rested = used > 0
    while done < n:
        if k % HALVES_BETWEEN_LOOKS == 0 and queued < n:
            for lane in range(workers):
                if queued < n and counts[lane, POINT] < 0:
                    clearance = task.clearances[queued // starts]
                    if task.follow and queued > 0:
                        copy_matrix(u, handed_on)
                        _take_place(group, lane, problem, held, u, clearance, rested)
                    else:
                        for j in range(u.shape[0]):
                            for c in range(2):
                                u[j, c] = task.base[j, c] + clearance * task.directions[queued % starts, j, c]
                        begin(group, lane, problem, u, clearance)
                    enter_lane(notes, lane, queued, k, task, chain.verifiable)
                    queued += 1
                    used = max(used, (lane + COLUMNS) // COLUMNS * COLUMNS)
        make_room(group, notes, k, used)
        if linearised:
            begin_growths(problem, changes, notes, k, task, used)
            keep(group, changes, used)
        run_half(masses, problem, held, tables, group, k, used, u, work)
        if linearised:
            carry_lanes(problem, held, group, changes, k, skipped, used, u)
        k += 1
        for lane in range(used):
            sizes[lane, FOLLOWED] += group.tally[TALLIED, lane]
            sizes[lane, COUNTED] += counted(problem.chatter_impacts, group.tally[TALLIED, lane])
        _enter(ring, k, group, used)
        look = task.early and k % HALVES_BETWEEN_LOOKS == 0
        if look:
            for lane in range(used):
                wanted = counts[lane, POINT] >= 0 and k >= counts[lane, LOOK]
                bound[lane] = sizes[lane, GOAL] * group.clearance[lane] if wanted else -1.0
                enough[lane] = CLOSING_GOAL * group.clearance[lane]
                known[lane] = k - counts[lane, SINCE]
            search = ReturnSearch(bound, enough, known, length, nearest, distance)
            nearest_returns(problem, ring, k, 2 * task.max_period, search, used)
        for lane in range(used):
            if counts[lane, POINT] < 0:
                continue
            if k < counts[lane, DUE] and group.status[lane] == OK:
                if counts[lane, AT] != SETTLES and counts[lane, AT] != GROWS:
                    continue
                closes = look and length[lane] > 0.0
                free = task.early and group.reach[lane] < CLEARED * group.clearance[lane]
                if not (closes or free or sizes[lane, COUNTED] > SETTLING_IMPACTS):
                    continue
            returned = int(length[lane]) if look else 0
            closed = look and nearest[lane] <= enough[lane]
            if not judge(
                problem,
                held,
                chain,
                proving,
                scratch.ahead,
                task,
                group,
                ring,
                changes,
                notes,
                lane,
                k,
                returned,
                closed,
                skipped,
                found,
            ):
                continue
            if task.follow:
                rested = group.regime[lane] == RESTING
                for j in range(u.shape[0]):
                    handed_on[j, 0] = group.even[2 * j * LANES + lane]
                    handed_on[j, 1] = group.even[(2 * j + 1) * LANES + lane]
                if group.status[lane] != OK:
                    copy_matrix(handed_on, task.base)
                    rested = False
            codes[counts[lane, POINT], RUN] = k - counts[lane, BEGAN]
            codes[counts[lane, POINT], STRUCK] = int(sizes[lane, FOLLOWED])
            counts[lane, POINT] = -1
            counts[lane, AT] = LEAVES
            changes.carried[lane] = NOTHING
            idle(group, lane)
            done += 1
            if task.follow:
                k = int(np.int64(0))  # the next one begins at once
        if queued == n and done < n and used >= 2 * max(n - done, COLUMNS):
            # nothing waits, and lanes lie idle: those furthest out take their places
            target, source = 0, used - 1
            while True:
                while target < used and counts[target, POINT] >= 0:
                    target += 1
                while source >= 0 and counts[source, POINT] < 0:
                    source -= 1
                if target >= source:
                    break
                _move(group, ring, source, target)
                if linearised:
                    move_changes(changes, source, target)
                copy_vector(counts[target], counts[source])
                copy_vector(sizes[target], sizes[source])
                copy_vector(notes.left[target], notes.left[source])
                counts[source, POINT] = -1
                counts[source, AT] = LEAVES
            used = (n - done + COLUMNS - 1) // COLUMNS * COLUMNS
