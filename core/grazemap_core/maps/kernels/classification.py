"""What becomes of a lane of a column at the end of a half period: whether its motion is known, and what is done next.

A lane settles until its returns tell a periodic motion (`closing`). One that comes ever closer to an orbit need not be
waited for: the orbit is solved for, and where it is proven (`proving`) its motion is known; else the lane goes on.
Where nothing can be proven, or is wanted, the lane is put to where its returns lead (`leaping`). A
motion that was named by its returns alone is run on for as long as it repeats, to give its multiplier. In the last of
the half periods that a lane has, small changes are carried along, so that in the end their growth can tell what it is
(`lyapunov`).
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import (
    GRAZE_UNRESOLVED,
    GROWTH_UNDECIDED,
    INFINITE,
    NOT_CLOSED,
    RESOLVED,
    STICKS,
    TOO_MANY_IMPACTS,
)
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import is_free_for_ever, reason_of_end
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import ANCHOR, OK, ROWS
from grazemap_core.maps.kernels.extrapolated_restart import has_just_landed, land, leap
from grazemap_core.maps.kernels.lane_state import (
    AT,
    BEGAN,
    COUNTED,
    DOUBT,
    DUE,
    GOAL,
    GROWS,
    GROWTH,
    IMPACTS_LEFT,
    IMPACTS_RIGHT,
    LEAPT,
    LEAST_VELOCITY,
    LEAVES,
    LOOK,
    LYAPUNOV,
    LYAPUNOV_ERROR,
    MEAN_POSITION,
    MEAN_VELOCITY,
    MULTIPLIER,
    PERIOD,
    POINT,
    REASON,
    RECORDED,
    REPEATS,
    SETTLED_AFTER,
    SETTLES,
    SINCE,
    STICKING,
    SYMMETRIC,
    ColumnTask,
    Found,
    LaneRecords,
)
from grazemap_core.maps.kernels.lane_tangents import (
    ALL,
    PAIR,
    ROOM,
    LaneTangents,
    begin_growth_of,
    begin_matrix_of,
    judge_lane,
    multiplier_of_lane,
)
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import RESTING, Lanes
from grazemap_core.maps.tolerances import APPARENT, APPROACH_RETRY, SETTLING_IMPACTS
from grazemap_core.numerics.jit.compiled import copy_vector, kernel, plain
from grazemap_core.orbits.kernels.verification import (
    ImpulseBlocks,
    Verification,
    VerificationScratch,
    apparent_length,
    guess_from_record,
    guess_from_replay,
    unit_of_speeds,
    verify,
)
from grazemap_core.orbits.tolerances import ORBIT_NEARBY
from grazemap_core.simulation.kernels.fixed_point_extrapolation import Extrapolation
from grazemap_core.simulation.kernels.period_detection import (
    Approach,
    StroboscopicHistory,
    detect_period,
    mean_section,
    orbit_nearby,
)
from grazemap_core.simulation.tolerances import APPROACH_RATE, CLOSING_GOAL, LIMIT_DISTANCE


@kernel
def make_room(group: Lanes, notes: LaneRecords, k: int, used: int) -> None:
    """Let lanes whose events might not hold another half period begin with empty ones."""
    counts, cursor = notes.counts, group.cursor
    if group.events.shape[1] == 0:  # none are kept
        return
    most = group.events.shape[1] - ROOM
    for lane in range(used):
        if cursor[lane, ROWS] > most:
            cursor[lane, ROWS] = 0
            counts[lane, RECORDED] = k


@kernel
def begin_growths(
    problem: CellProblem, changes: LaneTangents, notes: LaneRecords, k: int, task: ColumnTask, used: int
) -> None:
    """Let the lanes that have only the half periods left over which growth is measured begin with that."""
    counts = notes.counts
    after = 2 * task.max_periods - task.growth_halves
    for lane in range(used):
        if counts[lane, AT] == SETTLES and k - counts[lane, BEGAN] == after and counts[lane, POINT] >= 0:
            counts[lane, AT] = GROWS
            begin_growth_of(problem, changes, lane)


@kernel
def _enter_motion(
    codes: Integers,
    figures: Floats,
    reason: int,
    period: int,
    right: int,
    left: int,
    symmetric: bool,
    least: float,
    sticking: bool,
    after: int,
    doubt: int,
) -> None:
    """Write what was found of a trajectory; multiplier and exponent are not known yet."""
    codes[REASON] = reason
    codes[PERIOD] = period
    codes[IMPACTS_RIGHT] = right
    codes[IMPACTS_LEFT] = left
    codes[SYMMETRIC] = 1 if symmetric else 0
    codes[SETTLED_AFTER] = after
    codes[STICKING] = 1 if sticking else 0
    codes[GROWTH] = GROWTH_UNDECIDED
    codes[DOUBT] = doubt
    figures[LEAST_VELOCITY] = least if np.isfinite(least) else np.nan
    figures[MULTIPLIER] = np.nan
    figures[LYAPUNOV] = np.nan
    figures[LYAPUNOV_ERROR] = np.nan
    figures[MEAN_POSITION] = np.nan
    figures[MEAN_VELOCITY] = np.nan


@kernel
def _enter_place(
    problem: CellProblem,
    ring: StroboscopicHistory,
    codes: Integers,
    figures: Floats,
    lane: int,
    k: int,
    clearance: float,
) -> None:
    """Write where the motion that was named is in the mean."""
    x, v = mean_section(problem, ring, lane, k, codes[PERIOD])
    figures[MEAN_POSITION] = x / clearance
    figures[MEAN_VELOCITY] = v / (problem.omega * clearance)


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
def _prove(
    problem: CellProblem,
    held: HeldProblem,
    chain: ImpulseBlocks,
    scratch: VerificationScratch,
    group: Lanes,
    lane: int,
    k: int,
    recorded: int,
    length: int,
    distance: float,
) -> Verification:
    """Look for the motion near a lane, as `proving.verify`; its events are complete from half period `recorded` on.

    The shortest part of it in which the impacts repeat is tried first. That these do so all along is known no better
    than to the distance itself, so the motion must be as near.
    """
    clearance, events, rows = group.clearance[lane], group.events[lane], group.cursor[lane, ROWS]
    if not chain.verifiable:
        return verify(problem, chain, scratch, clearance, plain(0), length, distance)
    known = recorded <= k - length and rows <= events.shape[0]
    if known:
        count = guess_from_record(problem, scratch, clearance, k, length, events, rows)
    else:
        for j in range(scratch.start.shape[0]):
            scratch.start[j, 0] = group.even[2 * j * LANES + lane]
            scratch.start[j, 1] = group.even[(2 * j + 1) * LANES + lane]
        copy_vector(scratch.replay.cursor, group.cursor[lane])
        copy_vector(scratch.replay.near[:3], group.near[lane])
        count = guess_from_replay(problem, held, scratch, clearance, k, length)
    part = apparent_length(scratch, count, length, APPARENT * distance * clearance / unit_of_speeds(problem, clearance))
    if part < length:
        few = guess_from_record(problem, scratch, clearance, k, part, events, rows) if known else count * part // length
        proof = verify(problem, chain, scratch, clearance, few, part, APPARENT / ORBIT_NEARBY * distance)
        if proof.reason == RESOLVED:
            return proof
        if known:
            count = guess_from_record(problem, scratch, clearance, k, length, events, rows)
    return verify(problem, chain, scratch, clearance, count, length, distance)


@kernel
def _enter_proof(codes: Integers, figures: Floats, proof: Verification, after: int) -> None:
    """Write a motion that is proven."""
    symmetric = proof.length % 2 == 1
    period = proof.length if symmetric else proof.length // 2
    right, left = proof.right, proof.left
    if symmetric:  # the other half of the motion is the mirror image of this one
        right = left = right + left
    right, left = right if right > 0 else -1, left if left > 0 else -1
    speed = proof.min_impact_speed
    _enter_motion(codes, figures, RESOLVED, period, right, left, symmetric, speed, False, after, RESOLVED)
        codes, figures, RESOLVED, period, right, left, symmetric, proof.min_impact_speed, False, after, RESOLVED
    )
    _enter_multiplier(codes, figures, proof.multiplier)
    figures[MEAN_POSITION], figures[MEAN_VELOCITY] = proof.mean_position, proof.mean_velocity


@kernel
def _judge_settling(
    problem: CellProblem,
    held: HeldProblem,
    chain: ImpulseBlocks,
    scratch: VerificationScratch,
    ahead: Extrapolation,
    task: ColumnTask,
    group: Lanes,
    ring: StroboscopicHistory,
    changes: LaneTangents,
    notes: LaneRecords,
    lane: int,
    k: int,
    returned: int,
    closed: bool,
    skipped: int,
    found: Found,
) -> bool:
    """Judge a lane that SETTLES or GROWS. Returns whether all that there is to know is known."""
    counts, sizes = notes.counts[lane], notes.sizes[lane]
    codes, figures = found.codes[counts[POINT]], found.figures[counts[POINT]]
    clearance, reach = group.clearance[lane], group.reach[lane]
    entered = k - counts[BEGAN]
    last = entered >= 2 * task.max_periods
    if group.status[lane] != OK or sizes[COUNTED] > SETTLING_IMPACTS:
        reason = TOO_MANY_IMPACTS if group.status[lane] == OK else reason_of_end(group.status[lane])
        _enter_motion(codes, figures, reason, 0, 0, 0, False, np.inf, False, -1, RESOLVED)
        return True
    if is_free_for_ever(problem, reach, group.cursor[lane, ANCHOR], clearance):
        # the steady motion is the only one that is left, and all others come to it
        _enter_motion(codes, figures, RESOLVED, 1, -1, -1, True, np.inf, False, (entered + 1) // 2, RESOLVED)
        figures[MEAN_POSITION], figures[MEAN_VELOCITY] = 0.0, 0.0
        figures[LYAPUNOV] = _free_exponent(problem)
        figures[MULTIPLIER] = math.exp(figures[LYAPUNOV])
        return True
    reason, period, right, left, symmetric, least, sticking = NOT_CLOSED, 0, 0, 0, False, np.inf, False
    if closed or last:
        # what it returned to by leaps attracts as strongly as they asked for
        known_rate = APPROACH_RATE if has_just_landed(notes, lane, k) else 0.0
        reason, period, right, left, symmetric, least, sticking = detect_period(
            problem,
            ring,
            lane,
            k,
            task.max_period,
            clearance,
            Approach(k - counts[SINCE], reach, known_rate),
        )
    if reason != RESOLVED and not last:
        wanted = chain.verifiable or counts[AT] == SETTLES
        if wanted and sizes[GOAL] > CLOSING_GOAL and returned > 0 and group.regime[lane] != RESTING:
            distance = orbit_nearby(problem, ring, lane, k, returned, task.max_period, clearance)
            if not chain.verifiable:
                counts[LOOK] = k + 2 * returned
                if np.isfinite(distance):
                    leap(problem, scratch, ahead, task, group, ring, notes, lane, k, returned, distance)
            elif np.isfinite(distance):
                distance = max(distance, LIMIT_DISTANCE)
                proof = _prove(problem, held, chain, scratch, group, lane, k, counts[RECORDED], returned, distance)
                if proof.reason == RESOLVED:
                    _enter_proof(codes, figures, proof, (entered + 1) // 2)
                    return True
                sizes[GOAL] = max(APPROACH_RETRY * sizes[GOAL], CLOSING_GOAL)
        return False
    after, doubt = -1, RESOLVED
    if reason == RESOLVED:
        window = period if symmetric else 2 * period  # half periods after which z returns
        after = max(0, (entered - 3 * window + 1) // 2)
        if right == -1 and left == -1:
            doubt = GRAZE_UNRESOLVED  # else the envelope would have fitted between the stops
        elif sticking or right == INFINITE or left == INFINITE or group.regime[lane] == RESTING:
            doubt = STICKS
        else:
            proof = _prove(problem, held, chain, scratch, group, lane, k, counts[RECORDED], window, LIMIT_DISTANCE)
            doubt = proof.reason
            if doubt == RESOLVED:
                _enter_proof(codes, figures, proof, after)
                return True
    _enter_motion(codes, figures, reason, period, right, left, symmetric, least, sticking, after, doubt)
    if reason == RESOLVED:
        _enter_place(problem, ring, codes, figures, lane, k, clearance)
    if task.growth_halves == 0:
        return True
    if reason == RESOLVED:
        begin_matrix_of(changes, lane)
        counts[AT] = REPEATS
        counts[DUE] = k + (period if symmetric else 2 * period)
        return False
    if changes.carried[lane] == PAIR and changes.grown[lane] == task.growth_halves:
        growth, exponent, error = judge_lane(problem, clearance, skipped, changes, lane)
        codes[GROWTH] = growth
        figures[LYAPUNOV] = exponent * problem.step * problem.cells
        figures[LYAPUNOV_ERROR] = error * problem.step * problem.cells if np.isfinite(error) else np.nan
    return True


@kernel
def _enter_multiplier(codes: Integers, figures: Floats, multiplier: float) -> None:
    """Write the multiplier and the exponent of a motion from that of the half period map after which z returns."""
    halves = 2.0 if codes[SYMMETRIC] != 0 else 1.0
    figures[MULTIPLIER] = multiplier**halves
    figures[LYAPUNOV] = halves * np.log(multiplier) / codes[PERIOD]  # a square may be too small for a number


@kernel
def judge(
    problem: CellProblem,
    held: HeldProblem,
    chain: ImpulseBlocks,
    scratch: VerificationScratch,
    ahead: Extrapolation,
    task: ColumnTask,
    group: Lanes,
    ring: StroboscopicHistory,
    changes: LaneTangents,
    notes: LaneRecords,
    lane: int,
    k: int,
    returned: int,
    closed: bool,
    skipped: int,
    found: Found,
) -> bool:
    """Judge a lane after k half periods. Returns whether its trajectory is done with.

    Parameters
    ----------
    returned : int
        Least number of half periods after which the lane has returned as near as its GOAL; 0 if it was not looked at.
    closed : bool
        Whether it has returned as near as CLOSING_GOAL.
    skipped : int
        Half periods in the beginning that have no part in exponents.
    found : Found
        Written once the motion is known, or given up.
    """
    counts = notes.counts[lane]
    at, point = counts[AT], counts[POINT]
    done = True
    if at == LEAPT:
        if not land(problem, scratch, task, group, ring, notes, lane, k):
            return False
        closed = True
    if at in (SETTLES, GROWS, LEAPT):
        done = _judge_settling(
            problem,
            held,
            chain,
            scratch,
            ahead,
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
        )
    elif at == REPEATS and group.status[lane] == OK and changes.carried[lane] == ALL:
        _enter_multiplier(found.codes[point], found.figures[point], multiplier_of_lane(problem, changes, lane))
    if done and task.follow and k % 2 == 1 and group.status[lane] == OK and at != LEAVES:
        counts[AT], counts[DUE] = LEAVES, k + 1
        return False
    return done
