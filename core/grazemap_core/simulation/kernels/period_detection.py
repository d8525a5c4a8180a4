"""Recognising a motion from the closing of its stroboscopic orbit.

The orbit is read off every *half* forcing period with the sign turned each time, z_k = (-1)^k u(k T/2): with two
symmetric stops that is the orbit of one autonomous map, the half-period map followed by the mirror symmetry. Its least
period m gives everything: m odd is a symmetric motion of m forcing periods, m even a motion of m/2 that is not its own
mirror image.

A motion is named only when (1) the orbit returns after m halves to CLOSING_GOAL and no smaller m does, (2) the returns
contract over three windows of m halves, and the distance to the limit extrapolated from the slower contraction is below
LIMIT_DISTANCE, (3) every smaller period stays away by SEPARATION times the largest distance allowed (a spiral, or two
nearly equal multipliers, can make a return look far better than it is), (4) impacts repeat, and (5) the slowest impact
is no graze by the same measure. Everything else goes on, and ends unresolved. An impact at
which mass 1 is pressed against the stop is no graze however slow it is: it cannot vanish.

With a complete chatter the impacts on a stop are infinite in number, and INFINITE says so; how many of them were
followed one by one depends on a tolerance and is no property of the motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.codes import GRAZES, INFINITE, NAMED, NOT_CLOSED, SLOW
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.workspace import (
    HELD_LEFT,
    HELD_RIGHT,
    LEAST_SPEED,
    LEAST_UNPRESSED,
    LEFT,
    RIGHT,
    Workspace,
    clear_tally,
)
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.simulation.tolerances import (
    APPROACH_RATE,
    CLOSING_FLOOR,
    CLOSING_GOAL,
    LIMIT_DISTANCE,
    SEPARATION,
    SLOWEST_RATE,
    SPEED_APART,
)


class StroboscopicHistory(NamedTuple):
    """The last half periods of one or more lanes, a ring.

    Attributes
    ----------
    states : (ring, 2 N, lanes)
    impacts, held : (ring, 2, lanes)
        Per half and stop: impacts, and 1 where mass 1 has rested.
    least, unpressed : (ring, lanes)
        Least speed of all impacts, and of those at which mass 1 was not pressed against the stop.
    """

    states: Floats
    impacts: Floats
    held: Floats
    least: Floats
    unpressed: Floats


def stroboscopic_history(blocks: int, max_period: int, lanes: int = 1) -> StroboscopicHistory:
    """Return an empty ring long enough to judge motions of up to `max_period` forcing periods."""
    ring = 8 * max_period + 2
    return StroboscopicHistory(
        states=np.zeros((ring, 2 * blocks, lanes)),
        impacts=np.zeros((ring, 2, lanes)),
        held=np.zeros((ring, 2, lanes)),
        least=np.full((ring, lanes), np.inf),
        unpressed=np.full((ring, lanes), np.inf),
    )


@kernel
def enter(ring: StroboscopicHistory, k: int, u: Floats, work: Workspace) -> None:
    """Enter the state after k half periods into lane 0 with the tally of the half before it; clear the tally."""
    row = k % ring.least.shape[0]
    sign = 1.0 if k % 2 == 0 else -1.0
    for j in range(u.shape[0]):
        ring.states[row, 2 * j, 0] = sign * u[j, 0]
        ring.states[row, 2 * j + 1, 0] = sign * u[j, 1]
    # in the frame of z the stops change sides every half period
    first = 0 if (k - 1) % 2 == 0 else 1
    ring.impacts[row, first, 0] = work.tally[RIGHT]
    ring.impacts[row, 1 - first, 0] = work.tally[LEFT]
    ring.held[row, first, 0] = work.tally[HELD_RIGHT]
    ring.held[row, 1 - first, 0] = work.tally[HELD_LEFT]
    ring.least[row, 0] = work.tally[LEAST_SPEED]
    ring.unpressed[row, 0] = work.tally[LEAST_UNPRESSED]
    clear_tally(work.tally)


@kernel
def separation(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, clearance: float, enough: float
) -> float:
    """Return the distance of z_k and z_(k-m) in units of the clearance; any value above `enough` may be cut short."""
    size = ring.least.shape[0]
    now, then = k % size, (k - m) % size
    enough *= clearance
    largest = 0.0
    for i in range(2 * problem.decay.shape[0]):
        change = abs(ring.states[now, i, lane] - ring.states[then, i, lane])
        largest = max(largest, change * problem.closeness[i // 2, i % 2])
        if largest > enough:
            break
    return largest / clearance


@kernel
def _least_return(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, longest: int, clearance: float, goal: float
) -> int:
    """Return the least m <= longest with z_k closer to z_(k-m) than goal, in units of the clearance, or 0."""
    size = ring.least.shape[0]
    row = k % size
    here = ring.states[row, 0, lane]
    near = goal * clearance / problem.closeness[0, 0]
    for m in range(1, longest + 1):
        row = row - 1 if row > 0 else size - 1
        # one coordinate tells most returns apart; the others are looked at only where it agrees
        if abs(ring.states[row, 0, lane] - here) <= near and (
            separation(problem, ring, lane, k, m, clearance, goal) <= goal
        ):
            return m
    return 0


@kernel
def _largest_return(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, clearance: float
) -> float:
    """Return the largest distance of returns after m halves, in the window of m halves that ends with k."""
    largest = 0.0
    for i in range(m):
        largest = max(largest, separation(problem, ring, lane, k - i, m, clearance, np.inf))
    return largest


@kernel
def impacts_of_two(ring: StroboscopicHistory, lane: int, k: int, m: int) -> tuple[bool, float, float]:
    """Look at the impacts of the last two windows of m halves.

    Returns
    -------
    repeats : bool
        Whether they are as many in both.
    least, unpressed : float
        Least speed of all, and of those at which mass 1 was not pressed against the stop.
    """
    size = ring.least.shape[0]
    least, unpressed = np.inf, np.inf
    for i in range(m):
        row, earlier = (k - i) % size, (k - i - m) % size
        least = min(least, min(ring.least[row, lane], ring.least[earlier, lane]))
        unpressed = min(unpressed, min(ring.unpressed[row, lane], ring.unpressed[earlier, lane]))
        for stop in range(2):
            if ring.impacts[row, stop, lane] != ring.impacts[earlier, stop, lane]:
                return False, least, unpressed
    return True, least, unpressed


@kernel
def nearest_returns(
    problem: CellProblem,
    ring: StroboscopicHistory,
    k: int,
    longest: int,
    bound: Floats,
    enough: Floats,
    known: Floats,
    length: Floats,
    nearest: Floats,
    distance: Floats,
    used: int,
) -> None:
    """Look how near every lane is to where it was some 1 .. longest half periods ago.

    Parameters
    ----------
    bound, enough, known : (lanes,)
        Distance that counts as a return, negative for none, overwritten; that behind which `nearest` does not matter;
        half periods that the ring knows of the lane. Four times as many as it takes to return are wanted.
    length, nearest : (lanes,)
        Receive the least number of half periods after which it has returned, 0 if it has not; and the least distance,
        if that is no more than `enough`.
    distance : (lanes,)
        Scratch.
    used : int
        Only so many lanes are looked at.
    """
    size = ring.least.shape[0]
    row = k % size
    now = ring.states[row]
    length[:] = 0.0
    nearest[:] = np.inf
    for m in range(1, longest + 1):
        row = row - 1 if row > 0 else size - 1
        then = ring.states[row]
        # one coordinate or two tell most lengths apart, for all lanes
        weight, here, there, near = problem.closeness[0, 0], now[0], then[0], 0
        for lane in range(min(used, distance.shape[0])):
            near += 1 if weight * abs(here[lane] - there[lane]) <= bound[lane] else 0
        if near == 0:
            continue
        for lane in range(min(used, distance.shape[0])):
            distance[lane] = weight * abs(here[lane] - there[lane])
        for c in range(1, now.shape[0]):
            weight = problem.closeness[c // 2, c % 2]
            here, there, near = now[c], then[c], 0
            for lane in range(min(used, distance.shape[0])):
                distance[lane] = max(distance[lane], weight * abs(here[lane] - there[lane]))
                near += 1 if distance[lane] <= bound[lane] else 0
            if near == 0:
                break
        if near == 0:
            continue
        number = float(m)
        for lane in range(min(used, distance.shape[0])):
            away = distance[lane] if 4.0 * number <= known[lane] else np.inf
            length[lane] = number if (away <= bound[lane]) & (length[lane] == 0.0) else length[lane]
            nearest[lane] = min(nearest[lane], away)
            bound[lane] = min(bound[lane], enough[lane] if length[lane] > 0.0 else bound[lane])


@kernel
def orbit_nearby(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, m: int, max_period: int, clearance: float
) -> float:
    """Return how far a periodic orbit was a return ago that a lane comes ever closer to; infinite if there is none.

    Parameters
    ----------
    m : int
        Half periods after which the lane returns; 4 m of them must be in the ring.

    Returns
    -------
    As extrapolated from three windows of returns, in units of the clearance.
    """
    if m % 2 == 1 and m > max_period:
        return np.inf
    now = _largest_return(problem, ring, lane, k, m, clearance)
    before = _largest_return(problem, ring, lane, k - m, m, clearance)
    if not now / before <= APPROACH_RATE:
        return np.inf
    rate = max(now / before, before / _largest_return(problem, ring, lane, k - 2 * m, m, clearance))
    if not rate <= APPROACH_RATE:
        return np.inf
    repeats, _, unpressed = impacts_of_two(ring, lane, k, m)
    distance = now * rate / (1.0 - rate)
    speed = unpressed / (problem.omega * clearance)
    return now + distance if repeats and speed * speed > SPEED_APART * distance else np.inf


@kernel
def mean_section(
    problem: CellProblem, ring: StroboscopicHistory, lane: int, k: int, period: int
) -> tuple[float, float]:
    """Return the mean position and velocity of mass 1, less its steady motion, where the forcing's phase is 0.

    Over the last `period` forcing periods; motions with the same name are told apart by it.
    """
    size = ring.least.shape[0]
    x, v = 0.0, 0.0
    for i in range(k % 2, 2 * period, 2):
        row = (k - i) % size
        for j in range(problem.output_row.shape[0]):
            a, b = ring.states[row, 2 * j, lane], ring.states[row, 2 * j + 1, lane]
            x += problem.output_row[j, 0] * a + problem.output_row[j, 1] * b
            v += problem.output_row[j, 2] * a + problem.output_row[j, 3] * b
    return x / period, v / period


@kernel
def _count(impacts: float, held: float) -> int:
    """Return what stands for a stop in a motion's name."""
    if not np.isfinite(impacts):
        return INFINITE
    if impacts > 0.0:
        return int(impacts)
    return 0 if held > 0.0 else -1


@kernel
def name_motion(
    problem: CellProblem,
    ring: StroboscopicHistory,
    lane: int,
    k: int,
    entered: int,
    max_period: int,
    clearance: float,
    reach: float,
    known_rate: float,
) -> tuple[int, int, int, int, bool, float, bool]:
    """Judge the orbit of a lane after k half periods.

    Parameters
    ----------
    entered : int
        Half periods that the lane has done: k, or less where its trajectory began later than the ring.
    reach : float
        Bound of |x1| without stops (`cells.bounds`): round-off is relative to it, not to the clearance.
    known_rate : float
        Contraction per return at most, if it is known from before, and returns are compared over three windows instead
        of four; else 0.

    Returns
    -------
    reason : NAMED, NOT_CLOSED, SLOW or GRAZES.
    period, impacts_right, impacts_left : int
        The motion n-p_r-q_l; impacts are -1 for a stop that is not touched, INFINITE with a complete chatter, 0 for a
        stop that mass 1 rests on without an impact. All 0 unless NAMED.
    symmetric : bool
    least_speed : float
        Least impact speed over the last two periods of z; infinite without impacts, 0 with a complete chatter.
    sticking : bool
        Whether mass 1 rests on a stop some time in the period.
    """
    windows = 3 if known_rate > 0.0 else 4
    m = _least_return(problem, ring, lane, k, min(2 * max_period, entered // windows), clearance, CLOSING_GOAL)
    if m == 0 or (m % 2 == 1 and m > max_period):
        return NOT_CLOSED, 0, 0, 0, False, np.inf, False
    size = ring.least.shape[0]
    now = _largest_return(problem, ring, lane, k, m, clearance)
    repeats, least, unpressed = impacts_of_two(ring, lane, k, m)
    if not repeats:
        return NOT_CLOSED, 0, 0, 0, False, np.inf, False
    speed = unpressed / (problem.omega * clearance)
    # a slow impact amplifies round-off by one over its speed
    floor = min(CLOSING_GOAL, CLOSING_FLOOR * max(1.0, reach / clearance) / min(1.0, speed))
    limit = floor
    if now > floor:
        before = _largest_return(problem, ring, lane, k - m, m, clearance)
        rate = known_rate
        if rate == 0.0:
            rate = before / _largest_return(problem, ring, lane, k - 2 * m, m, clearance)
        rate = max(now / before, rate)
        if not rate <= SLOWEST_RATE or now > CLOSING_GOAL:
            return SLOW, 0, 0, 0, False, np.inf, False
        limit = max(limit, now * rate / (1.0 - rate))
        if limit > LIMIT_DISTANCE:
            return SLOW, 0, 0, 0, False, np.inf, False
    away = SEPARATION * LIMIT_DISTANCE
    for smaller in range(1, m):
        if separation(problem, ring, lane, k, smaller, clearance, away) <= away:
            return SLOW, 0, 0, 0, False, np.inf, False
    if speed * speed <= SEPARATION * limit:
        return GRAZES, 0, 0, 0, False, np.inf, False
    right, left = 0.0, 0.0
    held_right, held_left = 0.0, 0.0
    for i in range(m):
        row = (k - i) % size
        first = 0 if (k - i - 1) % 2 == 0 else 1
        right += ring.impacts[row, first, lane]
        left += ring.impacts[row, 1 - first, lane]
        held_right += ring.held[row, first, lane]
        held_left += ring.held[row, 1 - first, lane]
    if right + left == 0.0 and held_right + held_left > 0.0:
        return NOT_CLOSED, 0, 0, 0, False, np.inf, False  # at rest, but the springs pull mass 1 off in the end
    symmetric = m % 2 == 1
    if symmetric:  # the other m halves of the motion are the mirror image of these
        right = left = right + left
        held_right = held_left = held_right + held_left
    period = m if symmetric else m // 2
    sticking = held_right + held_left > 0.0
    return NAMED, period, _count(right, held_right), _count(left, held_left), symmetric, least, sticking
