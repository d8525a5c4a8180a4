"""Recognising a motion from the closing of its stroboscopic orbit.

The orbit is read off every *half* forcing period with the sign turned each time, z_k = (-1)^k u(k T/2): with two
symmetric stops that is the orbit of one autonomous map, the half-period map followed by the mirror symmetry. Its least
period m gives everything: m odd is a symmetric motion of m forcing periods, m even a motion of m/2 that is not its own
mirror image.

A motion is named only when (1) the orbit returns after m halves to CLOSING_GOAL and no smaller m does, (2) the returns
contract over three windows of m halves, and the distance to the limit extrapolated from the slower contraction is below
LIMIT_DISTANCE, (3) every smaller period stays away by SEPARATION times the largest distance allowed (a spiral, or two
nearly equal multipliers, can make a return look far better than it is), (4) impacts repeat, and (5) the slowest impact
is no graze by the same measure. Everything else goes on, and ends unresolved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.kernels.cells import CellProblem
from grazemap_core.kernels.contact import Workspace
from grazemap_core.tolerances import CLOSING_FLOOR, CLOSING_GOAL, LIMIT_DISTANCE, SEPARATION, SLOWEST_RATE

FloatArray = NDArray[np.float64]

NAMED = 0
"""The motion is periodic; period, impacts and symmetry are known."""
NOT_CLOSED = 1
"""The orbit has not returned to itself within the periods and the longest period looked at."""
SLOW = 2
"""It returns, but contracts too slowly for the limit to be told."""
GRAZES = 3
"""It returns, but an impact is so slow that it may be none in the limit."""
CHATTERS = 4
"""Complete chatter: infinitely many impacts end in sticking, which this version does not follow."""
BUDGET = 5
"""Too many impacts, in half a period or without settling."""
OVERFLOWS = 6
"""A number overflowed."""


class Orbit(NamedTuple):
    """The last half periods, a ring: states (2 N, ring), impacts per half and stop (ring, 2), least speed (ring,)."""

    states: FloatArray
    impacts: FloatArray
    least: FloatArray


def orbit(blocks: int, max_period: int) -> Orbit:
    """Return an empty ring long enough to judge motions of up to `max_period` forcing periods."""
    ring = 8 * max_period + 2
    return Orbit(np.zeros((2 * blocks, ring)), np.zeros((ring, 2)), np.full(ring, np.inf))


@njit(cache=True, nogil=True, error_model="numpy")
def enter(ring: Orbit, k: int, u: FloatArray, work: Workspace) -> None:
    """Enter the state after k half periods and the tally of the half period that led to it; clear the tally."""
    row = k % ring.least.shape[0]
    sign = 1.0 if k % 2 == 0 else -1.0
    for j in range(u.shape[0]):
        ring.states[2 * j, row] = sign * u[j, 0]
        ring.states[2 * j + 1, row] = sign * u[j, 1]
    # in the frame of z the stops change sides every half period
    even = (k - 1) % 2 == 0
    ring.impacts[row, 0] = work.tally[0] if even else work.tally[1]
    ring.impacts[row, 1] = work.tally[1] if even else work.tally[0]
    ring.least[row] = work.tally[2]
    work.tally[0] = 0.0
    work.tally[1] = 0.0
    work.tally[2] = np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def _separation(problem: CellProblem, ring: Orbit, k: int, m: int, clearance: float, enough: float) -> float:
    """Return the distance of z_k and z_(k-m) in units of the clearance; any value above `enough` may be cut short."""
    size = ring.least.shape[0]
    now, then = k % size, (k - m) % size
    enough *= clearance
    largest = 0.0
    for i in range(2 * problem.decay.shape[0]):
        change = abs(ring.states[i, now] - ring.states[i, then])
        largest = max(largest, change * problem.closeness[i // 2, i % 2])
        if largest > enough:
            break
    return largest / clearance


@njit(cache=True, nogil=True, error_model="numpy")
def _least_return(problem: CellProblem, ring: Orbit, k: int, longest: int, clearance: float) -> int:
    """Return the least m <= longest with z_k closer than CLOSING_GOAL to z_(k-m), or 0."""
    size = ring.least.shape[0]
    row = k % size
    here = ring.states[0, row]
    near = CLOSING_GOAL * clearance / problem.closeness[0, 0]
    for m in range(1, longest + 1):
        row = row - 1 if row > 0 else size - 1
        # one coordinate tells most returns apart; the others are looked at only where it agrees
        if abs(ring.states[0, row] - here) <= near and (
            _separation(problem, ring, k, m, clearance, CLOSING_GOAL) <= CLOSING_GOAL
        ):
            return m
    return 0


@njit(cache=True, nogil=True, error_model="numpy")
def name_motion(
    problem: CellProblem, ring: Orbit, k: int, max_period: int, clearance: float, reach: float
) -> tuple[int, int, int, int, bool, float]:
    """Judge the orbit after k half periods.

    Parameters
    ----------
    reach : float
        Bound of |x1| without stops (`cells.bounds`): round-off is relative to it, not to the clearance.

    Returns
    -------
    reason : NAMED, NOT_CLOSED, SLOW or GRAZES.
    period, impacts_right, impacts_left : int
        The motion n-p_r-q_l; impacts are -1 for a stop that is not touched. 0 unless NAMED.
    symmetric : bool
    least_speed : float
        Least impact speed over the last two periods of z; infinite without impacts.
    """
    m = _least_return(problem, ring, k, min(2 * max_period, k // 4), clearance)
    if m == 0 or (m % 2 == 1 and m > max_period):
        return NOT_CLOSED, 0, 0, 0, False, np.inf
    size = ring.least.shape[0]
    now, before, earlier_still = 0.0, 0.0, 0.0
    least = np.inf
    for i in range(m):
        now = max(now, _separation(problem, ring, k - i, m, clearance, np.inf))
        before = max(before, _separation(problem, ring, k - i - m, m, clearance, np.inf))
        earlier_still = max(earlier_still, _separation(problem, ring, k - i - 2 * m, m, clearance, np.inf))
        row, earlier = (k - i) % size, (k - i - m) % size
        least = min(least, min(ring.least[row], ring.least[earlier]))
        for stop in range(2):
            if ring.impacts[row, stop] != ring.impacts[earlier, stop]:
                return NOT_CLOSED, 0, 0, 0, False, np.inf
    speed = least / (problem.omega * clearance)
    # a slow impact amplifies round-off by one over its speed
    floor = min(CLOSING_GOAL, CLOSING_FLOOR * max(1.0, reach / clearance) / min(1.0, speed))
    limit = floor
    if now > floor:
        rate = max(now / before, before / earlier_still)
        if not rate <= SLOWEST_RATE or now > CLOSING_GOAL:
            return SLOW, 0, 0, 0, False, np.inf
        limit = max(limit, now * rate / (1.0 - rate))
        if limit > LIMIT_DISTANCE:
            return SLOW, 0, 0, 0, False, np.inf
    away = SEPARATION * LIMIT_DISTANCE
    for smaller in range(1, m):
        if _separation(problem, ring, k, smaller, clearance, away) <= away:
            return SLOW, 0, 0, 0, False, np.inf
    if speed * speed <= SEPARATION * limit:
        return GRAZES, 0, 0, 0, False, np.inf
    right, left = 0, 0
    for i in range(m):
        row = (k - i) % size
        even = (k - i - 1) % 2 == 0
        right += int(ring.impacts[row, 0 if even else 1])
        left += int(ring.impacts[row, 1 if even else 0])
    symmetric = m % 2 == 1
    if symmetric:  # the other m halves of the motion are the mirror image of these
        right = left = right + left
    period = m if symmetric else m // 2
    return NAMED, period, right if right > 0 else -1, left if left > 0 else -1, symmetric, least
