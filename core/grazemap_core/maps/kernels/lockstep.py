"""Trajectories in lockstep, cell after cell.

>>> from grazemap_core.contact.kernels.stops import Stops
>>> from grazemap_core.maps.kernels.lanes import lanes, set_stops
>>> group = lanes(masses=3)  # room for LANES trajectories, side by side
>>> for lane, gap in enumerate((1.5, 1.6)):  # two clearances
...     set_stops(group, lane, Stops(gap, gap, 0.8, 0.8, gap, 64.0, 0.0, True))  # 0.8: restitution of either stop
>>> lane_stops(group, 1).left, lane_stops(group, 2).left  # the third lane is out of use: its stops are out of reach
(1.6, 1e+300)

A cell is one step of the time grid; half a forcing period has a whole number of cells (`run_half` carries the lanes
over it). All lanes are in the same cell; each has its own stops, state and regime: FREE between the stops, NEAR a stop
that the contact has just left, or RESTING on one. They share an oscillator and a forcing frequency, or each has its own
(`LaneModels`). Cells without a contact, and cells with one impact that can be certified, are computed for all lanes at
once (`first_pass`). Lanes with several impacts on one stop, a slow rebound or a close passage go through a second pass
together (`second_pass`). All others (rest on a stop, a graze to within round-off, both stops in one cell) go through
the cell one by one, as a single trajectory would (`half_period`, `sticking`).

The result of a lane does not depend on the others, to the last bit.
"""

# Passing a tuple of many arrays to a function, or looking up an array in it, costs as much as an impact. What is done
# once per impact is therefore inlined, and uses arrays that were looked up before.

from __future__ import annotations

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import (
    contact_acceleration_of,
    contact_motion,
    reach_from,
    reference_at,
)
from grazemap_core.contact.kernels.half_period import may_rest, rest_in_cell, run_cell
from grazemap_core.contact.kernels.runs import Moment, Run, contact_of_lane, contact_of_run, copy_contact, put_on_stop
from grazemap_core.contact.kernels.sticking import write_free_state
from grazemap_core.contact.tolerances import ANCHORED_GAP
from grazemap_core.maps.kernels import first_pass, second_pass
from grazemap_core.maps.kernels.first_pass import PITCH, VECTOR, advance, solve_impacts, update_limits
from grazemap_core.maps.kernels.lane_tables import (
    LANES,
    OF_FIRST_PASS,
    OF_GROUP,
    OF_SECOND_PASS,
    STEP,
    LaneModels,
    TablesPerLane,
    cell_of_pass,
    put_in_pass,
)
from grazemap_core.maps.kernels.lanes import (
    EVENT_ACCELERATION,
    FREE,
    NEAR,
    RESTING,
    Lanes,
    clear_lane,
    lane_stops,
    loss_of_limits,
    no_limits,
    put_state,
    set_limits,
    state_of_lane,
)
from grazemap_core.maps.kernels.second_pass import WIDTH
from grazemap_core.model.kernels.block_flow import advance_state
from grazemap_core.numerics.jit.compiled import copy_vector, inlined, kernel, plain
from grazemap_core.numerics.jit.lane_values import lane_row, lane_value, record_of, table_of
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.records import NamedTuple

BECOMES_NEAR, BECOMES_FREE = 3, 4
"""Regimes in the second pass over a cell: NEAR, or FREE, at its end."""


class Engine(NamedTuple):
    """What carries lanes: they, what they share, and scratch."""

    blocks: int
    """N."""
    models: LaneModels
    """The oscillator at its frequency, shared by all lanes or of each lane."""
    separate: TablesPerLane
    """The tables of lanes that have their own."""
    group: Lanes
    """States, regimes, tallies and events of the lanes."""
    run: Run
    """Scratch: the trajectory of a lane that goes through a cell by itself, with the lanes' capacity for events."""


class CellStep(NamedTuple):
    """One cell of one half period."""

    cell: int
    """Index of the cell in the forcing period."""
    half: int
    """Index of the half period."""
    here: Floats
    """((2 N + 2) * LANES,) States of all lanes at its start."""
    there: Floats
    """((2 N + 2) * LANES,) States of all lanes at its end."""


class LaneImpact(NamedTuple):
    """One impact."""

    time: float
    """Time since the start of the half period."""
    side: float
    """Stop."""
    speed: float
    """Speed before it."""
    contact_acceleration: float
    """Acceleration of the contact after it."""


@inlined
def _enter_passage(tally: Floats, lane: int, gap: float) -> None:
    """Enter the distance from the stops in a passage without a contact into a lane's tally."""
    tally[runs.MIN_GAP, lane] = min(tally[runs.MIN_GAP, lane], gap)


@inlined
def _enter_impact(tally: Floats, cursor: Integers, events: Floats, lane: int, half: int, impact: LaneImpact) -> None:
    """Enter an impact into a lane's tally and, up to their capacity, into its events."""
    side, speed, contact_acceleration = impact.side, impact.speed, impact.contact_acceleration
    tally[runs.RIGHT_IMPACTS if side > 0.0 else runs.LEFT_IMPACTS, lane] += 1.0
    tally[runs.FOLLOWED, lane] += 1.0
    tally[runs.MIN_SPEED, lane] = min(tally[runs.MIN_SPEED, lane], speed)
    if contact_acceleration <= 0.0:
        tally[runs.MIN_UNPRESSED_SPEED, lane] = min(tally[runs.MIN_UNPRESSED_SPEED, lane], speed)
    row = cursor[lane, runs.EVENT_COUNT]
    if row < events.shape[1]:
        events[lane, row, runs.HALF] = half
        events[lane, row, runs.TIME] = impact.time
        events[lane, row, runs.STOP] = side
        events[lane, row, runs.VELOCITY] = side * speed
        events[lane, row, runs.KIND] = runs.IMPACT
        events[lane, row, EVENT_ACCELERATION] = contact_acceleration
    cursor[lane, runs.EVENT_COUNT] = row + 1


@kernel
def _defer_cell(group: Lanes, lane: int, count: int, here: Floats) -> int:
    """Defer a lane from the start of the cell on. Returns how many lanes are deferred now."""
    for c in range(group.deferred_state.shape[1]):
        group.deferred_state[lane, c] = here[c * LANES + lane]
    group.deferred_offset[lane] = 0.0
    group.deferred[count] = lane
    return count + 1


@kernel
def _defer_after_impact(engine: Engine, k: int, status: int, count: int) -> int:
    """Defer lane k of the second pass from its last impact on. Returns how many lanes are deferred now.

    `status` is AT_STOP where the contact may come to rest there, else OK.
    """
    group, u = engine.group, engine.run.u
    rows, end, lane = group.second_pass.rows, group.second_pass.end, group.lane_of[k]
    problem = record_of(engine.models, lane).forced.free
    for j in range(u.shape[0]):
        u[j, 0] = end[2 * j * WIDTH + k]
        u[j, 1] = end[(2 * j + 1) * WIDTH + k]
    left = 0.5 * (1.0 - rows[second_pass.ORIGIN * WIDTH + k]) * problem.step
    advance_state(problem, u, -left)
    for j in range(u.shape[0]):
        group.deferred_state[lane, 2 * j] = u[j, 0]
        group.deferred_state[lane, 2 * j + 1] = u[j, 1]
    leaving = rows[second_pass.RATE * WIDTH + k] / (0.5 * problem.step)
    group.deferred_offset[lane] = problem.step - left
    stop = 1 if rows[second_pass.SIDE * WIDTH + k] > 0.0 else -1
    put_on_stop(group.contacts.cursor[lane], group.contacts.near[lane], stop, leaving)
    group.status[lane] = status
    group.deferred[count] = lane
    return count + 1


@kernel
def _run_second_pass(engine: Engine, step: CellStep, count: int, deferred: int) -> int:
    """Carry the first `count` lanes of the second pass, whose input is complete, to the end of the cell.

    Returns how many lanes are deferred now; `deferred` were before.
    """
    blocks, models, group = engine.blocks, engine.models, engine.group
    tables, cell = table_of(engine.separate, OF_SECOND_PASS, models), cell_of_pass(engine.separate, step.cell)
    batch, active, rows = group.second_pass, group.active, group.second_pass.rows
    for k in range(WIDTH):
        active[k] = 1 if k < count else 0
        if k >= count:
            rows[second_pass.JUMP * WIDTH + k] = 0.0
        else:
            put_in_pass(tables, WIDTH, k, record_of(models, group.lane_of[k]).tables, step.cell)
    computed = (count + VECTOR - 1) // VECTOR * VECTOR
    second_pass.begin_second_pass(blocks, tables, cell, batch, computed)
    while True:
        deferred = _enter_impacts_of_round(engine, step, count, deferred)
        second_pass.certify_clear(tables, batch, computed)
        uncertain = 0
        for k in range(count):
            uncertain += 1 if active[k] != 0 and rows[second_pass.OUTCOME * WIDTH + k] != second_pass.CLEAR else 0
        if uncertain > 0:
            second_pass.find_contacts(tables, batch, computed)
        contacts = 0
        for k in range(count):
            if active[k] == 0:
                rows[second_pass.CONTACT_S * WIDTH + k] = 0.0
                rows[second_pass.JUMP * WIDTH + k] = 0.0
            elif rows[second_pass.OUTCOME * WIDTH + k] == second_pass.CONTACT:
                contacts += 1
            else:
                deferred = _leave_second_pass(engine, step, k, deferred)
        if contacts == 0:
            break
        second_pass.apply_impacts(blocks, tables, batch, computed)
    second_pass.end_second_pass(blocks, tables, cell, batch, computed)
    _write_second_pass(group, step, count, blocks)
    return deferred


@kernel
def _enter_impacts_of_round(engine: Engine, step: CellStep, count: int, deferred: int) -> int:
    """Enter the impacts of the last round, and defer the lanes that may come to rest. Returns how many are deferred."""
    models, group = engine.models, engine.group
    rows, lane_of, active = group.second_pass.rows, group.lane_of, group.active
    tally, cursor, events, half = group.tally, group.contacts.cursor, group.events, step.half
    for k in range(count):
        if active[k] != 0 and rows[second_pass.JUMP * WIDTH + k] != 0.0:
            problem = record_of(models, lane_of[k]).forced.free
            length = problem.step
            half_cell, cell_start = 0.5 * length, length * (step.cell % (problem.cells // 2))
            _enter_passage(tally, lane_of[k], rows[second_pass.LEAST_GAP * WIDTH + k])
            speed = rows[second_pass.SPEED * WIDTH + k]
            contact_acceleration = rows[second_pass.CONTACT_ACCELERATION * WIDTH + k]
            after, side = half_cell * (1.0 + rows[second_pass.ORIGIN * WIDTH + k]), rows[second_pass.SIDE * WIDTH + k]
            impact = LaneImpact(cell_start + after, side, speed, contact_acceleration)
            _enter_impact(tally, cursor, events, lane_of[k], half, impact)
            restitution = rows[second_pass.RESTITUTION * WIDTH + k]
            if may_rest(restitution, length, contact_acceleration, restitution * speed):
                deferred = _defer_after_impact(engine, k, plain(runs.AT_STOP), deferred)
                active[k] = 0
    return deferred


@kernel
def _leave_second_pass(engine: Engine, step: CellStep, k: int, deferred: int) -> int:
    """Remove lane k from the second pass: at the end of the cell if that is clear, otherwise deferred.

    Returns how many lanes are deferred now.
    """
    group = engine.group
    rows, lane, near, regime = group.second_pass.rows, group.lane_of[k], group.contacts.near, group.regime
    problem, on_stop = record_of(engine.models, lane).forced.free, rows[second_pass.ON_STOP * WIDTH + k] > 0.0
    group.active[k] = 0
    if rows[second_pass.OUTCOME * WIDTH + k] != second_pass.CLEAR:
        if on_stop:
            return _defer_after_impact(engine, k, plain(runs.OK), deferred)
        return _defer_cell(group, lane, deferred, step.here)
    _enter_passage(group.tally, lane, rows[second_pass.LEAST_GAP * WIDTH + k])
    stays = False
    if on_stop or regime[lane] == NEAR:
        length, half_cell = problem.step, 0.5 * problem.step
        gap, rate = rows[second_pass.END_GAP * WIDTH + k], rows[second_pass.END_RATE * WIDTH + k]
        near[lane, runs.ANCHOR_GAP] = gap
        near[lane, runs.ANCHOR_RATE] = rate
        # the contact is close to the stop, and the parabola through both rates returns to it within the next cell
        origin = rows[second_pass.ORIGIN * WIDTH + k]
        second_derivative = 0.5 * (rate - rows[second_pass.RATE * WIDTH + k] / half_cell) / (half_cell * (1.0 - origin))
        close = gap < ANCHORED_GAP * group.unit[lane]
        stays = close and gap + length * (rate + length * second_derivative) < 0.0
    regime[lane] = BECOMES_NEAR if stays else BECOMES_FREE
    return deferred


@kernel
def _write_second_pass(group: Lanes, step: CellStep, count: int, blocks: int) -> None:
    """Write the states and regimes at the end of the cell of the lanes of the second pass that reach it."""
    rows, end, there, lane_of = group.second_pass.rows, group.second_pass.end, step.there, group.lane_of
    regime, cursor, limit, gap = group.regime, group.contacts.cursor, group.limit, group.gap
    for k in range(count):
        lane = lane_of[k]
        if regime[lane] != BECOMES_NEAR and regime[lane] != BECOMES_FREE:
            continue
        _copy_blocks(blocks, end, WIDTH, k, there, LANES, lane)
        there[2 * blocks * LANES + lane] = rows[second_pass.END_X * WIDTH + k]
        there[(2 * blocks + 1) * LANES + lane] = rows[second_pass.END_V * WIDTH + k]
        if regime[lane] == BECOMES_NEAR:
            regime[lane] = NEAR
            no_limits(group, lane)
            cursor[lane, runs.ANCHOR] = 1 if rows[second_pass.SIDE * WIDTH + k] > 0.0 else -1
            cursor[lane, runs.ZERO_ORDER] = 0
        else:
            regime[lane] = FREE
            set_limits(limit, gap, lane, rows[second_pass.END_LOSS * WIDTH + k] + group.close[lane])
            cursor[lane, runs.ANCHOR] = 0


@kernel
def _solve_flagged(engine: Engine, step: CellStep, used: int) -> int:
    """Compute the cell again for the flagged lanes. Returns how many of them are deferred."""
    models, group = engine.models, engine.group
    flagged, not_free, regime, lane_of = group.flagged, group.not_free, group.regime, group.lane_of
    gap, restitution, unit, close, limit = group.gap, group.restitution, group.unit, group.close, group.limit
    here, there = step.here, step.there
    tally, events, half = group.tally, group.events, step.half
    cursor, near = group.contacts.cursor, group.contacts.near
    rows, end = group.first_pass.rows, group.first_pass.end
    second, start = group.second_pass.rows, group.second_pass.start
    states, place = 2 * engine.blocks, step.cell % (models.shared.forced.free.cells // 2)
    steps = lane_row(table_of(engine.separate, OF_GROUP, models).scalars, STEP, LANES)
    free, others = _solve_free(engine, step, used)
    filled = plain(0)
    deferred = plain(0)
    for i in range(free + others):
        if i < free:
            lane, outcome = flagged[i], rows[first_pass.OUTCOME * PITCH + i]
            if outcome == first_pass.NO_IMPACT:
                _enter_passage(tally, lane, rows[first_pass.LEAST_GAP * PITCH + i])
                continue
            if outcome == first_pass.SINGLE_IMPACT:
                _enter_passage(tally, lane, rows[first_pass.LEAST_GAP * PITCH + i])
                _copy_blocks(engine.blocks, end, PITCH, i, there, LANES, lane)
                there[states * LANES + lane] = rows[first_pass.END_X * PITCH + i]
                there[(states + 1) * LANES + lane] = rows[first_pass.END_V * PITCH + i]
                set_limits(limit, gap, lane, rows[first_pass.END_LOSS * PITCH + i] + close[lane])
                length = lane_value(steps, lane)
                impact = LaneImpact(
                    length * place + 0.5 * length * (1.0 + rows[first_pass.IMPACT_Z * PITCH + i]),
                    rows[first_pass.SIDE * PITCH + i],
                    rows[first_pass.SPEED * PITCH + i],
                    rows[first_pass.CONTACT_ACCELERATION * PITCH + i],
                )
                _enter_impact(tally, cursor, events, lane, half, impact)
                continue
            if outcome == first_pass.FIRST_IMPACT:
                _put_after_impact(rows, second, i, filled)
            else:
                side, half_cell = rows[first_pass.SIDE * PITCH + i], 0.5 * lane_value(steps, lane)
                start_gap = rows[first_pass.GAP * PITCH + i] - side * rows[first_pass.START_X * PITCH + i]
                rate = -side * rows[first_pass.START_V * PITCH + i] * half_cell
                _put_at_start(second, filled, side, start_gap, rate)
        else:
            lane = not_free[i - free]
            if regime[lane] == RESTING:
                deferred = _defer_cell(group, lane, deferred, here)
                continue
            rate = near[lane, runs.ANCHOR_RATE] * (0.5 * lane_value(steps, lane))
            _put_at_start(second, filled, float(cursor[lane, runs.ANCHOR]), near[lane, runs.ANCHOR_GAP], rate)
        lane_of[filled] = lane
        second[second_pass.UNIT * WIDTH + filled] = unit[lane]
        second[second_pass.BOTH * WIDTH + filled] = gap[lane] + gap[LANES + lane]
        upper = second[second_pass.SIDE * WIDTH + filled] > 0.0
        second[second_pass.RESTITUTION * WIDTH + filled] = restitution[lane if upper else LANES + lane]
        _copy_blocks(engine.blocks, here, LANES, lane, start, WIDTH, filled)
        filled += 1
        if filled == WIDTH:
            deferred = _run_second_pass(engine, step, filled, deferred)
            filled = plain(0)
    if filled > 0:
        deferred = _run_second_pass(engine, step, filled, deferred)
    return deferred


@inlined
def _copy_blocks(blocks: int, source: Floats, pitch: int, k: int, target: Floats, distance: int, lane: int) -> None:
    """Copy the two numbers of each block from column k of a source, with rows `pitch` apart, to one of a target."""
    for j in range(blocks):
        target[2 * j * distance + lane] = source[2 * j * pitch + k]
        target[(2 * j + 1) * distance + lane] = source[(2 * j + 1) * pitch + k]


@kernel
def _solve_free(engine: Engine, step: CellStep, used: int) -> tuple[int, int]:
    """Find the impacts of the flagged lanes that are FREE.

    Returns how many flagged lanes are FREE, which come first in group.flagged, and how many are in group.not_free. A
    FREE lane needs a second pass unless its OUTCOME is NO_IMPACT or SINGLE_IMPACT.
    """
    blocks, models, group = engine.blocks, engine.models, engine.group
    flags, flagged, not_free, regime = group.flags, group.flagged, group.not_free, group.regime
    start, rows, here = group.first_pass.start, group.first_pass.rows, step.here
    gap, restitution, unit = group.gap, group.restitution, group.unit
    states, tables = 2 * blocks, table_of(engine.separate, OF_FIRST_PASS, models)
    count = 0
    for lane in range(used):
        flagged[count] = lane
        count += flags[lane]
    free, others = 0, 0
    for i in range(count):
        lane = flagged[i]
        if regime[lane] != FREE:
            not_free[others] = lane
            others += 1
            continue
        flagged[free] = lane
        rows[first_pass.START_X * PITCH + free] = here[states * LANES + lane]
        rows[first_pass.START_V * PITCH + free] = here[(states + 1) * LANES + lane]
        rows[first_pass.RIGHT * PITCH + free] = gap[lane]
        rows[first_pass.LEFT * PITCH + free] = gap[LANES + lane]
        rows[first_pass.RESTITUTION_RIGHT * PITCH + free] = restitution[lane]
        rows[first_pass.RESTITUTION_LEFT * PITCH + free] = restitution[LANES + lane]
        rows[first_pass.UNIT * PITCH + free] = unit[lane]
        put_in_pass(tables, PITCH, free, record_of(models, lane).tables, step.cell)
        free += 1
    if free > 0:
        for c in range(states):  # so many lanes at a time are quicker than all numbers of a lane
            for i in range(free):
                start[c * PITCH + i] = here[c * LANES + flagged[i]]
        computed = (free + VECTOR - 1) // VECTOR * VECTOR
        solve_impacts(blocks, tables, cell_of_pass(engine.separate, step.cell), group.first_pass, computed)
    return free, others


@inlined
def _put_after_impact(rows: Floats, second: Floats, i: int, k: int) -> None:
    """Write lane i of the first pass, with its impact, to lane k of the second pass."""
    second[second_pass.SIDE * WIDTH + k] = rows[first_pass.SIDE * PITCH + i]
    second[second_pass.ORIGIN * WIDTH + k] = rows[first_pass.IMPACT_Z * PITCH + i]
    second[second_pass.SPEED * WIDTH + k] = rows[first_pass.SPEED * PITCH + i]
    second[second_pass.JUMP * WIDTH + k] = rows[first_pass.JUMP * PITCH + i]
    second[second_pass.LEAST_GAP * WIDTH + k] = rows[first_pass.LEAST_GAP * PITCH + i]


@inlined
def _put_at_start(second: Floats, k: int, side: float, gap: float, rate: float) -> None:
    """Write a lane at the start of the cell, with its gap and the rate of this in half cells, to the second pass."""
    second[second_pass.SIDE * WIDTH + k] = side
    second[second_pass.ORIGIN * WIDTH + k] = -1.0
    second[second_pass.GAP * WIDTH + k] = gap
    second[second_pass.RATE * WIDTH + k] = rate
    second[second_pass.SPEED * WIDTH + k] = 0.0
    second[second_pass.JUMP * WIDTH + k] = 0.0


@kernel
def _copy_back(engine: Engine, lane: int, step: CellStep, status: int) -> None:
    """Copy the state and the regime of the run, at the end of a cell, to a lane."""
    group, run, u, boundary = engine.group, engine.run, engine.run.u, step.cell + 1
    group.status[lane] = status
    if status != runs.OK:
        clear_lane(group, lane)
        return
    copy_contact(contact_of_lane(group.contacts, lane), contact_of_run(run))
    copy_vector(group.tally[:, lane], run.tally)
    problem = record_of(engine.models, lane).forced.free
    x, v = contact_motion(problem, u, problem.steady_table[boundary, 0], problem.steady_table[boundary, 1])
    put_state(step.there, lane, u, x, v)
    no_limits(group, lane)
    if run.cursor[runs.HELD] != 0:
        group.regime[lane] = RESTING
    elif run.cursor[runs.ANCHOR] != 0:
        group.regime[lane] = NEAR
    else:
        group.regime[lane] = FREE
        set_limits(group.limit, group.gap, lane, loss_of_limits(problem, u, group.close[lane]))


@kernel
def _run_by_itself(engine: Engine, lane: int, step: CellStep) -> None:
    """Carry one deferred lane to the end of a cell."""
    forced, group, run, u = record_of(engine.models, lane).forced, engine.group, engine.run, engine.run.u
    problem, cell, half = forced.free, step.cell, step.half
    stops, offset = lane_stops(group, lane), group.deferred_offset[lane]
    for j in range(u.shape[0]):
        u[j, 0] = group.deferred_state[lane, 2 * j]
        u[j, 1] = group.deferred_state[lane, 2 * j + 1]
    copy_contact(contact_of_run(run), contact_of_lane(group.contacts, lane))
    copy_vector(run.tally, group.tally[:, lane])
    if run.cursor[runs.HELD] != 0:
        group.mixed[lane] = 1
    capacity = group.events.shape[1]
    before = run.cursor[runs.EVENT_COUNT]
    seen = max(before - 1, 0)  # a rest changes the kind of the impact that led to it
    if seen < capacity:
        for c in range(runs.KIND + 1):
            run.events[seen, c] = group.events[lane, seen, c]
    status = runs.AT_STOP
    if group.status[lane] == runs.AT_STOP:
        run.near[runs.CELL_OFFSET] = offset
    else:
        status = run_cell(problem, stops, run, Moment(cell, offset, half))
    if status == runs.AT_STOP:
        status = rest_in_cell(forced, stops, run, cell, half)
    if run.cursor[runs.HELD] != 0:
        group.mixed[lane] = 1
    for row in range(seen, min(run.cursor[runs.EVENT_COUNT], capacity)):
        for c in range(runs.KIND + 1):
            group.events[lane, row, c] = run.events[row, c]
        if row < before:
            continue
        kind, velocity = run.events[row, runs.KIND], run.events[row, runs.VELOCITY]
        if kind != runs.IMPACT or velocity == 0.0:
            group.mixed[lane] = 1
        if kind == runs.IMPACT:
            after = run.events[row, runs.EVENT_COLUMNS :].reshape(u.shape)
            first_cell, time = half % 2 * (problem.cells // 2), run.events[row, runs.TIME]
            _, _, acceleration = reference_at(problem, first_cell, time)
            contact_acceleration = run.events[row, runs.STOP] * contact_acceleration_of(problem, after, acceleration)
            group.events[lane, row, EVENT_ACCELERATION] = contact_acceleration
    if (
        status == runs.OK
        and run.cursor[runs.HELD] != 0
        and (cell + 1 == problem.cells or cell + 1 == problem.cells // 2)
    ):
        write_free_state(forced, stops, run, cell + 1, 0.0)
        for j in range(problem.half_jump.shape[1]):  # back from the reference motion of the next half period
            u[j, 0] -= problem.half_jump[half % 2, j, 0]
            u[j, 1] -= problem.half_jump[half % 2, j, 1]
    _copy_back(engine, lane, step, status)


@kernel
def run_half(engine: Engine, half: int, used: int) -> None:
    """Carry the first `used` lanes over half a forcing period, in place.

    `group.even` has their states from the start of the half period to its end.

    Parameters
    ----------
    half : int
        Index of the half period; an even one begins at phase 0.
    used : int
        A multiple of LANE_BLOCK.
    """
    blocks, models, separate, group, u = engine.blocks, engine.models, engine.separate, engine.group, engine.run.u
    tables = table_of(separate, OF_GROUP, models)
    cells = models.shared.forced.free.cells // 2
    first_cell = (half % 2) * cells
    here, there, mixed = group.even, group.odd, group.mixed
    for lane in range(used):
        mixed[lane] = 0
    for cell in range(first_cell, first_cell + cells):
        # carries all lanes as if there were no contact, and flags those that may have one, whose cell is computed again
        if advance(blocks, tables, cell + 1, here, there, group.limit, group.flags, used) > 0:
            step = reference(CellStep(cell, half, here, there))
            for i in range(_solve_flagged(engine, step, used)):
                _run_by_itself(engine, group.deferred[i], step)
        here, there = there, here
    if cells % 2 == 1:
        copy_vector(group.even, group.odd)
    # states are relative to a reference motion (`contact.kernels.cells`); with resonant modes each half period has one
    relative = separate.number > 0 or models.shared.forced.free.reference_series.shape[0] > 0
    if relative:
        _begin_half_period(models, group, half + 1, used)
    update_limits(blocks, tables, group.even, group.gap, group.close, group.limit, group.reach, used)
    for lane in range(used):
        if group.regime[lane] != FREE:
            no_limits(group, lane)
    for lane in range(used if relative else 0):
        problem = record_of(models, lane).forced.free
        if problem.reference_series.shape[0] == 0:
            continue
        state_of_lane(group.even, lane, u)
        group.reach[lane] = reach_from(problem, lane_stops(group, lane), u, half + 1)


@kernel
def _begin_half_period(models: LaneModels, group: Lanes, half: int, used: int) -> None:
    """Convert the states of all lanes to the reference motion of a half period, as `cells.begin_half_period`."""
    even, ended = group.even, (half + 1) % 2
    for lane in range(used):
        half_jump = record_of(models, lane).forced.free.half_jump
        for j in range(half_jump.shape[1]):
            for c in range(2):
                even[(2 * j + c) * LANES + lane] += half_jump[ended, j, c]
