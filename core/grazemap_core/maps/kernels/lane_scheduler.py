"""Scheduler of a column of a map: all stops of one forcing frequency, each run until its motion can be named.

A group of lanes takes trajectories from a queue. A lane whose trajectory is finished takes the next one at the start of
a forcing period. One process computes one column at a time; maps are parallel across processes.

`classification` decides how a lane continues. In a sweep every trajectory starts at the final state of the one before
it, so only one lane is in use.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import free_reach
from grazemap_core.contact.kernels.half_period import counted
from grazemap_core.contact.kernels.sticking import put_between_stops
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.classification import empty_full_events, start_growth
from grazemap_core.maps.kernels.column import Column
from grazemap_core.maps.kernels.final_states import keep_state
from grazemap_core.maps.kernels.first_pass import LANE_BLOCK, Masses
from grazemap_core.maps.kernels.lane_errors import begin_error, forget_error, watch_passages
from grazemap_core.maps.kernels.lane_state import ENDED_EARLY, MOVES, RESTS, begin_record, stops_in_row
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lane_tangents import (
    NOTHING,
    carry_changes,
    count_impacts,
    move_tangents,
    save_lane_starts,
)
from grazemap_core.maps.kernels.lockstep import (
    RESTING,
    Engine,
    Lanes,
    clear_lane,
    lane_stops,
    run_half,
    set_stops,
    start_lane,
    start_lane_on_stop,
)
from grazemap_core.maps.kernels.separate_tables import OF_GROUP, TablesPerLane, begin_separate
from grazemap_core.maps.tolerances import SETTLING_IMPACTS
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel
from grazemap_core.numerics.jit.lane_values import record_of, table_of
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, nearest_returns
from grazemap_core.simulation.tolerances import CLOSING_GOAL

HALVES_BETWEEN_CHECKS = 6
"""Half periods between searches for returns; a search costs as much as a half period. The number is even, because
trajectories start both at a search and with a forcing period."""


@kernel
def settle_column(masses: Masses, column: Column, separate: TablesPerLane, classify_lane: Callable[..., int]) -> int:
    """Run all trajectories of a column and write their motions to column.results.

    Returns how the last trajectory of a sweep ended: ENDED_EARLY, or MOVES or RESTS in column.final_state.

    Parameters
    ----------
    masses : tuple of length N
        Only its length matters.
    column : Column
        All but models and task is overwritten. The capacity of lanes and run is RECORDED_IMPACTS events, or 0
        where neither verification nor growth is wanted.
    separate : TablesPerLane
        If every trajectory has its own; there is one for each stops then.
    classify_lane : callable
        The address of `classification.classify_lane`.
    """
    column, separate = reference(column), reference(separate)
    engine = reference(Engine(masses, column.models, separate, column.group, column.run))
    task, counts, returns = column.task, column.records.counts, column.returns
    for lane in range(LANES):
        _vacate(column, lane)
    n = task.starts.on_stop.shape[0]
    # typed explicitly: for a literal 0 everything below would be compiled a second time
    queued = int(np.int64(0))
    done = 0
    k = int(np.int64(0))
    used = int(np.int64(0))
    ended = task.ended
    while done < n:
        if k % HALVES_BETWEEN_CHECKS == 0 and queued < n:
            queued, used = _start_trajectories(engine, column, k, queued, used, ended)
        _run_half(engine, column, k, used)
        k += 1
        check = task.early and k % HALVES_BETWEEN_CHECKS == 0
        if check:
            _find_returns(engine, column, k, used)
        for lane in range(used):
            if counts[lane, lane_state.TRAJECTORY] < 0 or not _is_due(column, lane, k, check):
                continue
            returned = int(returns.length[lane]) if check else 0
            closed = check and returns.nearest[lane] <= returns.relevant[lane]
            if classify_lane(column, lane, k, returned, 1 if closed else 0) == 0:
                continue
            if task.follow:
                ended = _keep_final_state(column, lane)
            _finish(column, lane, k)
            done += 1
            if task.follow:
                k = int(np.int64(0))  # the next one starts at once
        needed = (n - done + LANE_BLOCK - 1) // LANE_BLOCK * LANE_BLOCK
        if queued == n and used > needed > 0:
            _move_to_first_lanes(engine, column, k, used)
            used = needed
    return ended


@kernel
def _vacate(column: Column, lane: int) -> None:
    """Take a lane out of use."""
    column.records.counts[lane, lane_state.TRAJECTORY] = -1
    column.records.counts[lane, lane_state.STATE] = lane_state.ENDING
    column.tangents.carried[lane] = NOTHING
    column.tangents.errors.carried[lane] = 0
    clear_lane(column.group, lane)


@kernel
def _start_trajectories(engine: Engine, column: Column, k: int, queued: int, used: int, ended: int) -> tuple[int, int]:
    """Start trajectories in the lanes that are out of use, after k half periods.

    Returns how many have been started by now, and how many lanes are in use. `ended` is how the one before ended in a
    sweep; otherwise ENDED_EARLY.
    """
    task, counts, u = column.task, column.records.counts, column.run.u
    starts, each, n = task.starts, task.starts.directions.shape[0], task.starts.on_stop.shape[0]
    for lane in range(1 if task.follow else LANES):
        if queued < n and counts[lane, lane_state.TRAJECTORY] < 0:
            row, inherits = queued // each, task.inherits and queued == 0
            stops = stops_in_row(starts.stops, row)
            begin_separate(engine.models, engine.separate, lane, row)
            model = record_of(column.models, lane)
            if ended != ENDED_EARLY:
                copy_matrix(u, column.final_state)
                _start_at_final_state(column, lane, stops, ended == RESTS)
                inherits = inherits or (queued > 0 and _inherits_error(column, queued - 1))
            else:
                for j in range(u.shape[0]):
                    for c in range(2):
                        u[j, c] = starts.base[row, j, c] + stops.unit * starts.directions[queued % each, j, c]
                        u[j, c] += starts.offset[row] * starts.aside[row, j, c]
                if starts.on_stop[queued] != 0:
                    start_lane_on_stop(column.group, lane, model.forced.free, stops, u, starts.on_stop[queued])
                else:
                    start_lane(column.group, lane, model.forced.free, stops, u)
            if model.blocks.verifiable:
                if not inherits:
                    forget_error(column.tangents.errors, lane)
                begin_error(model.forced.free.frequency, column.tangents.errors, lane)
                watch_passages(column.group, column.tangents.errors, lane)
            begin_record(column.records, lane, queued, k, task, model.blocks.verifiable)
            queued += 1
            used = max(used, (lane + LANE_BLOCK) // LANE_BLOCK * LANE_BLOCK)
    return queued, used


@kernel
def _inherits_error(column: Column, before: int) -> bool:
    """Return whether a trajectory of a sweep starts with the error of the one before, which no orbit captured."""
    codes = column.results.codes[before]
    unverified = codes[lane_state.UNVERIFIED]
    return not (codes[lane_state.REASON] == RESOLVED and unverified in (RESOLVED, ROUNDING_DECIDES))


@kernel
def _start_at_final_state(column: Column, lane: int, stops: Stops, rested: bool) -> None:
    """Start at the state column.run.u in which another trajectory ended, moved onto the stop where it is beyond it.

    The contact bounces off that stop at once if it moves into it, or rests on it if it was at rest (`rested`). u is
    overwritten.
    """
    problem, group, u = record_of(column.models, lane).forced.free, column.group, column.run.u
    stop = put_between_stops(problem, stops, u, rested)
    if stop == 0:
        start_lane(group, lane, problem, stops, u)
    else:
        start_lane_on_stop(group, lane, problem, stops, u, stop)


@kernel
def _run_half(engine: Engine, column: Column, k: int, used: int) -> None:
    """Carry the lanes in use, and the small changes along them, over the half period k; enter them into the history."""
    group, records = column.group, column.records
    empty_full_events(column, k, used)
    if column.task.growth_halves > 0:
        start_growth(column, k, used)
    carries = column.task.early or column.task.growth_halves > 0
    if carries:
        save_lane_starts(group, column.tangents, used)
    run_half(engine, k, used)
    if carries:
        count_impacts(group, column.tangents, used)
        carry_changes(engine, column.tangents, k, column.task.growth_skipped, used)
    sizes, tally = records.sizes, group.tally
    for lane in range(used):
        sizes[lane, lane_state.FOLLOWED_IMPACTS] += tally[runs.FOLLOWED, lane]
        sizes[lane, lane_state.COUNTED_IMPACTS] += counted(lane_stops(group, lane), tally[runs.FOLLOWED, lane])
    _enter_history(column.history, k + 1, group, used)


@kernel
def _enter_history(history: StroboscopicHistory, k: int, group: Lanes, used: int) -> None:
    """Enter every lane's state after k half periods and its tally of the last one; clear the tallies."""
    states, impacts, held = history.states, history.impacts, history.held
    least, unpressed = history.min_speed, history.min_unpressed_speed
    even, tally = group.even, group.tally
    row = k % least.shape[0]
    sign = 1.0 if k % 2 == 0 else -1.0
    first = 0 if (k - 1) % 2 == 0 else 1  # in the frame of z the stops change sides every half period
    for c in range(states.shape[1]):
        for lane in range(min(used, LANES)):
            states[row, c, lane] = sign * even[c * LANES + lane]
    for lane in range(min(used, LANES)):
        impacts[row, first, lane] = tally[runs.RIGHT_IMPACTS, lane]
        impacts[row, 1 - first, lane] = tally[runs.LEFT_IMPACTS, lane]
        held[row, first, lane] = tally[runs.HELD_RIGHT, lane]
        held[row, 1 - first, lane] = tally[runs.HELD_LEFT, lane]
        least[row, lane] = tally[runs.MIN_SPEED, lane]
        unpressed[row, lane] = tally[runs.MIN_UNPRESSED_SPEED, lane]
        tally[runs.RIGHT_IMPACTS, lane] = 0.0
        tally[runs.LEFT_IMPACTS, lane] = 0.0
        tally[runs.HELD_RIGHT, lane] = 0.0
        tally[runs.HELD_LEFT, lane] = 0.0
        tally[runs.FOLLOWED, lane] = 0.0
        tally[runs.MIN_SPEED, lane] = np.inf
        tally[runs.MIN_UNPRESSED_SPEED, lane] = np.inf
        tally[runs.MIN_GAP, lane] = np.inf


@kernel
def _find_returns(engine: Engine, column: Column, k: int, used: int) -> None:
    """Find the minimum number of half periods after which every lane has returned, in column.returns."""
    counts, sizes, unit = column.records.counts, column.records.sizes, column.group.unit
    bound, relevant, entered, mirrored = (
        column.returns.bound,
        column.returns.relevant,
        column.returns.entered,
        column.returns.mirrored,
    )
    for lane in range(used):
        wanted = counts[lane, lane_state.TRAJECTORY] >= 0
        bound[lane] = sizes[lane, lane_state.RETURN_GOAL] * unit[lane] if wanted else -1.0
        relevant[lane] = CLOSING_GOAL * unit[lane]
        mirrored[lane] = column.group.symmetric[lane]
        entered[lane] = k - counts[lane, lane_state.STARTED]
    scale = table_of(engine.separate, OF_GROUP, engine.models).displacement_scale
    nearest_returns(scale, column.history, k, 2 * column.task.max_period, column.returns, used)


@kernel
def _is_due(column: Column, lane: int, k: int, check: bool) -> bool:
    """Return whether a lane is to be classified after k half periods; `check`: returns were looked for."""
    counts, group = column.records.counts, column.group
    if k >= counts[lane, lane_state.DEADLINE] or group.status[lane] != runs.OK:
        return True
    if counts[lane, lane_state.STATE] != lane_state.SETTLING and counts[lane, lane_state.STATE] != lane_state.GROWING:
        return False
    returns = check and column.returns.length[lane] > 0.0
    problem = record_of(column.models, lane).forced.free
    free = column.task.early and group.reach[lane] < free_reach(problem, lane_stops(group, lane))
    budget_spent: bool = column.records.sizes[lane, lane_state.COUNTED_IMPACTS] > SETTLING_IMPACTS
    return returns or free or budget_spent


@kernel
def _keep_final_state(column: Column, lane: int) -> int:
    """Keep the state in which a trajectory of a sweep ended, if it has one. Returns how it ended."""
    group, final = column.group, column.final_state
    if group.status[lane] != runs.OK:
        return ENDED_EARLY
    for j in range(final.shape[0]):
        final[j, 0] = group.even[2 * j * LANES + lane]
        final[j, 1] = group.even[(2 * j + 1) * LANES + lane]
    return RESTS if group.regime[lane] == RESTING else MOVES


@kernel
def _finish(column: Column, lane: int, k: int) -> None:
    """Write how long the trajectory in a lane ran and where it ended, and take the lane out of use."""
    counts = column.records.counts[lane]
    keep_state(column.results.final, column.group, lane, counts[lane_state.TRAJECTORY], k)
    codes = column.results.codes[counts[lane_state.TRAJECTORY]]
    codes[lane_state.HALVES_RUN] = k - counts[lane_state.STARTED]
    codes[lane_state.IMPACTS] = int(column.records.sizes[lane, lane_state.FOLLOWED_IMPACTS])
    _vacate(column, lane)


@kernel
def _move_to_first_lanes(engine: Engine, column: Column, k: int, used: int) -> None:
    """Move the last trajectories to the first lanes that are out of use, until no such lane is before one in use.

    k half periods are done.
    """
    counts, sizes = column.records.counts, column.records.sizes
    target, source = 0, used - 1
    while True:
        while target < used and counts[target, lane_state.TRAJECTORY] >= 0:
            target += 1
        while source >= 0 and counts[source, lane_state.TRAJECTORY] < 0:
            source -= 1
        if target >= source:
            break
        begin_separate(engine.models, engine.separate, target, counts[source, lane_state.TRAJECTORY])
        _move_lane(column.group, source, target)
        _move_history(column.history, k, k - counts[source, lane_state.STARTED], source, target)
        clear_lane(column.group, source)
        move_tangents(column.tangents, source, target)
        copy_vector(counts[target], counts[source])
        copy_vector(sizes[target], sizes[source])
        counts[source, lane_state.TRAJECTORY] = -1
        counts[source, lane_state.STATE] = lane_state.ENDING


@kernel
def _move_lane(group: Lanes, source: int, target: int) -> None:
    """Copy the current state of a trajectory to a lane that is out of use, at the start of a half period."""
    for c in range(group.even.shape[0] // LANES):
        group.even[c * LANES + target] = group.even[c * LANES + source]
    set_stops(group, target, lane_stops(group, source))
    group.close[target] = group.close[source]
    group.limit[target], group.limit[LANES + target] = group.limit[source], group.limit[LANES + source]
    group.reach[target] = group.reach[source]
    group.regime[target] = group.regime[source]
    group.status[target] = group.status[source]
    copy_vector(group.tally[:, target], group.tally[:, source])
    copy_vector(group.cursor[target], group.cursor[source])
    copy_vector(group.near[target], group.near[source])
    copy_matrix(group.resting[target], group.resting[source])
    copy_vector(group.since[target], group.since[source])
    for row in range(min(group.cursor[source, runs.EVENT_COUNT], group.events.shape[1])):
        copy_vector(group.events[target, row], group.events[source, row])


@kernel
def _move_history(history: StroboscopicHistory, k: int, halves: int, source: int, target: int) -> None:
    """Copy the history of a trajectory that has run for so many half periods to another lane; k are done in all."""
    size = history.min_speed.shape[0]
    for past in range(min(halves, size)):
        row = (k - past) % size
        copy_vector(history.states[row, :, target], history.states[row, :, source])
        copy_vector(history.impacts[row, :, target], history.impacts[row, :, source])
        copy_vector(history.held[row, :, target], history.held[row, :, source])
        history.min_speed[row, target] = history.min_speed[row, source]
        history.min_unpressed_speed[row, target] = history.min_unpressed_speed[row, source]
