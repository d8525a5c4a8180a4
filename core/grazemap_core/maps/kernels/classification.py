"""Classification of the lanes of a column after every half period.

A lane is in one of four states, and changes it as follows:

    state               condition                                                       next
    ------------------  --------------------------------------------------------------  ----------
    SETTLING            only the half periods that the measurement of growth takes are  GROWING
                        left
    SETTLING, GROWING   the trajectory ended early, or no contact is possible any more  finished
    SETTLING, GROWING   its orbit is verified, and captures it or cannot be shown to    finished
    SETTLING, GROWING   its motion is named by its returns, but not verified            REPEATING
                          the same, and no multiplier is wanted                         finished
    SETTLING, GROWING   it was the last half period                                     finished
    REPEATING           one motion period has passed                                    finished
    finished            in a sweep, in the middle of a forcing period                   ENDING
    ENDING              the forcing period has passed                                   finished

SETTLING
    The lane runs until its returns identify a periodic motion (`period_detection`). When its returns approach an orbit,
    the orbit is solved for (`verification`). If it is not verified, or does not capture the lane yet (`capture`), the
    lane runs on, and the next attempt is made closer to the orbit.
GROWING
    As SETTLING, but the growth of two small changes of the state is measured, or of one where that is chaotic already
    (`lane_tangents`). If the motion is not named in the end, it is classified by this growth (`lyapunov`).
REPEATING
    The lane runs for one more motion period with a basis of all small changes, which gives the multiplier.
ENDING
    The lane runs to the end of the forcing period. The next trajectory of the sweep starts at its final state.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import (
    GRAZE_UNRESOLVED,
    GROWTH_UNDECIDED,
    INFINITE,
    NOT_CAPTURED,
    NOT_CLOSED,
    RESOLVED,
    ROUNDING_DECIDES,
    STICKS,
    TOO_MANY_IMPACTS,
)
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import is_free_for_ever, reason_of_end
from grazemap_core.contact.kernels.runs import ANCHOR, EVENT_COUNT, OK
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.column import Column
from grazemap_core.maps.kernels.final_states import keep_orbit
from grazemap_core.maps.kernels.lane_errors import error_of, transient_growth_of
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lane_tangents import (
    ALL,
    begin_growth_of,
    begin_matrix_of,
    growth_of_lane,
    multiplier_of_lane,
)
from grazemap_core.maps.kernels.lockstep import RESTING, lane_stops
from grazemap_core.maps.tolerances import (
    APPARENT,
    APPROACH,
    APPROACH_RETRY,
    CAPTURE_RETRY,
    HALF_PERIOD_EVENTS,
    SETTLING_IMPACTS,
)
from grazemap_core.numerics.jit.compiled import copy_vector, kernel, plain, pointer_kernel
from grazemap_core.numerics.jit.lane_values import record_of
from grazemap_core.orbits.kernels.verification import (
    Verification,
    apparent_length,
    guess_from_record,
    guess_from_replay,
    unit_of_speeds,
    verify,
)
from grazemap_core.orbits.tolerances import ORBIT_NEARBY
from grazemap_core.simulation.kernels.period_detection import (
    NamedMotion,
    compare_windows,
    detect_period,
    mean_section,
    name_of,
    orbit_nearby,
    separation,
    unnamed,
    without_contacts,
)
from grazemap_core.simulation.tolerances import CLOSING_FLOOR, CLOSING_GOAL, LIMIT_DISTANCE


@kernel
def empty_full_events(column: Column, k: int, used: int) -> None:
    """Empty the events of the lanes whose remaining capacity may be less than another half period needs."""
    counts, cursor, capacity = column.records.counts, column.group.cursor, column.group.events.shape[1]
    if capacity == 0:  # none are kept
        return
    for lane in range(used):
        if cursor[lane, EVENT_COUNT] > capacity - HALF_PERIOD_EVENTS:
            cursor[lane, EVENT_COUNT] = 0
            counts[lane, lane_state.EVENTS_FROM] = k


@kernel
def start_growth(column: Column, k: int, used: int) -> None:
    """Start measuring growth in the SETTLING lanes that have just enough half periods left for it."""
    counts, task = column.records.counts, column.task
    after = 2 * task.max_periods - task.growth_halves
    for lane in range(used):
        taken = counts[lane, lane_state.TRAJECTORY] >= 0 and counts[lane, lane_state.STATE] == lane_state.SETTLING
        if taken and k - counts[lane, lane_state.STARTED] == after:
            counts[lane, lane_state.STATE] = lane_state.GROWING
            begin_growth_of(record_of(column.models, lane).forced.free, column.tangents, lane)


@pointer_kernel
def classify_lane(column: Column, lane: int, k: int, returned: int, closed: int) -> int:
    """Classify a lane after k half periods. Returns whether its trajectory is finished, 1 or 0.

    Parameters
    ----------
    returned : int
        Minimum number of half periods after which the lane has returned to within its RETURN_GOAL; 0 if it has not, or
        if returns were not looked for.
    closed : int
        Whether it has returned to within CLOSING_GOAL, 1 or 0.
    """
    group, counts = column.group, column.records.counts[lane]
    state = counts[lane_state.STATE]
    finished = True
    if state in (lane_state.SETTLING, lane_state.GROWING):
        finished = _classify_settling(column, lane, k, returned, closed != 0)
    elif state == lane_state.REPEATING and group.status[lane] == OK and column.tangents.carried[lane] == ALL:
        results, trajectory = column.results, counts[lane_state.TRAJECTORY]
        multiplier = multiplier_of_lane(record_of(column.models, lane).forced.free, column.tangents, lane)
        _write_multiplier(results.codes[trajectory], results.figures[trajectory], multiplier)
    if finished and column.task.follow and k % 2 == 1 and group.status[lane] == OK and state != lane_state.ENDING:
        counts[lane_state.STATE], counts[lane_state.DEADLINE] = lane_state.ENDING, k + 1
        return 0
    return 1 if finished else 0


@kernel
def _classify_settling(column: Column, lane: int, k: int, returned: int, closed: bool) -> bool:
    """Classify a lane that is SETTLING or GROWING. Returns whether its trajectory is finished."""
    task, group, counts = column.task, column.group, column.records.counts[lane]
    trajectory = counts[lane_state.TRAJECTORY]
    codes, figures = column.results.codes[trajectory], column.results.figures[trajectory]
    halves = k - counts[lane_state.STARTED]
    last = halves >= 2 * task.max_periods
    problem, stops, reach = record_of(column.models, lane).forced.free, lane_stops(group, lane), group.reach[lane]
    if group.status[lane] != OK or column.records.sizes[lane, lane_state.COUNTED_IMPACTS] > SETTLING_IMPACTS:
        reason = TOO_MANY_IMPACTS if group.status[lane] == OK else reason_of_end(group.status[lane])
        _write_motion(codes, figures, unnamed(reason), -1, RESOLVED)
        return True
    farthest = reach + error_of(column.tangents.errors, lane)
    if is_free_for_ever(problem, stops, farthest, group.cursor[lane, ANCHOR]):
        _write_free_motion(problem, stops.symmetric, codes, figures, (halves + 1) // 2)
        _write_captured(column, lane)
        return True
    motion = unnamed(NOT_CLOSED)
    if closed or last:
        motion = detect_period(problem, stops, column.history, lane, k, task.max_period, halves, reach)
    if motion.reason == RESOLVED:
        return _classify_named(column, lane, k, motion, last)
    if not last:
        return _classify_approach(column, lane, k, returned)
    if _classify_near_orbit(column, lane, k):
        return True
    _write_motion(codes, figures, motion, -1, RESOLVED)
    if task.growth_halves > 0:
        _write_growth(column, codes, figures, lane)
    return True


@kernel
def _classify_approach(column: Column, lane: int, k: int, returned: int) -> bool:
    """Verify the orbit that a lane approaches, if there is one. Returns whether the lane is captured by it."""
    group, sizes = column.group, column.records.sizes[lane]
    sought = record_of(column.models, lane).blocks.verifiable and sizes[lane_state.RETURN_GOAL] != CLOSING_GOAL
    if not (sought and returned > 0 and group.regime[lane] != RESTING):
        return False
    distance = _distance_of_orbit(column, lane, k, returned)
    if not np.isfinite(distance):
        return False
    verified = _verify(column, lane, k, returned, max(distance, LIMIT_DISTANCE))
    if verified.reason != RESOLVED:
        sizes[lane_state.RETURN_GOAL] = max(APPROACH_RETRY * sizes[lane_state.RETURN_GOAL], CLOSING_GOAL)
        return False
    return _write_orbit(
        column, lane, k, returned, verified, (k - column.records.counts[lane, lane_state.STARTED] + 1) // 2
    )


@kernel
def _is_near_orbit(column: Column, lane: int, length: int) -> bool:
    """Return whether `length` half periods are a multiple of the length of the orbit that was verified near a lane."""
    known = column.records.counts[lane, lane_state.NEAR_ORBIT]
    return bool(known > 0 and length % known == 0)


@kernel
def _distance_of_orbit(column: Column, lane: int, k: int, length: int) -> float:
    """Return the distance of a lane from the orbit of `length` half periods that it approaches; infinite if none."""
    if length % 2 == 1 and length > column.task.max_period:
        return np.inf
    known, stops = _is_near_orbit(column, lane, length), lane_stops(column.group, lane)
    return orbit_nearby(record_of(column.models, lane).forced.free, stops, column.history, lane, k, length, known)


@kernel
def _write_orbit(column: Column, lane: int, k: int, length: int, verified: Verification, after: int) -> bool:
    """Write the verified orbit near a lane. Returns whether the lane is captured, or cannot be shown to be.

    Otherwise the lane runs until its returns, after `length` half periods, are as much shorter as it needs.
    """
    counts, sizes = column.records.counts[lane], column.records.sizes[lane]
    trajectory = counts[lane_state.TRAJECTORY]
    codes, figures = column.results.codes[trajectory], column.results.figures[trajectory]
    _write_verified(codes, figures, verified, after)
    problem, stops, final = (
        record_of(column.models, lane).forced.free,
        lane_stops(column.group, lane),
        column.results.final,
    )
    keep_orbit(final, problem, stops, column.verification, verified, trajectory)
    if verified.ratio < 1.0:
        _write_captured(column, lane)
        return True
    codes[lane_state.UNVERIFIED] = NOT_CAPTURED
    codes[lane_state.SENSITIVE] = column.tangents.errors.sensitive[lane]
    counts[lane_state.NEAR_ORBIT] = verified.length
    now = separation(problem, column.history, lane, k, length, column.group.unit[lane], np.inf)
    goal = min(CAPTURE_RETRY / verified.ratio, CAPTURE_RETRY) * now
    if goal < CLOSING_FLOOR:  # round-off
        if sizes[lane_state.RETURN_GOAL] <= CLOSING_GOAL:
            return True
        goal = CLOSING_GOAL
    sizes[lane_state.RETURN_GOAL] = goal
    return False


@kernel
def _write_captured(column: Column, lane: int) -> None:
    """Write how sensitive a trajectory was that a verified motion captures."""
    errors, trajectory = column.tangents.errors, column.records.counts[lane, lane_state.TRAJECTORY]
    codes = column.results.codes[trajectory]
    column.results.figures[trajectory, lane_state.TRANSIENT_GROWTH] = transient_growth_of(errors, lane)
    codes[lane_state.SENSITIVE] = errors.sensitive[lane]
    if errors.sensitive[lane] != 0:
        codes[lane_state.UNVERIFIED] = ROUNDING_DECIDES


@kernel
def _classify_near_orbit(column: Column, lane: int, k: int) -> bool:
    """Write the orbit that a lane is near at its end, without being captured. Returns whether there is one."""
    counts = column.records.counts[lane]
    length = counts[lane_state.NEAR_ORBIT]
    if length == 0 or column.group.regime[lane] == RESTING or not compare_windows(column.history, lane, k, length)[0]:
        return False
    verified = _verify(column, lane, k, length, APPROACH)
    if verified.reason != RESOLVED:
        return False
    _write_orbit(column, lane, k, length, verified, (k - counts[lane_state.STARTED] + 1) // 2)
    return True


@kernel
def _classify_named(column: Column, lane: int, k: int, motion: NamedMotion, last: bool) -> bool:
    """Write a motion that was named by its returns. It is verified if possible; else its multiplier is computed next.

    Returns whether the trajectory is finished.
    """
    _, period, right, left, symmetric, _, sticking = motion
    counts = column.records.counts[lane]
    trajectory = counts[lane_state.TRAJECTORY]
    codes, figures = column.results.codes[trajectory], column.results.figures[trajectory]
    window = period if symmetric else 2 * period  # half periods after which z returns
    after = max(0, (k - counts[lane_state.STARTED] - 3 * window + 1) // 2)
    if right == -1 and left == -1:
        unverified = GRAZE_UNRESOLVED  # without a graze the envelope would lie between the stops
    elif sticking or right == INFINITE or left == INFINITE or column.group.regime[lane] == RESTING:
        unverified = STICKS
    else:
        verified = _verify(column, lane, k, window, LIMIT_DISTANCE)
        unverified = verified.reason
        if unverified == RESOLVED:
            return _write_orbit(column, lane, k, window, verified, after) or last
    _write_motion(codes, figures, motion, after, unverified)
    codes[lane_state.SENSITIVE] = column.tangents.errors.sensitive[lane]
    _write_mean(column, codes, figures, lane, k)
    if column.task.growth_halves == 0:
        return True
    begin_matrix_of(column.tangents, lane)
    counts[lane_state.STATE] = lane_state.REPEATING
    counts[lane_state.DEADLINE] = k + window
    return False


@kernel
def _verify(column: Column, lane: int, k: int, length: int, distance: float) -> Verification:
    """Look for the motion near a lane and verify it, as `verification.verify`.

    The shortest time after which the impacts repeat is tried first: that of the orbit that was verified near the lane,
    if there is one. Otherwise they are compared to within about `distance` only, so the orbit must be within that
    distance.
    """
    model, scratch, group = record_of(column.models, lane), column.verification, column.group
    problem, blocks = model.forced.free, model.blocks
    stops, events, rows = lane_stops(group, lane), group.events[lane], group.cursor[lane, EVENT_COUNT]
    error = error_of(column.tangents.errors, lane)
    if not blocks.verifiable:
        return verify(problem, blocks, scratch, stops, plain(0), length, distance, error)
    recorded = column.records.counts[lane, lane_state.EVENTS_FROM] <= k - length and rows <= events.shape[0]
    _write_arrival(column, lane, k - length if recorded else k)
    if recorded:
        count = guess_from_record(problem, scratch, stops, k, length, events, rows)
    else:
        start = scratch.replay.u
        for j in range(start.shape[0]):
            start[j, 0] = group.even[2 * j * LANES + lane]
            start[j, 1] = group.even[(2 * j + 1) * LANES + lane]
        copy_vector(scratch.replay.cursor, group.cursor[lane])
        copy_vector(scratch.replay.near[:3], group.near[lane])
        count = guess_from_replay(model.forced, scratch, stops, k, length)
    part, nearby = column.records.counts[lane, lane_state.NEAR_ORBIT], distance
    if not _is_near_orbit(column, lane, length):
        apart = APPARENT * distance * stops.unit / unit_of_speeds(problem, stops)
        part, nearby = apparent_length(scratch, stops, count, length, apart), APPARENT / ORBIT_NEARBY * distance
    if part < length:
        if recorded:
            _write_arrival(column, lane, k - part)
        few = guess_from_record(problem, scratch, stops, k, part, events, rows) if recorded else count * part // length
        verified = verify(problem, blocks, scratch, stops, few, part, nearby, error)
        if verified.reason == RESOLVED:
            return verified
        if recorded:
            _write_arrival(column, lane, k - length)
            count = guess_from_record(problem, scratch, stops, k, length, events, rows)
    return verify(problem, blocks, scratch, stops, count, length, distance, error)


@kernel
def _write_arrival(column: Column, lane: int, k: int) -> None:
    """Write the state of a lane after k half periods where verification looks for it."""
    states, arrival = column.history.states, column.verification.capture.arrival
    resonant = record_of(column.models, lane).forced.free.resonant_steady
    row = k % states.shape[0]
    for j in range(arrival.shape[0]):
        for c in range(2):
            arrival[j, c] = states[row, 2 * j + c, lane] - (resonant[0, j, c] if resonant.shape[1] > 0 else 0.0)


@kernel
def _write_motion(codes: Integers, figures: Floats, motion: NamedMotion, after: int, unverified: int) -> None:
    """Write the name of a motion, or why it has none; multiplier, exponent and means are not known yet."""
    codes[lane_state.REASON] = motion.reason
    codes[lane_state.PERIOD] = motion.period
    codes[lane_state.IMPACTS_RIGHT] = motion.impacts_right
    codes[lane_state.IMPACTS_LEFT] = motion.impacts_left
    codes[lane_state.SYMMETRIC] = 1 if motion.symmetric else 0
    codes[lane_state.SETTLED_AFTER] = after
    codes[lane_state.STICKING] = 1 if motion.sticking else 0
    codes[lane_state.GROWTH] = GROWTH_UNDECIDED
    codes[lane_state.UNVERIFIED] = unverified
    codes[lane_state.SENSITIVE] = 0
    figures[:] = np.nan
    if np.isfinite(motion.min_speed):
        figures[lane_state.LEAST_VELOCITY] = motion.min_speed


@kernel
def _write_free_motion(problem: CellProblem, symmetric: bool, codes: Integers, figures: Floats, after: int) -> None:
    """Write the steady motion without contacts, which attracts all others once no contact is possible any more."""
    _write_motion(codes, figures, without_contacts(symmetric), after, RESOLVED)
    figures[lane_state.MEAN_POSITION], figures[lane_state.MEAN_VELOCITY] = 0.0, 0.0
    figures[lane_state.LYAPUNOV] = _free_exponent(problem)
    figures[lane_state.MULTIPLIER] = math.exp(figures[lane_state.LYAPUNOV])


@kernel
def _free_exponent(problem: CellProblem) -> float:
    """Return the largest exponent per forcing period of the motion without contacts."""
    slowest = np.inf
    for j in range(problem.decay.shape[0]):
        decay, discriminant = problem.decay[j], problem.discriminant[j]
        if discriminant < 0.0:
            decay = problem.frequency_squared[j] / (decay + math.sqrt(-discriminant))
        slowest = min(slowest, decay)
    return -slowest * problem.step * problem.cells


@kernel
def _write_verified(codes: Integers, figures: Floats, verified: Verification, after: int) -> None:
    """Write a motion that is verified."""
    right, left = float(verified.right), float(verified.left)
    motion = name_of(verified.length, right, left, 0.0, 0.0, verified.min_impact_speed)
    _write_motion(codes, figures, motion, after, RESOLVED)
    _write_multiplier(codes, figures, verified.multiplier)
    figures[lane_state.MEAN_POSITION] = verified.mean_position
    figures[lane_state.MEAN_VELOCITY] = verified.mean_velocity


@kernel
def _write_mean(column: Column, codes: Integers, figures: Floats, lane: int, k: int) -> None:
    """Write the mean position and velocity of the motion that was named."""
    problem, unit = record_of(column.models, lane).forced.free, column.group.unit[lane]
    x, v = mean_section(problem, column.history, lane, k, codes[lane_state.PERIOD])
    figures[lane_state.MEAN_POSITION] = x / unit
    figures[lane_state.MEAN_VELOCITY] = v / (problem.omega * unit)


@kernel
def _write_multiplier(codes: Integers, figures: Floats, multiplier: float) -> None:
    """Write the multiplier and the exponent of a motion, from the multiplier over one return of z."""
    halves = 2.0 if codes[lane_state.SYMMETRIC] != 0 else 1.0
    figures[lane_state.MULTIPLIER] = multiplier**halves
    # a square may underflow
    figures[lane_state.LYAPUNOV] = halves * np.log(multiplier) / codes[lane_state.PERIOD]


@kernel
def _write_growth(column: Column, codes: Integers, figures: Floats, lane: int) -> None:
    """Write what the growth along a lane implies, if it was measured to the end."""
    problem, tangents, task = record_of(column.models, lane).forced.free, column.tangents, column.task
    growth, exponent, error = growth_of_lane(problem, column.group.unit[lane], task.growth_skipped, tangents, lane)
    codes[lane_state.GROWTH] = growth
    figures[lane_state.LYAPUNOV] = exponent * problem.step * problem.cells
    figures[lane_state.LYAPUNOV_ERROR] = error * problem.step * problem.cells if np.isfinite(error) else np.nan
