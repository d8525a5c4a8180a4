"""Scheduler of a column of a map: all stops of one forcing frequency, each run until its motion can be named.

A group of lanes takes trajectories from a queue. A lane whose trajectory is finished takes the next one at the start of
a forcing period. One process computes one column at a time; maps are parallel across processes.

`classification` decides how a lane continues. In a sweep every trajectory starts at the final state of the one before
it, so only one lane is in use.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import free_reach
from grazemap_core.contact.kernels.half_period import counted
from grazemap_core.contact.kernels.sticking import put_between_stops
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.first_pass import LANE_BLOCK
from grazemap_core.maps.kernels.lane_errors import begin_error, forget_error, watch_passages
from grazemap_core.maps.kernels.lane_state import (
    ENDED_EARLY,
    GROWING,
    MOVES,
    RESTS,
    SETTLING,
    Column,
    begin_record,
    end_record,
    is_captured,
    move_record,
    stops_in_row,
)
from grazemap_core.maps.kernels.lane_tables import LANES, OF_GROUP, TablesPerLane, begin_separate
from grazemap_core.maps.kernels.lane_tangents import (
    NOTHING,
    begin_growth_of,
    carry_changes,
    count_impacts,
    move_tangents,
    save_lane_starts,
)
from grazemap_core.maps.kernels.lanes import (
    RESTING,
    Lanes,
    clear_lane,
    lane_stops,
    move_lane,
    start_lane,
    start_lane_on_stop,
    state_of_lane,
)
from grazemap_core.maps.kernels.lockstep import Engine, run_half
from grazemap_core.maps.tolerances import HALF_PERIOD_EVENTS, SETTLING_IMPACTS
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector, kernel, plain
from grazemap_core.numerics.jit.lane_values import record_of, table_of
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory, nearest_returns
from grazemap_core.simulation.tolerances import CLOSING_GOAL

HALVES_BETWEEN_CHECKS = 6
"""Half periods between searches for returns; a search costs as much as a half period. The number is even, because
trajectories start both at a search and with a forcing period."""


@kernel
def settle_column(blocks: int, column: Column, separate: TablesPerLane, classify_lane: Callable[..., int]) -> int:
    """Run all trajectories of a column and write their motions to column.results.

    Returns how the last trajectory of a sweep ended: ENDED_EARLY, or MOVES or RESTS in column.final_state.

    Parameters
    ----------
    blocks : int
        N.
    column : Column
        All but models and task is overwritten. The capacity of lanes and run is RECORDED_IMPACTS events, or 0
        where neither verification nor growth is wanted.
    separate : TablesPerLane
        If every trajectory has its own; there is one for each stops then.
    classify_lane : callable
        The address of `classification.classify_lane`.
    """
    column, separate = reference(column), reference(separate)
    engine = reference(Engine(blocks, column.models, separate, column.group, column.run))
    task, trajectory, returns = column.task, column.records.trajectory, column.returns
    for lane in range(LANES):
        _vacate(column, lane)
    n = task.starts.on_stop.shape[0]
    queued = plain(0)
    done = 0
    k = plain(0)
    used = plain(0)
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
            if trajectory[lane] < 0 or not _is_due(column, lane, k, check):
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
                k = plain(0)  # the next one starts at once
        needed = (n - done + LANE_BLOCK - 1) // LANE_BLOCK * LANE_BLOCK
        if queued == n and used > needed > 0:
            _move_to_first_lanes(engine, column, k, used)
            used = needed
    return ended


@kernel
def _vacate(column: Column, lane: int) -> None:
    """Take a lane out of use."""
    end_record(column.records, lane)
    column.tangents.carried[lane] = NOTHING
    column.tangents.errors.carried[lane] = 0
    clear_lane(column.group, lane)


@kernel
def _start_trajectories(engine: Engine, column: Column, k: int, queued: int, used: int, ended: int) -> tuple[int, int]:
    """Start trajectories in the lanes that are out of use, after k half periods.

    Returns how many have been started by now, and how many lanes are in use. `ended` is how the one before ended in a
    sweep; otherwise ENDED_EARLY.
    """
    task, group, trajectory, u = column.task, column.group, column.records.trajectory, column.run.u
    starts, each, n = task.starts, task.starts.directions.shape[0], task.starts.on_stop.shape[0]
    for lane in range(1 if task.follow else LANES):
        if queued < n and trajectory[lane] < 0:
            row, inherits = queued // each, task.inherits and queued == 0
            stops = stops_in_row(starts.stops, row)
            begin_separate(engine.models, engine.separate, lane, row)
            model = record_of(column.models, lane)
            problem = model.forced.free
            if ended != ENDED_EARLY:
                copy_matrix(u, column.final_state)
                stop = put_between_stops(problem, stops, u, ended == RESTS)
                inherits = inherits or (queued > 0 and not is_captured(column.results.codes[queued - 1]))
            else:
                for j in range(u.shape[0]):
                    for c in range(2):
                        u[j, c] = starts.base[row, j, c] + stops.unit * starts.directions[queued % each, j, c]
                        u[j, c] += starts.offset[row] * starts.aside[row, j, c]
                stop = starts.on_stop[queued]
            if stop != 0:
                start_lane_on_stop(group, lane, problem, stops, u, stop)
            else:
                start_lane(group, lane, problem, stops, u)
            if not inherits:
                forget_error(column.tangents.errors, lane)
            if model.blocks.verifiable:
                begin_error(problem.frequency, column.tangents.errors, lane)
                watch_passages(group, column.tangents.errors, lane)
            begin_record(column, lane, queued, k)
            queued += 1
            used = max(used, (lane + LANE_BLOCK) // LANE_BLOCK * LANE_BLOCK)
    return queued, used


@kernel
def _empty_full_events(column: Column, k: int, used: int) -> None:
    """Empty the events of the lanes whose remaining capacity may be less than another half period needs."""
    records, cursor, capacity = column.records, column.group.contacts.cursor, column.group.events.shape[1]
    if capacity == 0:  # none are kept
        return
    for lane in range(used):
        if cursor[lane, runs.EVENT_COUNT] > capacity - HALF_PERIOD_EVENTS:
            cursor[lane, runs.EVENT_COUNT] = 0
            records.events_from[lane] = k


@kernel
def _start_growth(column: Column, k: int, used: int) -> None:
    """Start measuring growth in the SETTLING lanes that have just enough half periods left for it."""
    records, task = column.records, column.task
    after = 2 * task.max_periods - task.growth_halves
    for lane in range(used):
        settles = records.trajectory[lane] >= 0 and records.state[lane] == SETTLING
        if settles and k - records.started[lane] == after:
            records.state[lane] = GROWING
            begin_growth_of(record_of(column.models, lane).forced.free, column.tangents, lane)


@kernel
def _run_half(engine: Engine, column: Column, k: int, used: int) -> None:
    """Carry the lanes in use, and the small changes along them, over the half period k; enter them into the history."""
    group, records = column.group, column.records
    _empty_full_events(column, k, used)
    if column.task.growth_halves > 0:
        _start_growth(column, k, used)
    carries = column.task.early or column.task.growth_halves > 0
    if carries:
        save_lane_starts(group, column.tangents, used)
    run_half(engine, k, used)
    if carries:
        count_impacts(group, column.tangents, used)
        carry_changes(engine, column.tangents, k, column.task.growth_skipped, used)
    tally = group.tally
    for lane in range(used):
        records.followed[lane] += tally[runs.FOLLOWED, lane]
        records.counted[lane] += counted(lane_stops(group, lane), tally[runs.FOLLOWED, lane])
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
    records, unit, returns = column.records, column.group.unit, column.returns
    for lane in range(used):
        wanted = records.trajectory[lane] >= 0
        returns.bound[lane] = records.return_goal[lane] * unit[lane] if wanted else -1.0
        returns.relevant[lane] = CLOSING_GOAL * unit[lane]
        returns.mirrored[lane] = column.group.symmetric[lane]
        returns.entered[lane] = k - records.started[lane]
    scale = table_of(engine.separate, OF_GROUP, engine.models).displacement_scale
    nearest_returns(scale, column.history, k, 2 * column.task.max_period, returns, used)


@kernel
def _is_due(column: Column, lane: int, k: int, check: bool) -> bool:
    """Return whether a lane is to be classified after k half periods; `check`: returns were looked for."""
    records, group = column.records, column.group
    if k >= records.deadline[lane] or group.status[lane] != runs.OK:
        return True
    if records.state[lane] != SETTLING and records.state[lane] != GROWING:
        return False
    returns = check and column.returns.length[lane] > 0.0
    problem = record_of(column.models, lane).forced.free
    free = column.task.early and group.reach[lane] < free_reach(problem, lane_stops(group, lane))
    budget_spent: bool = records.counted[lane] > SETTLING_IMPACTS
    return returns or free or budget_spent


@kernel
def _keep_final_state(column: Column, lane: int) -> int:
    """Keep the state in which a trajectory of a sweep ended, if it has one. Returns how it ended."""
    group = column.group
    if group.status[lane] != runs.OK:
        return ENDED_EARLY
    state_of_lane(group.even, lane, column.final_state)
    return RESTS if group.regime[lane] == RESTING else MOVES


@kernel
def _finish(column: Column, lane: int, k: int) -> None:
    """Write how long the trajectory in a lane ran and where it ended, and take the lane out of use."""
    records, group, final = column.records, column.group, column.results.final
    trajectory = records.trajectory[lane]
    if trajectory < final.states.shape[0]:
        sign = 1.0 if k % 2 == 0 else -1.0
        for c in range(final.states.shape[1]):
            final.states[trajectory, c] = sign * group.even[c * LANES + lane]
        resting = group.regime[lane] == RESTING
        final.resting_stop[trajectory] = sign * group.contacts.cursor[lane, runs.HELD] if resting else 0.0
    codes = column.results.codes[trajectory]
    codes[lane_state.HALVES_RUN] = k - records.started[lane]
    codes[lane_state.IMPACTS] = int(records.followed[lane])
    _vacate(column, lane)


@kernel
def _move_to_first_lanes(engine: Engine, column: Column, k: int, used: int) -> None:
    """Move the last trajectories to the first lanes that are out of use, until no such lane is before one in use.

    k half periods are done.
    """
    records = column.records
    target, source = 0, used - 1
    while True:
        while target < used and records.trajectory[target] >= 0:
            target += 1
        while source >= 0 and records.trajectory[source] < 0:
            source -= 1
        if target >= source:
            break
        begin_separate(engine.models, engine.separate, target, records.trajectory[source])
        move_lane(column.group, source, target)
        _move_history(column.history, k, k - records.started[source], source, target)
        clear_lane(column.group, source)
        move_tangents(column.tangents, source, target)
        move_record(records, source, target)


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
