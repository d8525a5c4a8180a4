"""A free motion with unit impulses at equal intervals, and the contacts of its orbits with a stop between them.

`contact_angle` returns the angle on the branch of single-impact orbits at which a further contact appears: the largest
``atan2(N(t), D(t))`` over all times t between two impacts, with N and D as in `_distance`. The search halves cells
until bounds decide (theory, "One impact a period").

Where ``P(t) = N(t) cos(angle) - D(t) sin(angle)`` is positive, the contact is beyond the stop. The third derivative of
the motion is bounded by the energies of the blocks, which never increase. A cell is decided when

- P is negative on it by its value, slope, curvature and that bound;
- P is monotone on it, so that its maximum is at an end;
- P is concave on it, so that Newton's method finds its maximum.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.grazing.tolerances import (
    CONTACT_CELLS,
    CONTACT_ROUNDOFF,
    MAX_CELLS,
    MAXIMUM_STEP,
    MIN_CONTACT_CELL,
    TANGENT_WIDTH,
)
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import block_sum
from grazemap_core.model.tolerances import BOUND_SAFETY
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.records import NamedTuple
from grazemap_core.tolerances import EPSILON

ADMISSIBLE = 0
"""Orbits of vanishing impact speed meet no stop between their impacts, and the largest angle is known."""
ANGLE_UNDECIDED = 1
"""Round-off hides whether slow orbits of the family meet a stop between their impacts."""
NEVER = 2
"""No orbit of the family is admissible: orbits of arbitrarily small impact speed meet a stop between their impacts."""
ANGLE_NEEDS_MORE_CELLS = 3
"""More than MAX_CELLS are needed."""

_STACK = 512
"""Maximum number of cells that wait to be searched."""
_NEWTON_STEPS = 60
"""Maximum number of Newton or bisection steps for a maximum."""

_CLEAR, _CANDIDATE, _HALVE = 0, 1, 2
"""What a cell requires: nothing, a test of the point where the distance may be positive, or halving."""


class KickedMotion(NamedTuple):
    """The free motion that a unit impulse at every impact of a family of orbits causes."""

    decay: Floats
    """(N,) Of the blocks."""
    discriminant: Floats
    """(N,) Of the blocks."""
    frequency_squared: Floats
    """(N,) Of the blocks."""
    state: Floats
    """(N, 2) Contribution of each block to the displacement G of the contact, and to G', just after an impulse."""
    level: float
    """H, the displacement of the contact at an impulse, caused by all earlier ones."""
    factor: float
    """``(1 + R)/d``."""
    omega: float
    """Forcing frequency."""


class _Angle(NamedTuple):
    """An angle on the branch."""

    sine: float
    """Sine of the angle."""
    cosine: float
    """Cosine of the angle."""


class _TimeInterval(NamedTuple):
    """An interval of time."""

    left: float
    """Start of the interval."""
    right: float
    """End of the interval."""
    at_start: bool
    """Whether an impact is at the start."""
    at_end: bool
    """Whether an impact is at the end."""
    last: float
    """Time of the next impact."""


@njit(cache=True, nogil=True, error_model="numpy")
def state_before_impulse(
    kind: int, decay: Floats, discriminant: Floats, frequency_squared: Floats, first: Floats, second: Floats, tau: float
) -> Floats:
    """Return ``sum_{k>=1} (+-1)^k exp(T k tau) (first, second)`` of every block, shape (N, 2).

    Parameters
    ----------
    kind : int
        SAME_SIGN or ALTERNATING, from `response_sums`.
    decay, discriminant, frequency_squared : ndarray of shape (N,)
    first, second : ndarray of shape (N,)
        Change of the first coordinate of a block, and of its second, by an impulse.
    tau : float
        Time between the impulses.
    """
    result = np.empty((decay.size, 2))
    for j in range(decay.size):
        p, q, _ = block_sum(kind, decay[j], discriminant[j], frequency_squared[j], 0.0, tau)
        result[j, 0] = p * first[j] + q * second[j]
        result[j, 1] = p * second[j] - q * (frequency_squared[j] * first[j] + 2.0 * decay[j] * second[j])
    return result


@kernel
def _distance(motion: KickedMotion, stop: int, t: float, result: Floats) -> None:
    """Write N, N', N'', D, D', D'', a bound of |N'''| from t on, and the terms of N; then N and terms without sines.

    ``N = stop sin(omega t) + factor (level - stop G(t))``, ``D = 1 - stop cos(omega t)``; result has the shape (10,).
    """
    decay, discriminant, frequency_squared, state, level, factor, omega = motion
    value, slope, second_derivative, bound, terms = 0.0, 0.0, 0.0, 0.0, abs(level)
    for j in range(decay.size):
        e11, e12, e21, e22 = block_flow(decay[j], discriminant[j], frequency_squared[j], t)
        y = e11 * state[j, 0] + e12 * state[j, 1]
        rate = e21 * state[j, 0] + e22 * state[j, 1]
        second = -frequency_squared[j] * y - 2.0 * decay[j] * rate
        third = -frequency_squared[j] * rate - 2.0 * decay[j] * second
        value += y
        slope += rate
        second_derivative += second
        bound += math.sqrt(frequency_squared[j] * second * second + third * third)
        frequency = math.sqrt(frequency_squared[j])
        terms += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * t)
    sine, cosine = math.sin(omega * t), math.cos(omega * t)
    half = math.sin(0.5 * omega * t) if stop > 0 else math.cos(0.5 * omega * t)
    result[0] = stop * sine + factor * (level - stop * value)
    result[1] = stop * (omega * cosine - factor * slope)
    result[2] = -stop * (omega * omega * sine + factor * second_derivative)
    result[3] = 2.0 * half * half
    result[4] = stop * omega * sine
    result[5] = stop * omega * omega * cosine
    result[6] = (omega * omega * omega + factor * bound) * BOUND_SAFETY
    result[7] = 1.0 + omega * t + factor * terms
    result[8] = factor * (level - stop * value)
    result[9] = factor * terms


@kernel
def _verdict(excess: float, terms: float) -> int:
    """Return the verdict on orbits of vanishing impact speed, from an excess over a stop and the size of its terms."""
    if abs(excess) <= CONTACT_ROUNDOFF * terms:
        return ANGLE_UNDECIDED
    return NEVER if excess > 0.0 else ADMISSIBLE


@kernel
def _contact_at_graze(motion: KickedMotion, half_periods: int, stop: int, here: Floats) -> tuple[int, float]:
    """Return whether orbits of vanishing impact speed meet the stop, and when.

    Only the times at which the forcing is as at the graze are tested: there a contact does not depend on the angle.

    Returns
    -------
    verdict : ADMISSIBLE if they do not, ANGLE_UNDECIDED or NEVER.
    time : float
        Time of the contact; NaN if there is none.
    """
    verdict, time = ADMISSIBLE, math.nan
    half = math.pi / motion.omega
    for m in range(1, half_periods):
        if (m % 2 == 0) == (stop > 0):
            _distance(motion, stop, m * half, here)
            verdict = max(verdict, _verdict(here[8], here[9]))
            if verdict != ADMISSIBLE:
                time = m * half
            if verdict == NEVER:
                break
    return verdict, time


@kernel
def _maximum(motion: KickedMotion, stop: int, angle: _Angle, cell: _TimeInterval, here: Floats) -> float:
    """Return where the distance is largest on a cell on which it is concave; `here` is the distance at the middle."""
    sine, cosine = angle
    point = 0.5 * (cell.left + cell.right)
    low, high = cell.left, cell.right
    slope = here[1] * cosine - here[4] * sine
    second_derivative = here[2] * cosine - here[5] * sine
    for _ in range(_NEWTON_STEPS):
        if slope > 0.0:
            low = point
        else:
            high = point
        following = point - slope / second_derivative
        if not low <= following <= high:
            following = 0.5 * (low + high)
        if abs(following - point) <= MAXIMUM_STEP * cell.last:
            break
        point = following
        _distance(motion, stop, point, here)
        slope = here[1] * cosine - here[4] * sine
        second_derivative = here[2] * cosine - here[5] * sine
    return point


@kernel
def _search_cell(
    motion: KickedMotion, stop: int, angle: _Angle, cell: _TimeInterval, here: Floats, other: Floats
) -> tuple[int, float]:
    """Return whether the distance at an angle may be positive on a cell, and a point to test.

    The impacts themselves, at which the distance is zero, do not count.

    Returns
    -------
    what : _CLEAR, _CANDIDATE or _HALVE.
    point : float
    """
    sine, cosine = angle
    left, right, at_start, at_end, last = cell
    omega = motion.omega
    middle, radius = 0.5 * (left + right), 0.5 * (right - left)
    _distance(motion, stop, left, other)
    third = other[6] * cosine + omega * omega * omega * abs(sine)
    first_slope = other[1] * cosine - other[4] * sine
    first_noise = CONTACT_ROUNDOFF * omega * other[7]
    _distance(motion, stop, middle, here)
    noise = CONTACT_ROUNDOFF * (here[7] * cosine + abs(sine) * (1.0 + omega * middle))
    value = here[0] * cosine - here[3] * sine
    slope = here[1] * cosine - here[4] * sine
    second_derivative = here[2] * cosine - here[5] * sine
    steepest = second_derivative + radius * third
    if value + radius * (abs(slope) + 0.5 * radius * max(steepest, 0.0)) < -noise:
        return _CLEAR, middle
    if value > noise:
        return _CANDIDATE, middle
    if abs(slope) > radius * (abs(second_derivative) + radius * third):
        if (slope < 0.0 and at_start) or (slope > 0.0 and at_end):
            return _CLEAR, middle
        return _CANDIDATE, right if slope > 0.0 else left
    if steepest < 0.0:
        if first_slope <= (first_noise if at_start else 0.0):
            return _CLEAR if at_start else _CANDIDATE, left
        point = _maximum(motion, stop, angle, cell, here)
        return _CLEAR if at_end and right - point <= TANGENT_WIDTH * last else _CANDIDATE, point
    return _HALVE if right - left > MIN_CONTACT_CELL * last else _CLEAR, middle


@njit(cache=True, nogil=True, error_model="numpy")
def contact_angle(motion: KickedMotion, half_periods: int, stop: int, meets: int) -> tuple[float, float, float, int]:
    """Return the largest angle ``atan2(N(t), D(t))`` between the impacts, and where it is.

    Parameters
    ----------
    motion : KickedMotion
    half_periods : int
        Time between impacts, in half forcing periods.
    stop : int
        +1: the stop of the impact at t = 0, -1: the other one.
    meets : int
        The stop of the impact at the end.

    Returns
    -------
    sine, cosine : float
        Sine and cosine of the angle, in [-pi/2, pi/2].
    time : float
        Time of the contact.
    status : int
        ADMISSIBLE, ANGLE_UNDECIDED, NEVER or ANGLE_NEEDS_MORE_CELLS.
    """
    half = math.pi / motion.omega
    last = half_periods * half
    here, other = np.empty(10), np.empty(10)
    verdict, time = _contact_at_graze(motion, half_periods, stop, here)
    if verdict != ADMISSIBLE:
        return 1.0, 0.0, time, verdict
    sine, cosine = -1.0, 0.0
    if stop > 0:
        _distance(motion, stop, 0.0, here)
        if abs(here[1]) <= CONTACT_ROUNDOFF * motion.omega * here[7]:
            # no rebound: the contact may stay on the stop, which counts as a contact
            length = math.hypot(here[2], here[5])
            sine, cosine, time = here[2] / length, here[5] / length, 0.0

    stack = np.empty((_STACK, 2))
    cells = 0
    # half periods are cut separately, so that the times of `_contact_at_graze` are ends of cells
    for part in range(half_periods * CONTACT_CELLS):
        stack[0, 0] = part * half / CONTACT_CELLS
        stack[0, 1] = (part + 1) * half / CONTACT_CELLS
        top = 1
        while top > 0:
            cells += 1
            if cells > MAX_CELLS:
                return sine, cosine, time, ANGLE_NEEDS_MORE_CELLS
            top -= 1
            left, right = stack[top, 0], stack[top, 1]
            at_end = right >= last * (1.0 - 4.0 * EPSILON) and stop == meets
            cell = _TimeInterval(left, right, left == 0.0 and stop > 0, at_end, last)
            what, point = _search_cell(motion, stop, _Angle(sine, cosine), cell, here, other)
            if what == _HALVE:
                if top + 2 > _STACK:
                    return sine, cosine, time, ANGLE_NEEDS_MORE_CELLS
                middle = 0.5 * (left + right)
                stack[top, 0], stack[top, 1] = middle, right
                stack[top + 1, 0], stack[top + 1, 1] = left, middle
                top += 2
            elif what == _CANDIDATE:
                _distance(motion, stop, point, here)
                noise = CONTACT_ROUNDOFF * (here[7] * cosine + abs(sine) * (1.0 + motion.omega * point))
                if here[0] * cosine - here[3] * sine > noise:
                    # the angle is larger: the cell is searched again with it
                    length = math.hypot(here[0], here[3])
                    sine, cosine, time = here[0] / length, here[3] / length, point
                    stack[top, 0], stack[top, 1] = left, right
                    top += 1
    return sine, cosine, time, ADMISSIBLE


@njit(cache=True, nogil=True, error_model="numpy")
def contact_margin(
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    state: Floats,
    level: float,
    omega: float,
    half_periods: int,
    one_stop: bool,
) -> tuple[float, int]:
    """Return by how much orbits of vanishing impact speed miss the stops between their impacts, and the verdict.

    The margin is the minimum of ``(-1)^j G(j T/2) - H`` over the returns j between two impacts, relative to the terms
    of G(0); infinity if there is no such return. With one stop only returns after whole periods count, those of even
    j. The verdict is ADMISSIBLE if all distances are positive, ANGLE_UNDECIDED or NEVER. The arguments are the fields
    of a `KickedMotion`, because numba is slow to unpack a named tuple from Python.
    """
    motion = KickedMotion(decay, discriminant, frequency_squared, state, level, 1.0, omega)
    here = np.empty(10)
    margin, verdict = math.inf, ADMISSIBLE
    terms = abs(level)
    for j in range(decay.size):
        terms += abs(state[j, 0]) + abs(state[j, 1]) / math.sqrt(frequency_squared[j])
    for m in range(1, half_periods):
        stop = 1 if m % 2 == 0 else -1
        if one_stop and stop < 0:
            continue
        _distance(motion, stop, m * (math.pi / omega), here)
        margin = min(margin, -here[8] / terms)
        verdict = max(verdict, _verdict(here[8], here[9]))
    return margin, verdict
