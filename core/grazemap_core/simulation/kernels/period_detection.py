"""Detection of the period of a motion from the returns of its stroboscopic orbit.

The orbit is sampled every *half* forcing period with alternating sign, z_k = (-1)^k u(k T/2): with two symmetric stops
it is the orbit of one autonomous map, the half-period map followed by the mirror symmetry. Its minimal period m
determines that of the motion: an odd m is a symmetric motion of m forcing periods, an even m a motion of m/2 forcing
periods that is not its own mirror image.

Without this symmetry (`Stops.symmetric`) only even m are considered: that a state is near the mirror image of an
earlier one then means nothing.

A period is accepted only if

1. m is the smallest number of half periods after which the orbit returns to within CLOSING_GOAL;
2. the returns in the last m half periods are round-off, or they contract over three windows of m half periods and the
   distance to the limit, extrapolated from the slower contraction, is at most LIMIT_DISTANCE;
3. the distances of returns after fewer half periods exceed SEPARATION times LIMIT_DISTANCE: of a spiral, or with two
   nearly equal multipliers, a single return may be misleading;
4. the impacts repeat;
5. the squared speed of the slowest impact exceeds SEPARATION times the distance to the limit. Impacts with an
   acceleration toward the stop do not count here: they are no grazes, however slow, because they cannot vanish.

All other motions continue, and are unresolved at the end.

With a complete chatter the number of impacts on a stop is INFINITE; the number of those that were computed one by one
depends on a tolerance and is not a property of the motion.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.codes import INFINITE, NEAR_GRAZING, NOT_CLOSED, RESOLVED, SLOW_CONVERGENCE
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import CellProblem, reach_from
from grazemap_core.contact.kernels.half_period import is_free_for_ever
from grazemap_core.contact.kernels.runs import Run, clear_tally
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.lane_values import lane_row, lane_value
from grazemap_core.records import NamedTuple
from grazemap_core.simulation import tolerances


class NamedMotion(NamedTuple):
    """The name n-p_r-q_l of a motion, or the reason why it has none; all other fields are then meaningless."""

    reason: int
    """RESOLVED, or why the motion has no name."""
    period: int
    """n, forcing periods."""
    impacts_right: int
    """Impacts on the right stop per n forcing periods: -1 if the stop is not touched, INFINITE with a complete chatter,
    0 if the contact rests there without an impact."""
    impacts_left: int
    """Impacts on the left stop, likewise."""
    symmetric: bool
    """Whether the motion is its own mirror image, half a period later."""
    min_speed: float
    """Minimum impact speed over two returns of z; infinite without impacts, 0 with a complete chatter."""
    sticking: bool
    """Whether the contact rests on a stop during a part of the period."""


@kernel
def unnamed(reason: int) -> NamedMotion:
    """Return a motion without a name."""
    return NamedMotion(reason, 0, 0, 0, False, np.inf, False)


@kernel
def without_contacts(symmetric: bool) -> NamedMotion:
    """Return the name of the steady motion between the stops."""
    return NamedMotion(RESOLVED, 1, -1, -1, symmetric, np.inf, False)


class StroboscopicHistory(NamedTuple):
    """A ring buffer of the last half periods of one or more lanes."""

    states: Floats
    """(ring, 2 N, lanes) The states at the ends of the half periods."""
    impacts: Floats
    """(ring, 2, lanes) For each half period and stop, the number of impacts."""
    held: Floats
    """(ring, 2, lanes) For each half period and stop, 1 if the contact has rested."""
    min_speed: Floats
    """(ring, lanes) Minimum speed of all impacts."""
    min_unpressed_speed: Floats
    """(ring, lanes) Minimum speed of the impacts without acceleration toward the stop."""


def stroboscopic_history(blocks: int, max_period: int, lanes: int = 1) -> StroboscopicHistory:
    """Return an empty ring buffer long enough to detect periods of up to `max_period` forcing periods."""
    ring = 8 * max_period + 2
    return StroboscopicHistory(
        states=np.zeros((ring, 2 * blocks, lanes)),
        impacts=np.zeros((ring, 2, lanes)),
        held=np.zeros((ring, 2, lanes)),
        min_speed=np.full((ring, lanes), np.inf),
        min_unpressed_speed=np.full((ring, lanes), np.inf),
    )


@kernel
def record_half_period(ring: StroboscopicHistory, k: int, run: Run) -> None:
    """Record the state after k half periods in lane 0 with the tally of the last one; reset the tally."""
    row, u = k % ring.min_speed.shape[0], run.u
    sign = 1.0 if k % 2 == 0 else -1.0
    for j in range(u.shape[0]):
        ring.states[row, 2 * j, 0] = sign * u[j, 0]
        ring.states[row, 2 * j + 1, 0] = sign * u[j, 1]
    # in the coordinates z the stops are exchanged every half period
    first = 0 if (k - 1) % 2 == 0 else 1
    ring.impacts[row, first, 0] = run.tally[runs.RIGHT_IMPACTS]
    ring.impacts[row, 1 - first, 0] = run.tally[runs.LEFT_IMPACTS]
    ring.held[row, first, 0] = run.tally[runs.HELD_RIGHT]
    ring.held[row, 1 - first, 0] = run.tally[runs.HELD_LEFT]
    ring.min_speed[row, 0] = run.tally[runs.MIN_SPEED]
    ring.min_unpressed_speed[row, 0] = run.tally[runs.MIN_UNPRESSED_SPEED]
    clear_tally(run.tally)


@kernel
def separation(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, unit: float, cutoff: float
) -> float:
    """Return the distance of z_k and z_(k-m) in units of `unit`; if it exceeds `cutoff`, a lower bound above `cutoff`.

    The unit is `Stops.unit`.
    """
    size = ring.min_speed.shape[0]
    now, then = k % size, (k - m) % size
    cutoff *= unit
    largest = 0.0
    for i in range(2 * problem.decay.shape[0]):
        change = abs(ring.states[now, i, lane] - ring.states[then, i, lane])
        largest = max(largest, change * problem.displacement_scale[i // 2, i % 2])
        if largest > cutoff:
            break
    return largest / unit


@kernel
def _first_return(
    problem: CellProblem, stops: Stops, ring: StroboscopicHistory, lane: int, k: int, longest: int, goal: float
) -> int:
    """Return the smallest m <= longest with z_k within `goal` times `Stops.unit` of z_(k-m); 0 if there is none.

    `nearest_returns` does this for many lanes.
    """
    size = ring.min_speed.shape[0]
    row = k % size
    here = ring.states[row, 0, lane]
    near = goal * stops.unit / problem.displacement_scale[0, 0]
    for m in range(1, longest + 1):
        row = row - 1 if row > 0 else size - 1
        if m % 2 == 1 and not stops.symmetric:
            continue
        # one coordinate excludes most returns
        if abs(ring.states[row, 0, lane] - here) <= near and (
            separation(problem, ring, lane, k, m, stops.unit, goal) <= goal
        ):
            return m
    return 0


@kernel
def _largest_return(problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, unit: float) -> float:
    """Return the largest distance of z_j and z_(j-m), in units of `unit`, for j from k-m+1 to k."""
    largest = 0.0
    for i in range(m):
        largest = max(largest, separation(problem, ring, lane, k - i, m, unit, np.inf))
    return largest


@kernel
def _contraction(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, unit: float, last_return: float
) -> float:
    """Return the slower of the two contractions of returns over the last three windows of m half periods.

    `last_return` is that of the last window (`_largest_return`).
    """
    earlier_return = _largest_return(problem, ring, lane, k - m, m, unit)
    first_return = _largest_return(problem, ring, lane, k - 2 * m, m, unit)
    return max(last_return / earlier_return, earlier_return / first_return)


@kernel
def compare_windows(ring: StroboscopicHistory, lane: int, k: int, m: int) -> tuple[bool, float, float]:
    """Compare the impacts of the last two windows of m half periods.

    Returns
    -------
    repeats : bool
        Whether both windows have the same numbers of impacts.
    min_speed, min_unpressed_speed : float
        Minimum speed of all impacts, and of those without acceleration toward the stop; without meaning unless
        `repeats`.
    """
    size = ring.min_speed.shape[0]
    min_speed, min_unpressed_speed = np.inf, np.inf
    for i in range(m):
        row, earlier = (k - i) % size, (k - i - m) % size
        min_speed = min(min_speed, min(ring.min_speed[row, lane], ring.min_speed[earlier, lane]))
        min_unpressed_speed = min(
            min_unpressed_speed, min(ring.min_unpressed_speed[row, lane], ring.min_unpressed_speed[earlier, lane])
        )
        for stop in range(2):
            if ring.impacts[row, stop, lane] != ring.impacts[earlier, stop, lane]:
                return False, min_speed, min_unpressed_speed
    return True, min_speed, min_unpressed_speed


class ReturnSearch(NamedTuple):
    """Arguments and results of `nearest_returns`, one number for each lane."""

    bound: Floats
    """(lanes,) Distance that counts as a return; negative: the lane is not searched. Overwritten."""
    relevant: Floats
    """(lanes,) Distance above which `nearest` need not be accurate; at most `bound`."""
    entered: Floats
    """(lanes,) Half periods of the lane in the ring. A return after m half periods needs 4 m of them."""
    mirrored: Floats
    """(lanes,) 1 if odd numbers of half periods are returns, too (`Stops.symmetric`), else 0."""
    length: Floats
    """(lanes,) Receives the smallest number of half periods after which the lane has returned, 0 if it has not."""
    nearest: Floats
    """(lanes,) Receives the minimum distance; if it exceeds `relevant`, any number above `relevant`."""
    distance: Floats
    """(lanes,) Scratch."""


@kernel
def nearest_returns(
    scale: Floats, ring: StroboscopicHistory, k: int, longest: int, search: ReturnSearch, used: int
) -> None:
    """Find every lane's first return, and its minimum distance from its states 1 .. longest half periods ago.

    Parameters
    ----------
    scale : (2 N,)
        `CellProblem.displacement_scale`, of all lanes or, with a second axis, of each (`lane_values`).
    search : ReturnSearch
        Receives the results.
    used : int
        Number of lanes that are searched.
    """
    bound, relevant, entered, mirrored, length, nearest, distance = search
    size = ring.min_speed.shape[0]
    row = k % size
    now = ring.states[row]
    length[:] = 0.0
    nearest[:] = np.inf
    for m in range(1, longest + 1):
        row = row - 1 if row > 0 else size - 1
        then = ring.states[row]
        # one or two coordinates exclude most lengths, for all lanes
        weight, here, there, near = lane_row(scale, 0, distance.shape[0]), now[0], then[0], 0
        for lane in range(min(used, distance.shape[0])):
            near += 1 if lane_value(weight, lane) * abs(here[lane] - there[lane]) <= bound[lane] else 0
        if near == 0:
            continue
        for lane in range(min(used, distance.shape[0])):
            distance[lane] = lane_value(weight, lane) * abs(here[lane] - there[lane])
        for c in range(1, now.shape[0]):
            weight = lane_row(scale, c, distance.shape[0])
            here, there, near = now[c], then[c], 0
            for lane in range(min(used, distance.shape[0])):
                distance[lane] = max(distance[lane], lane_value(weight, lane) * abs(here[lane] - there[lane]))
                near += 1 if distance[lane] <= bound[lane] else 0
            if near == 0:
                break
        if near == 0:
            continue
        number, even = float(m), m % 2 == 0
        for lane in range(min(used, distance.shape[0])):
            away = distance[lane] if (4.0 * number <= entered[lane]) & (even | (mirrored[lane] > 0.0)) else np.inf
            length[lane] = number if (away <= bound[lane]) & (length[lane] == 0.0) else length[lane]
            nearest[lane] = min(nearest[lane], away)
            bound[lane] = min(bound[lane], relevant[lane] if length[lane] > 0.0 else bound[lane])


@kernel
def orbit_nearby(
    problem: CellProblem, stops: Stops, ring: StroboscopicHistory, lane: int, k: int, m: int, verified_before: bool
) -> float:
    """Return how far a lane was, m half periods ago, from the periodic orbit that it approaches; infinite if none.

    Parameters
    ----------
    m : int
        Half periods after which the lane returns; 4 m of them must be in the ring.
    verified_before : bool
        Whether that orbit was verified once. Then the lane may approach it slowly, and it may have slow impacts.

    Returns
    -------
    distance : float
        Extrapolated from three windows of returns, in units of the stops.
    """
    slowest_rate = 1.0 if verified_before else tolerances.APPROACH_RATE
    unit = stops.unit
    last_return = _largest_return(problem, ring, lane, k, m, unit)
    rate = _contraction(problem, ring, lane, k, m, unit, last_return)
    if not rate < slowest_rate:
        return np.inf
    repeats, _, min_unpressed_speed = compare_windows(ring, lane, k, m)
    distance = last_return * rate / (1.0 - rate)
    speed = min_unpressed_speed / (problem.omega * unit)
    decided = verified_before or speed * speed > tolerances.GRAZE_SPEED_RATIO * distance
    return last_return + distance if repeats and decided else np.inf


@kernel
def mean_section(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, period: int
) -> tuple[float, float]:
    """Return the means of q and q', less the steady motion, at phase 0 of the last `period` forcing periods.

    The steady motion is that of all modes but undamped resonant ones. The means distinguish motions with one name.
    """
    size = ring.min_speed.shape[0]
    x, v = 0.0, 0.0
    for i in range(k % 2, 2 * period, 2):
        row = (k - i) % size
        for j in range(problem.output_row.shape[0]):
            a, b = ring.states[row, 2 * j, lane], ring.states[row, 2 * j + 1, lane]
            if problem.resonant_steady.shape[1] > 0:
                a -= problem.resonant_steady[0, j, 0]
                b -= problem.resonant_steady[0, j, 1]
            x += problem.output_row[j, 0] * a + problem.output_row[j, 1] * b
            v += problem.output_row[j, 2] * a + problem.output_row[j, 3] * b
    return x / period, v / period


@kernel
def _count(impacts: float, held: float) -> int:
    """Return the number for a stop in the name of a motion: impacts, INFINITE, 0 for a rest without impact, or -1."""
    if not np.isfinite(impacts):
        return INFINITE
    if impacts > 0.0:
        return int(impacts)
    return 0 if held > 0.0 else -1


@kernel
def _impacts_of_period(ring: StroboscopicHistory, lane: int, k: int, m: int) -> tuple[float, float, float, float]:
    """Return the impacts on the right and the left stop in the last m half periods, and the half periods with rests."""
    size = ring.min_speed.shape[0]
    right, left = 0.0, 0.0
    held_right, held_left = 0.0, 0.0
    for i in range(m):
        row = (k - i) % size
        first = 0 if (k - i - 1) % 2 == 0 else 1
        right += ring.impacts[row, first, lane]
        left += ring.impacts[row, 1 - first, lane]
        held_right += ring.held[row, first, lane]
        held_left += ring.held[row, 1 - first, lane]
    return right, left, held_right, held_left


@kernel
def name_of(m: int, right: float, left: float, held_right: float, held_left: float, min_speed: float) -> NamedMotion:
    """Return the name of a motion by what happens in the m half periods after which it repeats, or is mirrored.

    These are its impacts on the right and on the left stop, and the half periods in which the contact rests on it.
    """
    symmetric = m % 2 == 1
    if symmetric:  # the other m half periods are the mirror image of these
        right = left = right + left
        held_right = held_left = held_right + held_left
    impacts_right, impacts_left = _count(right, held_right), _count(left, held_left)
    sticking = held_right + held_left > 0.0
    return NamedMotion(
        RESOLVED, m if symmetric else m // 2, impacts_right, impacts_left, symmetric, min_speed, sticking
    )


@kernel
def detect_period(
    problem: CellProblem,
    stops: Stops,
    ring: StroboscopicHistory,
    lane: int,
    k: int,
    max_period: int,
    entered: int,
    reach: float,
) -> NamedMotion:
    """Return the motion of a lane after k half periods.

    The reason of a motion without a name is NOT_CLOSED, SLOW_CONVERGENCE or NEAR_GRAZING.

    Parameters
    ----------
    entered : int
        Half periods of the lane's trajectory that are in the ring: k, or fewer if it began later.
    reach : float
        Bound of |q| without stops (`cells.bounds`): round-off is relative to it, not to the gaps.
    """
    unit = stops.unit
    m = _first_return(problem, stops, ring, lane, k, min(2 * max_period, entered // 4), tolerances.CLOSING_GOAL)
    if m == 0 or (m % 2 == 1 and m > max_period):
        return unnamed(NOT_CLOSED)
    last_return = _largest_return(problem, ring, lane, k, m, unit)
    repeats, min_speed, min_unpressed_speed = compare_windows(ring, lane, k, m)
    if not repeats:
        return unnamed(NOT_CLOSED)
    speed = min_unpressed_speed / (problem.omega * unit)
    # a slow impact amplifies round-off by one over its speed
    floor = min(tolerances.CLOSING_GOAL, tolerances.CLOSING_FLOOR * max(1.0, reach / unit) / min(1.0, speed))
    limit_distance = floor
    if last_return > floor:
        rate = _contraction(problem, ring, lane, k, m, unit, last_return)
        if not rate <= tolerances.SLOWEST_RATE or last_return > tolerances.CLOSING_GOAL:
            return unnamed(SLOW_CONVERGENCE)
        limit_distance = max(limit_distance, last_return * rate / (1.0 - rate))
        if limit_distance > tolerances.LIMIT_DISTANCE:
            return unnamed(SLOW_CONVERGENCE)
    away = tolerances.SEPARATION * tolerances.LIMIT_DISTANCE
    for smaller in range(1, m):
        if (smaller % 2 == 0 or stops.symmetric) and separation(problem, ring, lane, k, smaller, unit, away) <= away:
            return unnamed(SLOW_CONVERGENCE)
    if speed * speed <= tolerances.SEPARATION * limit_distance:
        return unnamed(NEAR_GRAZING)
    right, left, held_right, held_left = _impacts_of_period(ring, lane, k, m)
    if right + left == 0.0 and held_right + held_left > 0.0:
        # the contact has rested all the time, and the springs release it later: this is not the final motion
        return unnamed(NOT_CLOSED)
    return name_of(m, right, left, held_right, held_left, min_speed)


@kernel
def motion_of_run(
    problem: CellProblem, stops: Stops, ring: StroboscopicHistory, run: Run, k: int, max_period: int
) -> NamedMotion:
    """Return the motion of a run after k half periods, whose history is lane 0 of the ring.

    As `detect_period`, but it is the steady motion at once where no contact is possible any more.
    """
    reach = reach_from(problem, stops, run.u, k)
    if is_free_for_ever(problem, stops, reach, run.cursor[runs.ANCHOR]):
        return without_contacts(stops.symmetric)
    return detect_period(problem, stops, ring, 0, k, max_period, k, reach)
