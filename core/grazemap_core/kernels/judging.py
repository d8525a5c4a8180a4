"""What becomes of a lane of a column at the end of a half period: whether its motion is known, and what is done next.

A lane settles until its returns tell a periodic motion (`closing`). One that comes ever closer to an orbit need not be
waited for: it is taken there by Newton's method, and what is found must pass the same tests; else the lane goes back to
where it was. A motion that was named is run on for as long as it repeats, to give its multiplier. In the last of the
half periods that a lane has, small changes are carried along, so that in the end their growth can tell what it is
(`lyapunov`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.kernels.cells import CellProblem, first_mass
from grazemap_core.kernels.closing import BUDGET, NAMED, NOT_CLOSED, Orbit, mean_section, name_motion, orbit_nearby
from grazemap_core.kernels.compiled import kernel
from grazemap_core.kernels.lane_tangents import (
    ALL,
    NOTHING,
    PAIR,
    LaneTangents,
    begin_growth_of,
    begin_matrix_of,
    judge_lane,
    multiplier_of_lane,
)
from grazemap_core.kernels.lanes import LANES
from grazemap_core.kernels.lockstep import FREE, Lanes, idle, put
from grazemap_core.kernels.lyapunov import UNTOLD
from grazemap_core.kernels.newton import newton_step
from grazemap_core.kernels.simulate import is_free_for_ever, reason_of_end
from grazemap_core.kernels.workspace import ANCHOR, OK
from grazemap_core.tolerances import (
    APPROACH,
    APPROACH_RETRY,
    CLOSING_FLOOR,
    CLOSING_GOAL,
    NEWTON_STEPS,
    SETTLING_IMPACTS,
    SLOWEST_RATE,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# columns of the codes of a motion
REASON, PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC, SETTLED_AFTER, STICKING = 0, 1, 2, 3, 4, 5, 6
GROWTH = 7
"""What the growth of changes says of a motion that was not named, a code of `lyapunov`."""
RUN, STRUCK = 8, 9
"""Half periods that were run, and impacts that were followed."""
CODES = 10

# columns of the figures of a motion
LEAST_VELOCITY, MULTIPLIER, LYAPUNOV = 0, 1, 2
MEAN_POSITION, MEAN_VELOCITY = 3, 4
"""As `closing.mean_section`, in units of the clearance, and of omega times it."""
FIGURES = 5

SETTLES, GROWS, APPROACHES, CONFIRMS, REPEATS, RETURNS, LEAVES = 0, 1, 2, 3, 4, 5, 6
"""What a lane is at. Its motion is to be named, at first without, at last with changes carried along; it is on its way
to an orbit by Newton's method, or there, so that it can be named; it was named, and its multiplier is to be found; it
is to go back to where it was before Newton's method, as soon as the forcing is at the same half; all is known, and its
state at the end of the forcing period is waited for."""

# columns of `Notes.counts`
POINT, STARTED, BEGAN, AT, DUE, FRESH = 0, 1, 2, 3, 4, 5
"""The trajectory in the lane, -1 for none; when it started, without and with what Newton's method has spent in vain;
what it is at, and when something is to be done about that in any case; since when the ring shows one
trajectory."""
LENGTH, STEPS, WAS, LEFT_AT = 6, 7, 8, 9
"""Half periods of the orbit that Newton's method looks for, and its steps; what the lane was at before, and until
when."""
COUNTS = 10

# columns of `Notes.sizes`
FOLLOWED, COUNTED, GOAL, DISTANCE, RESIDUAL, OF_ORBIT = 0, 1, 2, 3, 4, 5
"""Impacts followed, and those that count toward SETTLING_IMPACTS; the return, in units of the clearance, from which
the lane is looked at; distance to the orbit as extrapolated; the last step's return; the orbit's multiplier over LENGTH
half periods."""
SIZES = 6


class Notes(NamedTuple):
    """What is known of every lane's trajectory.

    Attributes
    ----------
    counts : (LANES, COUNTS)
        Times are half periods since the column began.
    sizes : (LANES, SIZES)
    """

    counts: IntArray
    sizes: FloatArray


class Job(NamedTuple):
    """What is asked of a column.

    Attributes
    ----------
    clearances : (n,)
    base, directions : (N, 2), (s, N, 2)
        Trajectory i has the clearance b number i // s, and begins at base + b * directions[i % s].
    max_periods, max_period : int
    early : bool
        Whether a trajectory stops once its motion can be named; otherwise all run for `max_periods`.
    follow : bool
        Whether every trajectory but the first begins with the state in which the last one ended. Where that is outside
        the stops, mass 1 is put on the stop that it is beyond, with its velocity.
    growth_halves : int
        Half periods at the end in which the growth of changes is measured; with 0 there are no multipliers, no
        exponents and no Newton's method.
    """

    clearances: FloatArray
    base: FloatArray
    directions: FloatArray
    max_periods: int
    max_period: int
    early: bool
    follow: bool
    growth_halves: int


class Found(NamedTuple):
    """What became of every trajectory.

    Attributes
    ----------
    codes : (n s, CODES)
        Reason (a code of `closing`), period, impacts_right, impacts_left, symmetric, settled_after (forcing periods
        after which the orbit had closed, or after which no contact was possible any more; -1 unless named) and
        sticking; what the growth says; half periods run and impacts followed.
    figures : (n s, FIGURES)
        Least impact velocity, NaN without impacts; largest modulus of the multipliers over one motion period and
        largest Lyapunov exponent per forcing period, NaN where they are not known; where a periodic motion is in the
        mean, NaN unless it was named.
    """

    codes: IntArray
    figures: FloatArray


@kernel
def enter_lane(notes: Notes, lane: int, point: int, k: int, job: Job) -> None:
    """Take note of a trajectory that begins in a lane after k half periods."""
    counts, sizes = notes.counts, notes.sizes
    counts[lane] = 0
    counts[lane, POINT] = point
    counts[lane, STARTED], counts[lane, BEGAN], counts[lane, FRESH] = k, k, k
    counts[lane, AT] = SETTLES
    counts[lane, DUE] = k + 2 * job.max_periods
    sizes[lane] = 0.0
    sizes[lane, GOAL] = APPROACH if job.early and job.growth_halves > 0 else CLOSING_GOAL


@kernel
def begin_growths(problem: CellProblem, changes: LaneTangents, notes: Notes, k: int, job: Job, used: int) -> None:
    """Let the lanes that have only the half periods left over which growth is measured begin with that."""
    counts = notes.counts
    after = 2 * job.max_periods - job.growth_halves
    for lane in range(used):
        if counts[lane, AT] == SETTLES and k - counts[lane, BEGAN] == after and counts[lane, POINT] >= 0:
            counts[lane, AT] = GROWS
            begin_growth_of(problem, changes, lane)


@kernel
def _z(group: Lanes, lane: int, k: int, c: int) -> float:
    """Return a coordinate of a lane after k half periods, in the frame of z."""
    coordinate: float = group.even[c * LANES + lane]
    return coordinate if k % 2 == 0 else -coordinate


@kernel
def _put_z(group: Lanes, lane: int, problem: CellProblem, z: FloatArray, k: int, u: FloatArray) -> bool:
    """Put a lane to a state in the frame of z after k half periods. Returns False, and does not, outside the stops."""
    sign = 1.0 if k % 2 == 0 else -1.0
    for j in range(u.shape[0]):
        u[j, 0], u[j, 1] = sign * z[2 * j], sign * z[2 * j + 1]
    boundary = k % 2 * (problem.cells // 2)
    x, _ = first_mass(problem, u, problem.gain[boundary, 0], problem.gain[boundary, 1])
    if not abs(x) < group.clearance[lane]:
        return False
    put(group, lane, problem, u, k)
    return True


@kernel
def _approach(group: Lanes, changes: LaneTangents, notes: Notes, lane: int, k: int, m: int, distance: float) -> None:
    """Set out for the orbit that a lane between the stops comes closer to, m half periods long."""
    counts = notes.counts[lane]
    for c in range(changes.back.shape[1]):
        changes.back[lane, c] = _z(group, lane, k, c)
        changes.begin[lane, c] = changes.back[lane, c]
    counts[WAS], counts[LEFT_AT] = counts[AT], k
    counts[AT], counts[DUE] = APPROACHES, k + m
    counts[LENGTH], counts[STEPS] = m, 0
    notes.sizes[lane, DISTANCE] = distance
    begin_matrix_of(changes, lane)


@kernel
def _step(
    problem: CellProblem, group: Lanes, changes: LaneTangents, notes: Notes, lane: int, k: int, u: FloatArray
) -> bool:
    """Take the next step of Newton's method at the end of a run, or begin to confirm. Returns False when it fails."""
    counts, sizes = notes.counts[lane], notes.sizes[lane]
    m, clearance = counts[LENGTH], group.clearance[lane]
    if group.status[lane] != OK or group.regime[lane] != FREE or changes.carried[lane] != ALL:
        return False
    z, matrix = changes.scratch.real, changes.full[lane]
    size = z.shape[0]
    sign = 1.0 if m % 2 == 0 else -1.0
    residual = 0.0
    for c in range(size):
        z[c] = _z(group, lane, k, c)
        residual = max(residual, abs(z[c] - changes.begin[lane, c]) * problem.closeness[c // 2, c % 2])
    residual /= clearance
    if counts[STEPS] > 0 and residual <= CLOSING_FLOOR:
        sizes[OF_ORBIT] = multiplier_of_lane(problem, changes, lane)
        changes.carried[lane] = NOTHING
        counts[AT], counts[DUE] = CONFIRMS, k + 3 * m
        return bool(sizes[OF_ORBIT] < SLOWEST_RATE)
    if counts[STEPS] == NEWTON_STEPS or (counts[STEPS] > 0 and not residual < 0.1 * sizes[RESIDUAL]):
        return False
    if not newton_step(changes.begin[lane], z, sign, matrix, changes.solving):
        return False
    moved = 0.0
    for c in range(size):
        moved = max(moved, abs(z[c] - _z(group, lane, k, c)) * problem.closeness[c // 2, c % 2])
    if not moved <= 10.0 * max(residual, sizes[DISTANCE]) * clearance or not _put_z(group, lane, problem, z, k, u):
        return False
    for c in range(size):
        changes.begin[lane, c] = z[c]
    sizes[RESIDUAL] = residual
    counts[STEPS] += 1
    counts[FRESH], counts[DUE] = k, k + m
    begin_matrix_of(changes, lane)
    return True


@kernel
def _go_back(
    problem: CellProblem,
    group: Lanes,
    changes: LaneTangents,
    notes: Notes,
    lane: int,
    k: int,
    clearance: float,
    max_periods: int,
    u: FloatArray,
) -> None:
    """Put a lane back to where it was before Newton's method, if the forcing is at the same half, or wait for that."""
    counts, sizes = notes.counts[lane], notes.sizes[lane]
    idle(group, lane)
    group.cursor[lane] = 0
    changes.carried[lane] = NOTHING
    away = k - counts[LEFT_AT]
    if away % 2 == 1:
        counts[AT], counts[DUE] = RETURNS, k + 1
        return
    group.clearance[lane] = clearance
    group.status[lane] = OK
    sign = 1.0 if k % 2 == 0 else -1.0
    for j in range(u.shape[0]):
        u[j, 0], u[j, 1] = sign * changes.back[lane, 2 * j], sign * changes.back[lane, 2 * j + 1]
    put(group, lane, problem, u, k)
    counts[AT], counts[FRESH] = counts[WAS], k
    counts[BEGAN] += away
    if counts[AT] == GROWS:
        changes.carried[lane] = PAIR
    counts[DUE] = counts[BEGAN] + 2 * max_periods
    sizes[GOAL] = max(APPROACH_RETRY * sizes[GOAL], CLOSING_GOAL)


@kernel
def _enter_motion(
    codes: IntArray,
    figures: FloatArray,
    reason: int,
    period: int,
    right: int,
    left: int,
    symmetric: bool,
    least: float,
    sticking: bool,
    after: int,
) -> None:
    """Write what was found of a trajectory; multiplier and exponent are not known yet."""
    codes[REASON] = reason
    codes[PERIOD] = period
    codes[IMPACTS_RIGHT] = right
    codes[IMPACTS_LEFT] = left
    codes[SYMMETRIC] = 1 if symmetric else 0
    codes[SETTLED_AFTER] = after
    codes[STICKING] = 1 if sticking else 0
    codes[GROWTH] = UNTOLD
    figures[LEAST_VELOCITY] = least if np.isfinite(least) else np.nan
    figures[MULTIPLIER] = np.nan
    figures[LYAPUNOV] = np.nan
    figures[MEAN_POSITION] = np.nan
    figures[MEAN_VELOCITY] = np.nan


@kernel
def _enter_place(
    problem: CellProblem, ring: Orbit, codes: IntArray, figures: FloatArray, lane: int, k: int, clearance: float
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
def _judge_settling(
    problem: CellProblem,
    job: Job,
    group: Lanes,
    ring: Orbit,
    changes: LaneTangents,
    notes: Notes,
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
    entered, seen = k - counts[BEGAN], k - counts[FRESH]
    last = entered >= 2 * job.max_periods
    if group.status[lane] != OK or sizes[COUNTED] > SETTLING_IMPACTS:
        reason = BUDGET if group.status[lane] == OK else reason_of_end(group.status[lane])
        _enter_motion(codes, figures, reason, 0, 0, 0, False, np.inf, False, -1)
        return True
    if is_free_for_ever(problem, reach, group.cursor[lane, ANCHOR], clearance):
        _enter_motion(codes, figures, NAMED, 1, -1, -1, True, np.inf, False, (entered + 1) // 2)
        figures[MEAN_POSITION], figures[MEAN_VELOCITY] = 0.0, 0.0
        if job.growth_halves > 0:
            figures[LYAPUNOV] = _free_exponent(problem)
            figures[MULTIPLIER] = math.exp(figures[LYAPUNOV])
        return True
    reason, period, right, left, symmetric, least, sticking = NOT_CLOSED, 0, 0, 0, False, np.inf, False
    if closed or last:
        reason, period, right, left, symmetric, least, sticking = name_motion(
            problem, ring, lane, k, seen, job.max_period, clearance, reach
        )
    if reason != NAMED and not last:
        if sizes[GOAL] > CLOSING_GOAL and returned > 0 and group.regime[lane] == FREE:
            distance = orbit_nearby(problem, ring, lane, k, returned, job.max_period, clearance)
            if np.isfinite(distance):
                _approach(group, changes, notes, lane, k, returned, distance)
        return False
    after = -1
    if reason == NAMED:
        window = period if symmetric else 2 * period  # half periods after which z returns
        after = max(0, (entered - 3 * window + 1) // 2)
    _enter_motion(codes, figures, reason, period, right, left, symmetric, least, sticking, after)
    if reason == NAMED:
        _enter_place(problem, ring, codes, figures, lane, k, clearance)
    if job.growth_halves == 0:
        return True
    if reason == NAMED:
        _repeat(changes, counts, codes, lane, k)
        return False
    if changes.carried[lane] == PAIR and changes.grown[lane] == job.growth_halves:
        growth, exponent = judge_lane(problem, clearance, skipped, changes, lane)
        codes[GROWTH] = growth
        figures[LYAPUNOV] = exponent * problem.step * problem.cells
    return True


@kernel
def _repeat(changes: LaneTangents, counts: IntArray, codes: IntArray, lane: int, k: int) -> None:
    """Let a lane run on for one return of its motion, for its multiplier."""
    begin_matrix_of(changes, lane)
    counts[AT] = REPEATS
    counts[DUE] = k + (codes[PERIOD] if codes[SYMMETRIC] != 0 else 2 * codes[PERIOD])


@kernel
def _enter_multiplier(codes: IntArray, figures: FloatArray, multiplier: float) -> None:
    """Write the multiplier and the exponent of a motion from that of the half period map after which z returns."""
    halves = 2.0 if codes[SYMMETRIC] != 0 else 1.0
    figures[MULTIPLIER] = multiplier**halves
    figures[LYAPUNOV] = halves * np.log(multiplier) / codes[PERIOD]  # a square may be too small for a number


@kernel
def judge(
    problem: CellProblem,
    job: Job,
    group: Lanes,
    ring: Orbit,
    changes: LaneTangents,
    notes: Notes,
    lane: int,
    k: int,
    returned: int,
    closed: bool,
    skipped: int,
    found: Found,
    u: FloatArray,
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
    u : (N, 2)
        Scratch.
    """
    counts = notes.counts[lane]
    at = counts[AT]
    done = True
    point = counts[POINT]
    if at in (SETTLES, GROWS):
        done = _judge_settling(problem, job, group, ring, changes, notes, lane, k, returned, closed, skipped, found)
    elif at == REPEATS:
        if group.status[lane] == OK and changes.carried[lane] == ALL:
            _enter_multiplier(found.codes[point], found.figures[point], multiplier_of_lane(problem, changes, lane))
    elif at != LEAVES:
        done = False
        clearance = job.clearances[point // job.directions.shape[0]]
        on_the_way = at != RETURNS
        if at == APPROACHES:
            on_the_way = _step(problem, group, changes, notes, lane, k, u)
        elif at == CONFIRMS and group.status[lane] == OK:
            reason, period, right, left, symmetric, least, sticking = name_motion(
                problem, ring, lane, k, k - counts[FRESH], job.max_period, clearance, group.reach[lane]
            )
            on_the_way = reason == NAMED
            if on_the_way:
                codes, figures = found.codes[point], found.figures[point]
                after = (counts[LEFT_AT] - counts[BEGAN] + 1) // 2
                _enter_motion(codes, figures, NAMED, period, right, left, symmetric, least, sticking, after)
                _enter_place(problem, ring, codes, figures, lane, k, clearance)
                if counts[LENGTH] == (period if symmetric else 2 * period):
                    _enter_multiplier(codes, figures, notes.sizes[lane, OF_ORBIT])
                    done = True
                else:
                    _repeat(changes, counts, codes, lane, k)
        else:
            on_the_way = False
        if not on_the_way:
            _go_back(problem, group, changes, notes, lane, k, clearance, job.max_periods, u)
    if done and job.follow and k % 2 == 1 and group.status[lane] == OK and at != LEAVES:
        counts[AT], counts[DUE] = LEAVES, k + 1
        return False
    return done
