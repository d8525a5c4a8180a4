"""A free motion that is kicked at even intervals, and where its orbit would meet a stop between the kicks.

Blocks, the spacing of the kicks and the family's numbers flow in. Out flow the motion's state before a kick, and the
angle on the branch of single-impact orbits at which a further contact appears: the largest one over the whole time
between impacts, by a search that is halved until bounds decide (theory, "One impact a period").

With P(t) the distance beyond the stop, and the rest of a motion's third derivative bounded by the blocks' energies,
which never rise, a cell is done when

- P stays below zero on it by its value, slope, curvature and that bound;
- P is monotone on it, so that an end is its largest value;
- P is concave on it, so that Newton's method finds its largest value.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.grazing.tolerances import CONTACT_CELLS, CONTACT_ROUNDOFF, LEAST_CONTACT_CELL, MAX_CELLS
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import block_sum
from grazemap_core.model.tolerances import BOUND_SAFETY
from grazemap_core.tolerances import EPSILON

FOUND = 0
"""The angle is the largest one."""
UNDECIDED = 1
"""Round-off hides whether slow orbits of the family meet a stop between their impacts."""
NEVER = 2
"""No orbit of the family is admissible: one as slow as one likes meets a stop between its impacts."""
TOO_MANY_CELLS = 3
"""MAX_CELLS were not enough."""

_STACK = 512
_NEWTON_STEPS = 60


@njit(cache=True, nogil=True, error_model="numpy")
def before_kick(
    kind: int, decay: Floats, discriminant: Floats, frequency_squared: Floats, first: Floats, second: Floats, tau: float
) -> Floats:
    """Return ``sum_{k>=1} (+-1)^k exp(T k tau) (first, second)`` of every block, shape (N, 2).

    Parameters
    ----------
    kind : int
        SAME_SIGN or ALTERNATING, from `response_sums`.
    decay, discriminant, frequency_squared : ndarray of shape (N,)
    first, second : ndarray of shape (N,)
        A kick's change of the block's two coordinates.
    tau : float
        Spacing of the kicks.
    """
    result = np.empty((decay.size, 2))
    for j in range(decay.size):
        p, q, _ = block_sum(kind, decay[j], discriminant[j], frequency_squared[j], 0.0, tau)
        result[j, 0] = p * first[j] + q * second[j]
        result[j, 1] = p * second[j] - q * (frequency_squared[j] * first[j] + 2.0 * decay[j] * second[j])
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _distance(
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    state: Floats,
    level: float,
    factor: float,
    omega: float,
    stop: int,
    t: float,
    result: Floats,
) -> None:
    """Write into result (10,): N, N', N'', D, D', D'', a bound on |N'''| from t on, N's terms; N and terms less sines.

    ``N = stop sin(omega t) + factor (level - stop G(t))``, ``D = 1 - stop cos(omega t)``.
    """
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


@njit(cache=True, nogil=True, error_model="numpy")
def _verdict(excess: float, terms: float) -> int:
    """Say what an excess over a stop, of terms of this size, means for orbits of vanishing impact speed."""
    if abs(excess) <= CONTACT_ROUNDOFF * terms:
        return UNDECIDED
    return NEVER if excess > 0.0 else FOUND


@njit(cache=True, nogil=True, error_model="numpy")
def contact_angle(
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    state: Floats,
    level: float,
    factor: float,
    omega: float,
    half_periods: int,
    stop: int,
    meets: int,
) -> tuple[float, float, float, int]:
    """Return the largest angle ``atan2(N(t), D(t))`` between the impacts, and where it is.

    Parameters
    ----------
    decay, discriminant, frequency_squared : ndarray of shape (N,)
    state : ndarray of shape (N, 2)
        Each block's part in G and G' behind the kick.
    level : float
        H, the displacement that the earlier kicks leave at the time of a kick.
    factor : float
        ``(1 + R)/d``.
    omega : float
    half_periods : int
        Time between impacts, in half forcing periods.
    stop : int
        +1: the stop that is struck at t = 0, -1: the other one.
    meets : int
        The stop that is struck at the end.

    Returns
    -------
    sine, cosine : float
        Of the angle, in [-pi/2, pi/2].
    time : float
        When the contact is.
    status : int
        FOUND, UNDECIDED, NEVER or TOO_MANY_CELLS.
    """
    half = math.pi / omega
    end = half_periods * half
    here, other = np.empty(10), np.empty(10)
    sine, cosine, time = -1.0, 0.0, math.nan
    # at the times at which the forcing is as at the graze itself a contact does not depend on the angle
    verdict = FOUND
    for m in range(1, half_periods):
        if (m % 2 == 0) == (stop > 0):
            _distance(decay, discriminant, frequency_squared, state, level, factor, omega, stop, m * half, here)
            verdict = max(verdict, _verdict(here[8], here[9]))
            if verdict != FOUND:
                sine, cosine, time = 1.0, 0.0, m * half
            if verdict == NEVER:
                return sine, cosine, time, NEVER
    if verdict == UNDECIDED:
        return sine, cosine, time, UNDECIDED
    if stop > 0:
        _distance(decay, discriminant, frequency_squared, state, level, factor, omega, stop, 0.0, here)
        if abs(here[1]) <= CONTACT_ROUNDOFF * omega * here[7]:
            # no rebound: whether mass 1 leaves the stop at all is one of the contacts
            length = math.hypot(here[2], here[5])
            sine, cosine, time = here[2] / length, here[5] / length, 0.0

    stack = np.empty((_STACK, 2))
    cells = 0
    # whole half periods one by one, so that the times above are ends of cells
    for part in range(half_periods * CONTACT_CELLS):
        stack[0, 0] = part * half / CONTACT_CELLS
        stack[0, 1] = (part + 1) * half / CONTACT_CELLS
        top = 1
        while top > 0:
            cells += 1
            if cells > MAX_CELLS:
                return sine, cosine, time, TOO_MANY_CELLS
            top -= 1
            left, right = stack[top, 0], stack[top, 1]
            middle, radius = 0.5 * (left + right), 0.5 * (right - left)
            # the distance is zero, and not the further contact that is looked for, at the impacts themselves
            at_start = left == 0.0 and stop > 0
            at_end = right >= end * (1.0 - 4.0 * EPSILON) and stop == meets
            _distance(decay, discriminant, frequency_squared, state, level, factor, omega, stop, left, other)
            third = other[6] * cosine + omega * omega * omega * abs(sine)
            first_slope = other[1] * cosine - other[4] * sine
            first_noise = CONTACT_ROUNDOFF * omega * other[7]
            _distance(decay, discriminant, frequency_squared, state, level, factor, omega, stop, middle, here)
            noise = CONTACT_ROUNDOFF * (here[7] * cosine + abs(sine) * (1.0 + omega * middle))
            value = here[0] * cosine - here[3] * sine
            slope = here[1] * cosine - here[4] * sine
            second_derivative = here[2] * cosine - here[5] * sine
            steepest = second_derivative + radius * third
            if value + radius * (abs(slope) + 0.5 * radius * max(steepest, 0.0)) < -noise:
                continue

            point = middle
            if value > noise:
                pass
            elif abs(slope) > radius * (abs(second_derivative) + radius * third):
                if (slope < 0.0 and at_start) or (slope > 0.0 and at_end):
                    continue
                point = right if slope > 0.0 else left
            elif steepest < 0.0:
                if first_slope <= (first_noise if at_start else 0.0):
                    if at_start:
                        continue
                    point = left
                else:
                    low, high = left, right
                    for _ in range(_NEWTON_STEPS):
                        if slope > 0.0:
                            low = point
                        else:
                            high = point
                        following = point - slope / second_derivative
                        if not low <= following <= high:
                            following = 0.5 * (low + high)
                        if abs(following - point) <= 4.0 * EPSILON * end:
                            break
                        point = following
                        _distance(
                            decay, discriminant, frequency_squared, state, level, factor, omega, stop, point, here
                        )
                        slope = here[1] * cosine - here[4] * sine
                        second_derivative = here[2] * cosine - here[5] * sine
                    if at_end and right - point <= 64.0 * EPSILON * end:
                        continue
            elif right - left > LEAST_CONTACT_CELL * end:
                if top + 2 > _STACK:
                    return sine, cosine, time, TOO_MANY_CELLS
                stack[top, 0], stack[top, 1] = middle, right
                stack[top + 1, 0], stack[top + 1, 1] = left, middle
                top += 2
                continue
            else:
                continue

            _distance(decay, discriminant, frequency_squared, state, level, factor, omega, stop, point, here)
            noise = CONTACT_ROUNDOFF * (here[7] * cosine + abs(sine) * (1.0 + omega * point))
            if here[0] * cosine - here[3] * sine > noise:
                # a larger angle: the cell is looked at once more with it
                length = math.hypot(here[0], here[3])
                sine, cosine, time = here[0] / length, here[3] / length, point
                stack[top, 0], stack[top, 1] = left, right
                top += 1
    return sine, cosine, time, FOUND


@njit(cache=True, nogil=True, error_model="numpy")
def contact_margin(
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    state: Floats,
    level: float,
    omega: float,
    half_periods: int,
) -> tuple[float, int]:
    """Return by how much orbits of vanishing impact speed miss the stops between their impacts, and what that means.

    The least of ``(-1)^j G(j T/2) - H`` over the returns j between two impacts, over the terms of G(0); infinity when
    there is no such return. The second value is FOUND where all are positive, UNDECIDED or NEVER.
    """
    here = np.empty(10)
    margin, verdict = math.inf, FOUND
    terms = abs(level)
    for j in range(decay.size):
        terms += abs(state[j, 0]) + abs(state[j, 1]) / math.sqrt(frequency_squared[j])
    for m in range(1, half_periods):
        stop = 1 if m % 2 == 0 else -1
        t = m * (math.pi / omega)
        _distance(decay, discriminant, frequency_squared, state, level, 1.0, omega, stop, t, here)
        margin = min(margin, -here[8] / terms)
        verdict = max(verdict, _verdict(here[8], here[9]))
    return margin, verdict
