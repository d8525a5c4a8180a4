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
from grazemap_core.contact.kernels.runs import (
    ANCHOR,
    EVENT_COUNT,
    OK,
    contact_of_lane,
    contact_of_run,
    copy_contact,
)
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.lane_errors import error_of, transient_growth_of
from grazemap_core.maps.kernels.lane_state import ENDING, GROWING, REPEATING, SETTLING, Column
from grazemap_core.maps.kernels.lane_tables import LaneModel
from grazemap_core.maps.kernels.lane_tangents import ALL, begin_matrix_of, growth_of_lane, multiplier_of_lane
from grazemap_core.maps.kernels.lanes import RESTING, lane_stops, state_of_lane
from grazemap_core.maps.tolerances import (
    APPARENT,
    APPROACH,
    APPROACH_RETRY,
    CAPTURE_RETRY,
    SETTLING_IMPACTS,
)
from grazemap_core.numerics.jit.compiled import kernel, plain, pointer_kernel
from grazemap_core.numerics.jit.lane_values import record_of
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.verification import (
    Guess,
    Verification,
    apparent_length,
    guess_from_record,
    guess_from_replay,
    unit_of_speeds,
    verify,
)
from grazemap_core.orbits.tolerances import ORBIT_NEARBY
from grazemap_core.records import NamedTuple
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


class LaneView(NamedTuple):
    """A lane that is classified, with what belongs to its trajectory.

    The stops are not here: kernels take them by value, and would be compiled again for a reference to them.
    """

    lane: int
    """Its index."""
    k: int
    """Half periods since the column began."""
    halves: int
    """Half periods since the trajectory started."""
    model: LaneModel
    """The oscillator at its frequency."""
    codes: Integers
    """(CODES,) Receives the results, as `TrajectoryResults.codes`."""
    figures: Floats
    """(FIGURES,) Receives the results, as `TrajectoryResults.figures`."""


@pointer_kernel
def classify_lane(column: Column, lane: int, k: int, returned: int, closed: int) -> int:
    """Classify a lane after k half periods. Returns whether its trajectory is finished, 1 or 0.

    Parameters
    ----------
    returned : int
        Minimum number of half periods after which the lane has returned to within its `return_goal`; 0 if it has not,
        or if returns were not looked for.
    closed : int
        Whether it has returned to within CLOSING_GOAL, 1 or 0.
    """
    records, group, results = column.records, column.group, column.results
    trajectory, state = records.trajectory[lane], records.state[lane]
    view = reference(
        LaneView(
            lane,
            k,
            k - records.started[lane],
            record_of(column.models, lane),
            results.codes[trajectory],
            results.figures[trajectory],
        )
    )
    finished = True
    if state in (SETTLING, GROWING):
        finished = _classify_settling(column, view, returned, closed != 0)
    elif state == REPEATING and group.status[lane] == OK and column.tangents.carried[lane] == ALL:
        _write_multiplier(view, multiplier_of_lane(view.model.forced.free, column.tangents, lane))
    if finished and column.task.follow and k % 2 == 1 and group.status[lane] == OK and state != ENDING:
        records.state[lane], records.deadline[lane] = ENDING, k + 1
        return 0
    return 1 if finished else 0


@kernel
def _classify_settling(column: Column, view: LaneView, returned: int, closed: bool) -> bool:
    """Classify a lane that is SETTLING or GROWING. Returns whether its trajectory is finished."""
    task, group, lane, halves = column.task, column.group, view.lane, view.halves
    last = halves >= 2 * task.max_periods
    problem, stops, reach = view.model.forced.free, lane_stops(group, lane), group.reach[lane]
    if group.status[lane] != OK or column.records.counted[lane] > SETTLING_IMPACTS:
        reason = TOO_MANY_IMPACTS if group.status[lane] == OK else reason_of_end(group.status[lane])
        _write_motion(view, unnamed(reason), -1, RESOLVED)
        return True
    farthest = reach + error_of(column.tangents.errors, lane)
    if is_free_for_ever(problem, stops, farthest, group.contacts.cursor[lane, ANCHOR]):
        _write_free_motion(view, stops.symmetric)
        _write_captured(column, view)
        return True
    motion = unnamed(NOT_CLOSED)
    if closed or last:
        motion = detect_period(problem, stops, column.history, lane, view.k, task.max_period, halves, reach)
    if motion.reason == RESOLVED:
        return _classify_named(column, view, motion, last)
    if not last:
        return _classify_approach(column, view, returned)
    if _classify_near_orbit(column, view):
        return True
    _write_motion(view, motion, -1, RESOLVED)
    if task.growth_halves > 0:
        _write_growth(column, view)
    return True


@kernel
def _classify_approach(column: Column, view: LaneView, returned: int) -> bool:
    """Verify the orbit that a lane approaches, if there is one. Returns whether the lane is captured by it."""
    lane, goal = view.lane, column.records.return_goal
    sought = view.model.blocks.verifiable and goal[lane] != CLOSING_GOAL
    if not (sought and returned > 0 and column.group.regime[lane] != RESTING):
        return False
    if returned % 2 == 1 and returned > column.task.max_period:
        return False
    known, stops = _is_near_orbit(column, lane, returned), lane_stops(column.group, lane)
    distance = orbit_nearby(view.model.forced.free, stops, column.history, lane, view.k, returned, known)
    if not np.isfinite(distance):
        return False
    verified = _verify(column, view, returned, max(distance, LIMIT_DISTANCE))
    if verified.reason != RESOLVED:
        goal[lane] = max(APPROACH_RETRY * goal[lane], CLOSING_GOAL)
        return False
    return _write_orbit(column, view, returned, verified, (view.halves + 1) // 2)


@kernel
def _is_near_orbit(column: Column, lane: int, length: int) -> bool:
    """Return whether `length` half periods are a multiple of the length of the orbit that was verified near a lane."""
    known = column.records.near_orbit[lane]
    return bool(known > 0 and length % known == 0)


@kernel
def _write_orbit(column: Column, view: LaneView, length: int, verified: Verification, after: int) -> bool:
    """Write the verified orbit near a lane. Returns whether the lane is captured, or cannot be shown to be.

    Otherwise the lane runs until its returns, after `length` half periods, are as much shorter as it needs.
    """
    lane, goal, problem = view.lane, column.records.return_goal, view.model.forced.free
    _write_verified(view, verified, after)
    _keep_orbit(column, view, verified)
    if verified.ratio < 1.0:
        _write_captured(column, view)
        return True
    view.codes[lane_state.UNVERIFIED] = NOT_CAPTURED
    view.codes[lane_state.SENSITIVE] = column.tangents.errors.sensitive[lane]
    column.records.near_orbit[lane] = verified.length
    now = separation(problem, column.history, lane, view.k, length, column.group.unit[lane], np.inf)
    closer = min(CAPTURE_RETRY / verified.ratio, CAPTURE_RETRY) * now
    if closer < CLOSING_FLOOR:  # round-off
        if goal[lane] <= CLOSING_GOAL:
            return True
        closer = CLOSING_GOAL
    goal[lane] = closer
    return False


@kernel
def _keep_orbit(column: Column, view: LaneView, verified: Verification) -> None:
    """Keep the impacts of the orbit that was just verified near a trajectory, if final states are wanted."""
    final, scratch, trajectory = column.results.final, column.verification, column.records.trajectory[view.lane]
    if trajectory >= final.states.shape[0]:
        return
    problem, stops = view.model.forced.free, lane_stops(column.group, view.lane)
    count, unit = verified.right + verified.left, problem.omega * unit_of_speeds(problem, stops)
    halves = 1 + verified.length % 2  # 2 for a symmetric orbit: half the period, and its mirror image after it
    impacts = final.impacts[trajectory]
    final.counts[trajectory] = halves * count
    for half in range(halves):
        sign, shift = 1.0 - 2.0 * half, half * verified.length * math.pi
        for i in range(count):
            impacts[0, half * count + i] = sign * scratch.sides[i]
            impacts[1, half * count + i] = scratch.solution[0, i] + shift
            impacts[2, half * count + i] = sign * scratch.solution[1, i] * unit


@kernel
def _write_captured(column: Column, view: LaneView) -> None:
    """Write how sensitive a trajectory was that a verified motion captures."""
    errors = column.tangents.errors
    view.figures[lane_state.TRANSIENT_GROWTH] = transient_growth_of(errors, view.lane)
    view.codes[lane_state.SENSITIVE] = errors.sensitive[view.lane]
    if errors.sensitive[view.lane] != 0:
        view.codes[lane_state.UNVERIFIED] = ROUNDING_DECIDES


@kernel
def _classify_near_orbit(column: Column, view: LaneView) -> bool:
    """Write the orbit that a lane is near at its end, without being captured. Returns whether there is one."""
    lane, length = view.lane, column.records.near_orbit[view.lane]
    if length == 0 or column.group.regime[lane] == RESTING:
        return False
    if not compare_windows(column.history, lane, view.k, length)[0]:
        return False
    verified = _verify(column, view, length, APPROACH)
    if verified.reason != RESOLVED:
        return False
    _write_orbit(column, view, length, verified, (view.halves + 1) // 2)
    return True


@kernel
def _classify_named(column: Column, view: LaneView, motion: NamedMotion, last: bool) -> bool:
    """Write a motion that was named by its returns. It is verified if possible; else its multiplier is computed next.

    Returns whether the trajectory is finished.
    """
    _, period, right, left, symmetric, _, sticking = motion
    lane, records = view.lane, column.records
    window = period if symmetric else 2 * period  # half periods after which z returns
    after = max(0, (view.halves - 3 * window + 1) // 2)
    if right == -1 and left == -1:
        unverified = GRAZE_UNRESOLVED  # without a graze the envelope would lie between the stops
    elif sticking or right == INFINITE or left == INFINITE or column.group.regime[lane] == RESTING:
        unverified = STICKS
    else:
        verified = _verify(column, view, window, LIMIT_DISTANCE)
        unverified = verified.reason
        if unverified == RESOLVED:
            return _write_orbit(column, view, window, verified, after) or last
    _write_motion(view, motion, after, unverified)
    view.codes[lane_state.SENSITIVE] = column.tangents.errors.sensitive[lane]
    _write_mean(column, view, period)
    if column.task.growth_halves == 0:
        return True
    begin_matrix_of(column.tangents, lane)
    records.state[lane], records.deadline[lane] = REPEATING, view.k + window
    return False


@kernel
def _verify(column: Column, view: LaneView, length: int, distance: float) -> Verification:
    """Look for the motion near a lane and verify it, as `verification.verify`.

    The shortest time after which the impacts repeat is tried first: that of the orbit that was verified near the lane,
    if there is one. Otherwise they are compared to within about `distance` only, so the orbit must be within that
    distance.
    """
    lane, k, group, scratch = view.lane, view.k, column.group, column.verification
    problem, blocks, stops = view.model.forced.free, view.model.blocks, lane_stops(group, lane)
    error = error_of(column.tangents.errors, lane)
    if not blocks.verifiable:
        return verify(problem, blocks, stops, Guess(plain(0), length, distance, error), scratch)
    events, rows = group.events[lane], group.contacts.cursor[lane, EVENT_COUNT]
    recorded = column.records.events_from[lane] <= k - length and rows <= events.shape[0]
    if recorded:
        count = _guess_from_events(column, view, length)
    else:
        _write_arrival(column, view, k)
        state_of_lane(group.even, lane, scratch.replay.u)
        copy_contact(contact_of_run(scratch.replay), contact_of_lane(group.contacts, lane))
        count = guess_from_replay(view.model.forced, stops, k, length, scratch)
    part, nearby = column.records.near_orbit[lane], distance
    if not _is_near_orbit(column, lane, length):
        apart = APPARENT * distance * stops.unit / unit_of_speeds(problem, stops)
        part, nearby = apparent_length(scratch, stops, count, length, apart), APPARENT / ORBIT_NEARBY * distance
    if part < length:
        few = _guess_from_events(column, view, part) if recorded else count * part // length
        verified = verify(problem, blocks, stops, Guess(few, part, nearby, error), scratch)
        if verified.reason == RESOLVED:
            return verified
        if recorded:
            count = _guess_from_events(column, view, length)
    return verify(problem, blocks, stops, Guess(count, length, distance, error), scratch)


@kernel
def _guess_from_events(column: Column, view: LaneView, length: int) -> int:
    """Take the impacts of a lane in the last `length` half periods, and its state before, as `guess_from_record`."""
    _write_arrival(column, view, view.k - length)
    group, lane = column.group, view.lane
    events = group.events[lane][: group.contacts.cursor[lane, EVENT_COUNT]]
    problem, stops = view.model.forced.free, lane_stops(group, lane)
    return guess_from_record(problem, stops, view.k, length, events, column.verification)


@kernel
def _write_arrival(column: Column, view: LaneView, k: int) -> None:
    """Write the state of a lane after k half periods where verification looks for it."""
    states, arrival = column.history.states, column.verification.capture.arrival
    resonant = view.model.forced.free.resonant_steady
    row = k % states.shape[0]
    for j in range(arrival.shape[0]):
        for c in range(2):
            arrival[j, c] = states[row, 2 * j + c, view.lane] - (resonant[0, j, c] if resonant.shape[1] > 0 else 0.0)


@kernel
def _write_motion(view: LaneView, motion: NamedMotion, after: int, unverified: int) -> None:
    """Write the name of a motion, or why it has none; multiplier, exponent and means are not known yet."""
    codes, figures = view.codes, view.figures
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
def _write_free_motion(view: LaneView, symmetric: bool) -> None:
    """Write the steady motion without contacts, which attracts all others once no contact is possible any more."""
    _write_motion(view, without_contacts(symmetric), (view.halves + 1) // 2, RESOLVED)
    figures = view.figures
    figures[lane_state.MEAN_POSITION], figures[lane_state.MEAN_VELOCITY] = 0.0, 0.0
    figures[lane_state.LYAPUNOV] = _free_exponent(view.model.forced.free)
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
def _write_verified(view: LaneView, verified: Verification, after: int) -> None:
    """Write a motion that is verified."""
    right, left = float(verified.right), float(verified.left)
    motion = name_of(verified.length, right, left, 0.0, 0.0, verified.min_impact_speed)
    _write_motion(view, motion, after, RESOLVED)
    _write_multiplier(view, verified.multiplier)
    view.figures[lane_state.MEAN_POSITION] = verified.mean_position
    view.figures[lane_state.MEAN_VELOCITY] = verified.mean_velocity


@kernel
def _write_mean(column: Column, view: LaneView, period: int) -> None:
    """Write the mean position and velocity of a motion that was named, with so many forcing periods."""
    problem, unit = view.model.forced.free, column.group.unit[view.lane]
    x, v = mean_section(problem, column.history, view.lane, view.k, period)
    view.figures[lane_state.MEAN_POSITION] = x / unit
    view.figures[lane_state.MEAN_VELOCITY] = v / (problem.omega * unit)


@kernel
def _write_multiplier(view: LaneView, multiplier: float) -> None:
    """Write the multiplier and the exponent of a motion, from the multiplier over one return of z."""
    halves = 2.0 if view.codes[lane_state.SYMMETRIC] != 0 else 1.0
    view.figures[lane_state.MULTIPLIER] = multiplier**halves
    # a square may underflow
    view.figures[lane_state.LYAPUNOV] = halves * np.log(multiplier) / view.codes[lane_state.PERIOD]


@kernel
def _write_growth(column: Column, view: LaneView) -> None:
    """Write what the growth along a lane implies, if it was measured to the end."""
    problem, lane, skipped = view.model.forced.free, view.lane, column.task.growth_skipped
    growth, exponent, error = growth_of_lane(problem, column.group.unit[lane], skipped, column.tangents, lane)
    view.codes[lane_state.GROWTH] = growth
    view.figures[lane_state.LYAPUNOV] = exponent * problem.step * problem.cells
    view.figures[lane_state.LYAPUNOV_ERROR] = error * problem.step * problem.cells if np.isfinite(error) else np.nan
