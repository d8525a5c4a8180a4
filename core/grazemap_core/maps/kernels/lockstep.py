"""Many trajectories of one oscillator at one forcing frequency in lockstep, cell after cell.

All lanes are in the same cell of the same half period; each has its own clearance, state and regime. Cells without a
contact, and those with one impact that can be certified, are done for all lanes at once (`lanes`). Lanes that need more
(several impacts on one stop, a slow bounce, a close passage) go through a second pass together (`bounces`). What is
left (rest on a stop, a graze to within round-off, both stops in one cell) goes through the cell by itself, as a
trajectory on its own would (`walk`, `sticking`), and is back in step at the cell's end.

A lane gets the same bytes whatever the others do.
"""

# Handing a tuple of many arrays to a function, or looking up an array in it, costs as much as an impact: what is done
# once per impact is inlined and works on arrays that were looked up before.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.cells import (
    CellProblem,
    bounds,
    first_acceleration,
    first_mass,
    flow_state,
    steady_motion_at,
)
from grazemap_core.contact.kernels.event_loop import may_rest, run_cell
from grazemap_core.contact.kernels.sticking import rest_in_cell, write_free_state
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import (
    ANCHOR,
    AT_STOP,
    EVENT_COLUMNS,
    FOLLOWED,
    HALF,
    HELD,
    IMPACT,
    KIND,
    LEFT,
    MIN_SPEED,
    MIN_UNPRESSED_SPEED,
    OK,
    RIGHT,
    ROOTS,
    ROWS,
    STOP,
    TALLY_SIZE,
    TIME,
    VELOCITY,
    Workspace,
)
from grazemap_core.contact.tolerances import ANCHORED_GAP, CONTACT_ROUNDING
from grazemap_core.maps.kernels import lanes as rows
from grazemap_core.maps.kernels import multi_impact_cell
from grazemap_core.maps.kernels.lane_tables import LaneTables
from grazemap_core.maps.kernels.lanes import (
    LANES,
    VECTOR,
    Columns,
    Masses,
    advance,
    columns,
    refresh_limits,
    solve_impacts,
)
from grazemap_core.maps.kernels.multi_impact_cell import WIDTH
from grazemap_core.numerics.jit.by_reference import reference
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, inlined, kernel, plain

OUT_OF_REACH = 1e300
"""Clearance of a lane out of use; finite, because differences of infinities are not."""

FREE, NEAR, RESTING = 0, 1, 2
"""Regimes at the boundary of a cell."""
LEAVING, STEPPING = 3, 4
"""Within a cell: on the way to be NEAR, or FREE, at its end."""

CONTACT_ACCELERATION = KIND + 1
"""Column of a lane's events behind those of `workspace`: acceleration of mass 1 toward the stop behind an impact."""
LANE_EVENT_COLUMNS = KIND + 2


class Lanes(NamedTuple):
    """Where every lane stands; LANES of each, one after the other.

    Attributes
    ----------
    even, odd : ((2 N + 2) * LANES,)
        State: (u, u') of every block, x1 and v1. They take turns as the start and the end of a cell; a half period
        begins, and ends, with `even`.
    clearance, limit, reach : (LANES,)
        The clearance; what bounds of |x1| must stay below for a cell to be clear; bound of |x1| for all time to come.
    tally : (TALLY_SIZE, LANES)
        As in `workspace.Workspace`.
    regime : (LANES,)
        FREE between the stops, NEAR a stop that mass 1 has just left, RESTING on one.
    cursor, near, resting, since : (LANES, 4), (LANES, 3), (LANES, N - 1, 2), (LANES, 2)
        The regime of a lane that is not free, as in `workspace.Workspace` and `held.HeldProblem`.
    status : (LANES,)
        OK, or why the trajectory ended.
    events : (LANES, capacity, LANE_EVENT_COLUMNS)
        First columns as in `workspace`, and PRESSING. Those since the trajectory began, or since whoever runs the lanes
        emptied them (`cursor`); beyond the capacity they are counted only.
    waiting, alone, offset : (LANES,), (LANES, 2 N), (LANES,)
        Lanes that must go through the present cell by themselves; (u, u') and the time in the cell where they begin.
    flags, chosen, beside, tile_lane, active, columns, tile
        Scratch.
    """

    even: Floats
    odd: Floats
    clearance: Floats
    limit: Floats
    reach: Floats
    tally: Floats
    regime: Integers
    cursor: Integers
    near: Floats
    resting: Floats
    since: Floats
    status: Integers
    events: Floats
    waiting: Integers
    alone: Floats
    offset: Floats
    flags: Integers
    chosen: Integers
    beside: Integers
    tile_lane: Integers
    active: Integers
    columns: Columns
    tile: multi_impact_cell.Tile


def lanes(masses: int, events: int = 0) -> Lanes:
    """Return idle lanes for an oscillator, with room for so many events of each."""
    return Lanes(
        even=np.zeros((2 * masses + 2) * LANES),
        odd=np.zeros((2 * masses + 2) * LANES),
        clearance=np.full(LANES, OUT_OF_REACH),
        limit=np.full(LANES, OUT_OF_REACH),
        reach=np.zeros(LANES),
        tally=np.zeros((TALLY_SIZE, LANES)),
        regime=np.zeros(LANES, dtype=np.int64),
        cursor=np.zeros((LANES, 4), dtype=np.int64),
        near=np.zeros((LANES, 3)),
        resting=np.zeros((LANES, masses - 1, 2)),
        since=np.zeros((LANES, 2)),
        status=np.zeros(LANES, dtype=np.int64),
        events=np.zeros((LANES, events, LANE_EVENT_COLUMNS)),
        waiting=np.zeros(LANES, dtype=np.int64),
        alone=np.zeros((LANES, 2 * masses)),
        offset=np.zeros(LANES),
        flags=np.zeros(LANES, dtype=np.int64),
        chosen=np.zeros(LANES + 1, dtype=np.int64),
        beside=np.zeros(LANES, dtype=np.int64),
        tile_lane=np.zeros(WIDTH, dtype=np.int64),
        active=np.zeros(WIDTH, dtype=np.int64),
        columns=columns(masses),
        tile=multi_impact_cell.tile(masses),
    )


@kernel
def idle(group: Lanes, lane: int) -> None:
    """Put a lane out of use: at rest, and out of reach of any stop."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + lane] = 0.0
        group.odd[c * LANES + lane] = 0.0
    group.clearance[lane] = OUT_OF_REACH
    group.limit[lane] = OUT_OF_REACH
    group.regime[lane] = FREE


@kernel
def _limit(problem: CellProblem, u: Floats, clearance: float) -> float:
    """Return what the Bernstein coefficients of |x1| must stay below for a cell to be clear (`contact.is_clear`)."""
    reach, fourth = bounds(problem, u)
    square = problem.step * problem.step
    return clearance - CONTACT_ROUNDING * (reach + clearance) - square * square / 384.0 * fourth


@kernel
def put(group: Lanes, lane: int, problem: CellProblem, u: Floats, half: int) -> None:
    """Put a lane between the stops to another state u (N, 2) there, at the start of a half period."""
    blocks = u.shape[0]
    boundary = half % 2 * (problem.cells // 2)
    x, v = first_mass(problem, u, problem.steady_table[boundary, 0], problem.steady_table[boundary, 1])
    for j in range(blocks):
        group.even[2 * j * LANES + lane] = u[j, 0]
        group.even[(2 * j + 1) * LANES + lane] = u[j, 1]
    group.even[2 * blocks * LANES + lane] = x
    group.even[(2 * blocks + 1) * LANES + lane] = v
    group.reach[lane] = bounds(problem, u)[0]
    group.limit[lane] = _limit(problem, u, group.clearance[lane])


@kernel
def begin(group: Lanes, lane: int, problem: CellProblem, u: Floats, clearance: float) -> None:
    """Start a trajectory between the stops in a lane, at the start of an even half period: u (N, 2) at phase 0."""
    group.clearance[lane] = clearance
    put(group, lane, problem, u, plain(0))
    group.regime[lane] = FREE
    group.cursor[lane] = 0
    group.status[lane] = OK
    group.tally[:, lane] = 0.0
    group.tally[MIN_SPEED, lane] = np.inf
    group.tally[MIN_UNPRESSED_SPEED, lane] = np.inf


@kernel
def begin_on_stop(group: Lanes, lane: int, problem: CellProblem, u: Floats, clearance: float, stop: int) -> None:
    """Start a trajectory with mass 1 on a stop in a lane, not moving into it, at the start of an even half period."""
    begin(group, lane, problem, u, clearance)
    _, v = first_mass(problem, u, problem.steady_table[0, 0], problem.steady_table[0, 1])
    leaving = max(0.0, -stop * v)
    contact_acceleration = stop * first_acceleration(problem, u, problem.steady_table[0, 1])
    group.cursor[lane, ANCHOR] = stop
    group.cursor[lane, ROOTS] = 1 if leaving > 0.0 else 2
    group.near[lane, 0] = 0.0
    group.near[lane, 1] = leaving
    group.regime[lane] = RESTING  # it goes through its first cell alone
    group.limit[lane] = -np.inf
    if may_rest(problem.restitution, problem.step, contact_acceleration, leaving):
        group.status[lane] = AT_STOP


@inlined
def _enter_impact(
    tally: Floats,
    cursor: Integers,
    events: Floats,
    lane: int,
    half: int,
    cell_start: float,
    after: float,
    side: float,
    speed: float,
    contact_acceleration: float,
) -> None:
    """Enter an impact into a lane's tally, and into its events; where there is no room it is only counted.

    `cell_start` is the time from the start of the half period to that of the cell, `after` from there to the impact.
    """
    tally[RIGHT if side > 0.0 else LEFT, lane] += 1.0
    tally[FOLLOWED, lane] += 1.0
    tally[MIN_SPEED, lane] = min(tally[MIN_SPEED, lane], speed)
    if contact_acceleration <= 0.0:
        tally[MIN_UNPRESSED_SPEED, lane] = min(tally[MIN_UNPRESSED_SPEED, lane], speed)
    row = cursor[lane, ROWS]
    if row < events.shape[1]:
        events[lane, row, HALF] = half
        events[lane, row, TIME] = cell_start + after
        events[lane, row, STOP] = side
        events[lane, row, VELOCITY] = side * speed
        events[lane, row, KIND] = IMPACT
        events[lane, row, CONTACT_ACCELERATION] = contact_acceleration
    cursor[lane, ROWS] = row + 1


@kernel
def _set_aside(group: Lanes, lane: int, count: int, here: Floats) -> int:
    """Let a lane go through the whole cell by itself. Returns how many do so now."""
    for c in range(group.alone.shape[1]):
        group.alone[lane, c] = here[c * LANES + lane]
    group.offset[lane] = 0.0
    group.waiting[count] = lane
    return count + 1


@kernel
def _set_aside_behind_impact(
    problem: CellProblem, group: Lanes, lane: int, k: int, u: Floats, status: int, count: int
) -> int:
    """Let a lane go on by itself behind the impact at which column k of the tile stands. Returns how many do so now.

    `status` is AT_STOP where mass 1 may come to rest there, else OK.
    """
    at = group.tile.rows
    for j in range(u.shape[0]):
        u[j, 0] = group.tile.end[2 * j * WIDTH + k]
        u[j, 1] = group.tile.end[(2 * j + 1) * WIDTH + k]
    left = 0.5 * (1.0 - at[multi_impact_cell.PLACE * WIDTH + k]) * problem.step
    flow_state(problem, u, -left)
    for j in range(u.shape[0]):
        group.alone[lane, 2 * j] = u[j, 0]
        group.alone[lane, 2 * j + 1] = u[j, 1]
    leaving = at[multi_impact_cell.RATE * WIDTH + k] / (0.5 * problem.step)
    group.offset[lane] = problem.step - left
    group.cursor[lane, ANCHOR] = 1 if at[multi_impact_cell.SIDE * WIDTH + k] > 0.0 else -1
    group.cursor[lane, ROOTS] = 1 if leaving > 0.0 else 2
    group.near[lane, 0] = 0.0
    group.near[lane, 1] = leaving
    group.status[lane] = status
    group.waiting[count] = lane
    return count + 1


@kernel
def _bounce(
    masses: Masses,
    problem: CellProblem,
    tables: LaneTables,
    group: Lanes,
    count: int,
    cell: int,
    half: int,
    here: Floats,
    there: Floats,
    u: Floats,
    aside: int,
) -> int:
    """Carry the lanes in the first `count` columns of the tile, which is filled but not entered, to the cell's end.

    Returns how many lanes are set aside by now; `aside` were before.
    """
    tile, lanes_of, active, regime = group.tile, group.tile_lane, group.active, group.regime
    tally, cursor, events, near = group.tally, group.cursor, group.events, group.near
    clearance, limit = group.clearance, group.limit
    at, end = tile.rows, tile.end
    step, restitution = problem.step, problem.restitution
    before = step * (cell % (problem.cells // 2))
    half_step = 0.5 * step
    states = 2 * len(masses)
    for k in range(WIDTH):
        active[k] = 1 if k < count else 0
        if k >= count:
            at[multi_impact_cell.JUMP * WIDTH + k] = 0.0
    worked = VECTOR if count <= VECTOR else WIDTH
    multi_impact_cell.enter_tile(masses, tables, cell, tile, worked)
    while True:
        for k in range(count):
            if active[k] != 0 and at[multi_impact_cell.JUMP * WIDTH + k] != 0.0:
                lane, speed, contact_acceleration = (
                    lanes_of[k],
                    at[multi_impact_cell.SPEED * WIDTH + k],
                    at[multi_impact_cell.CONTACT_ACCELERATION * WIDTH + k],
                )
                after, side = (
                    half_step * (1.0 + at[multi_impact_cell.PLACE * WIDTH + k]),
                    at[multi_impact_cell.SIDE * WIDTH + k],
                )
                _enter_impact(tally, cursor, events, lane, half, before, after, side, speed, contact_acceleration)
                if may_rest(restitution, step, contact_acceleration, restitution * speed):
                    aside = _set_aside_behind_impact(problem, group, lane, k, u, plain(AT_STOP), aside)
                    active[k] = 0
        multi_impact_cell.clear_columns(tables, tile, worked)
        unsure = 0
        for k in range(count):
            unsure += (
                1 if active[k] != 0 and at[multi_impact_cell.OUTCOME * WIDTH + k] != multi_impact_cell.CLEAR else 0
            )
        if unsure > 0:
            multi_impact_cell.next_contacts(tables, tile, worked)
        struck = 0
        for k in range(count):
            if active[k] == 0:
                at[multi_impact_cell.LENGTH * WIDTH + k] = 0.0
                at[multi_impact_cell.JUMP * WIDTH + k] = 0.0
                continue
            lane, outcome = lanes_of[k], at[multi_impact_cell.OUTCOME * WIDTH + k]
            if outcome == multi_impact_cell.CONTACT:
                struck += 1
            elif outcome == multi_impact_cell.CLEAR:
                active[k] = 0
                stays = False
                if at[multi_impact_cell.ON_STOP * WIDTH + k] > 0.0 or regime[lane] == NEAR:
                    gap, rate = at[multi_impact_cell.END_GAP * WIDTH + k], at[multi_impact_cell.END_RATE * WIDTH + k]
                    near[lane, 0] = gap
                    near[lane, 1] = rate
                    # so near, and the parabola through both rates comes back within the next cell?
                    second_derivative = (
                        0.5
                        * (rate - at[multi_impact_cell.RATE * WIDTH + k] / half_step)
                        / (half_step * (1.0 - at[multi_impact_cell.PLACE * WIDTH + k]))
                    )
                    stays = (
                        gap < ANCHORED_GAP * clearance[lane] and gap + step * (rate + step * second_derivative) < 0.0
                    )
                regime[lane] = LEAVING if stays else STEPPING
            else:
                active[k] = 0
                if at[multi_impact_cell.ON_STOP * WIDTH + k] > 0.0:
                    aside = _set_aside_behind_impact(problem, group, lane, k, u, plain(OK), aside)
                else:
                    aside = _set_aside(group, lane, aside, here)
        if struck == 0:
            break
        multi_impact_cell.strike_tile(tables, tile, worked)
    multi_impact_cell.leave_tile(tables, cell, tile, worked)
    for k in range(count):
        lane = lanes_of[k]
        if regime[lane] != LEAVING and regime[lane] != STEPPING:
            continue
        for c in range(states):
            there[c * LANES + lane] = end[c * WIDTH + k]
        there[states * LANES + lane] = at[multi_impact_cell.END_X * WIDTH + k]
        there[(states + 1) * LANES + lane] = at[multi_impact_cell.END_V * WIDTH + k]
        if regime[lane] == LEAVING:
            regime[lane] = NEAR
            limit[lane] = -np.inf
            cursor[lane, ANCHOR] = 1 if at[multi_impact_cell.SIDE * WIDTH + k] > 0.0 else -1
            cursor[lane, ROOTS] = 0
        else:
            regime[lane] = FREE
            limit[lane] = at[multi_impact_cell.END_LIMIT * WIDTH + k]
            cursor[lane, ANCHOR] = 0
    return aside


@kernel
def _meet_stops(
    masses: Masses,
    problem: CellProblem,
    tables: LaneTables,
    group: Lanes,
    cell: int,
    half: int,
    here: Floats,
    there: Floats,
    used: int,
    u: Floats,
) -> int:
    """Do the cell again for the lanes that are flagged. Returns how many of them are set aside for `_go_alone`."""
    chosen, beside, flags, regime, lanes_of = group.chosen, group.beside, group.flags, group.regime, group.tile_lane
    tally, cursor, events, near = group.tally, group.cursor, group.events, group.near
    clearance, limit = group.clearance, group.limit
    start, end, at = group.columns.start, group.columns.end, group.columns.rows
    on, of_tile = group.tile.rows, group.tile.start
    half_step = 0.5 * problem.step
    before = problem.step * (cell % (problem.cells // 2))
    states = 2 * len(masses)
    flagged = 0
    for lane in range(used):
        chosen[flagged] = lane
        flagged += flags[lane]
    count = 0
    left = 0
    for i in range(flagged):
        lane = chosen[i]
        if regime[lane] != FREE:
            beside[left] = lane
            left += 1
            continue
        chosen[count] = lane
        for c in range(states):
            start[c * LANES + count] = here[c * LANES + lane]
        at[rows.START_X * LANES + count] = here[states * LANES + lane]
        at[rows.START_V * LANES + count] = here[(states + 1) * LANES + lane]
        at[rows.GAP * LANES + count] = clearance[lane]
        count += 1
    if count > 0:
        solve_impacts(masses, tables, cell, group.columns, (count + VECTOR - 1) // VECTOR * VECTOR)
    # typed by hand: a literal 0 would have `_bounce` compiled once more for each
    filled = int(np.int64(0))
    aside = int(np.int64(0))
    for i in range(count + left):
        if i < count:
            lane = chosen[i]
            side, certain = at[rows.SIDE * LANES + i], at[rows.CERTAIN * LANES + i]
            if certain == rows.NONE:
                continue
            if certain == rows.ONLY:
                for c in range(states):
                    there[c * LANES + lane] = end[c * LANES + i]
                there[states * LANES + lane] = at[rows.END_X * LANES + i]
                there[(states + 1) * LANES + lane] = at[rows.END_V * LANES + i]
                limit[lane] = at[rows.END_LIMIT * LANES + i]
                after = half_step * (1.0 + at[rows.PLACE * LANES + i])
                speed, contact_acceleration = at[rows.SPEED * LANES + i], at[rows.CONTACT_ACCELERATION * LANES + i]
                _enter_impact(tally, cursor, events, lane, half, before, after, side, speed, contact_acceleration)
                continue
            on[multi_impact_cell.SIDE * WIDTH + filled] = side
            if certain == rows.FIRST:
                on[multi_impact_cell.PLACE * WIDTH + filled] = at[rows.PLACE * LANES + i]
                on[multi_impact_cell.SPEED * WIDTH + filled] = at[rows.SPEED * LANES + i]
                on[multi_impact_cell.JUMP * WIDTH + filled] = at[rows.JUMP * LANES + i]
            else:
                on[multi_impact_cell.PLACE * WIDTH + filled] = -1.0
                on[multi_impact_cell.GAP * WIDTH + filled] = clearance[lane] - side * at[rows.START_X * LANES + i]
                on[multi_impact_cell.RATE * WIDTH + filled] = -side * at[rows.START_V * LANES + i] * half_step
                on[multi_impact_cell.SPEED * WIDTH + filled] = 0.0
                on[multi_impact_cell.JUMP * WIDTH + filled] = 0.0
        else:
            lane = beside[i - count]
            if regime[lane] == RESTING:
                aside = _set_aside(group, lane, aside, here)
                continue
            on[multi_impact_cell.SIDE * WIDTH + filled] = cursor[lane, ANCHOR]
            on[multi_impact_cell.PLACE * WIDTH + filled] = -1.0
            on[multi_impact_cell.GAP * WIDTH + filled] = near[lane, 0]
            on[multi_impact_cell.RATE * WIDTH + filled] = near[lane, 1] * half_step
            on[multi_impact_cell.SPEED * WIDTH + filled] = 0.0
            on[multi_impact_cell.JUMP * WIDTH + filled] = 0.0
        lanes_of[filled] = lane
        on[multi_impact_cell.CLEARANCE * WIDTH + filled] = clearance[lane]
        for c in range(states):
            of_tile[c * WIDTH + filled] = here[c * LANES + lane]
        filled += 1
        if filled == WIDTH:
            aside = _bounce(masses, problem, tables, group, filled, cell, half, here, there, u, aside)
            filled = int(np.int64(0))
    if filled > 0:
        aside = _bounce(masses, problem, tables, group, filled, cell, half, here, there, u, aside)
    return aside


@kernel
def _take_over(
    problem: CellProblem,
    held: HeldProblem,
    group: Lanes,
    lane: int,
    boundary: int,
    there: Floats,
    u: Floats,
    status: int,
    work: Workspace,
) -> None:
    """Let a lane stand where the scalar kernel does, at a boundary of a cell: u (N, 2) and the regime in work."""
    blocks = u.shape[0]
    group.status[lane] = status
    if status != OK:
        idle(group, lane)
        return
    resting = work.cursor[HELD] != 0
    copy_vector(group.cursor[lane], work.cursor)
    copy_vector(group.near[lane], work.near)
    copy_vector(group.tally[:, lane], work.tally)
    group.regime[lane] = RESTING if resting else (NEAR if work.cursor[ANCHOR] != 0 else FREE)
    if resting:
        copy_matrix(group.resting[lane], held.state)
        copy_vector(group.since[lane], held.since)
    x, v = first_mass(problem, u, problem.steady_table[boundary, 0], problem.steady_table[boundary, 1])
    for j in range(blocks):
        there[2 * j * LANES + lane] = u[j, 0]
        there[(2 * j + 1) * LANES + lane] = u[j, 1]
    there[2 * blocks * LANES + lane] = x
    there[(2 * blocks + 1) * LANES + lane] = v
    group.limit[lane] = -np.inf if group.regime[lane] != FREE else _limit(problem, u, group.clearance[lane])


@kernel
def _go_alone(
    problem: CellProblem,
    held: HeldProblem,
    group: Lanes,
    lane: int,
    cell: int,
    half: int,
    there: Floats,
    u: Floats,
    work: Workspace,
) -> None:
    """Carry one lane to the end of a cell by itself, from where `alone` and `offset` say; u (N, 2) is scratch."""
    blocks = u.shape[0]
    clearance, offset = group.clearance[lane], group.offset[lane]
    for j in range(blocks):
        u[j, 0] = group.alone[lane, 2 * j]
        u[j, 1] = group.alone[lane, 2 * j + 1]
    copy_vector(work.cursor, group.cursor[lane])
    copy_vector(work.near[:3], group.near[lane])
    copy_vector(work.tally, group.tally[:, lane])
    if work.cursor[HELD] != 0:
        copy_matrix(held.state, group.resting[lane])
        copy_vector(held.since, group.since[lane])
    scratch = group.events.shape[1]
    before = work.cursor[ROWS]
    seen = max(before - 1, 0)  # a rest changes the kind of the impact that led to it
    if seen < scratch:
        for c in range(KIND + 1):
            work.events[seen, c] = group.events[lane, seen, c]
    status = AT_STOP
    if group.status[lane] == AT_STOP:
        work.near[2] = offset
    else:
        status = run_cell(problem, u, clearance, cell, offset, half, work)
    if status == AT_STOP:
        status = rest_in_cell(problem, held, u, clearance, cell, half, work)
    for row in range(seen, min(work.cursor[ROWS], scratch)):
        for c in range(KIND + 1):
            group.events[lane, row, c] = work.events[row, c]
        if work.events[row, KIND] == IMPACT and row >= before:
            behind = work.events[row, EVENT_COLUMNS:].reshape(u.shape)
            _, gain_imag = steady_motion_at(problem, half % 2 * (problem.cells // 2), work.events[row, TIME])
            contact_acceleration = work.events[row, STOP] * first_acceleration(problem, behind, gain_imag)
            group.events[lane, row, CONTACT_ACCELERATION] = contact_acceleration
    if status == OK and work.cursor[HELD] != 0 and (cell + 1 == problem.cells or cell + 1 == problem.cells // 2):
        write_free_state(problem, held, u, clearance, cell + 1, 0.0, work)
    _take_over(problem, held, group, lane, cell + 1, there, u, status, work)


@kernel
def run_half(
    masses: Masses,
    problem: CellProblem,
    held: HeldProblem,
    tables: LaneTables,
    group: Lanes,
    half: int,
    used: int,
    u: Floats,
    work: Workspace,
) -> None:
    """Carry the first `used` lanes over half a forcing period.

    Parameters
    ----------
    masses : tuple of length N
        Only its length matters.
    half : int
        Index of the half period; an even one begins at phase 0.
    used : int
        A multiple of COLUMNS.
    u, work
        Scratch, (N, 2) and of as many events as the lanes'; overwritten.
    """
    cells = problem.cells // 2
    first = (half % 2) * cells
    here, there = group.even, group.odd
    for cell in range(first, first + cells):
        if advance(masses, tables, cell + 1, here, there, group.limit, group.flags, used) > 0:
            for i in range(_meet_stops(masses, problem, tables, group, cell, half, here, there, used, u)):
                _go_alone(problem, held, group, group.waiting[i], cell, half, there, u, work)
        here, there = there, here
    if cells % 2 == 1:
        copy_vector(group.even, group.odd)
    refresh_limits(len(masses), tables, group.even, group.clearance, group.limit, group.reach, used)
    for lane in range(used):
        if group.regime[lane] != FREE:
            group.limit[lane] = -np.inf


@kernel
def run_halves(
    masses: Masses,
    problem: CellProblem,
    held: HeldProblem,
    tables: LaneTables,
    group: Lanes,
    halves: int,
    used: int,
    u: Floats,
    work: Workspace,
) -> None:
    """Carry lanes that have just begun over so many half periods; parameters as `run_half`."""
    problem, held, tables = reference(problem), reference(held), reference(tables)
    group, work = reference(group), reference(work)
    for half in range(halves):
        run_half(masses, problem, held, tables, group, half, used, u, work)
