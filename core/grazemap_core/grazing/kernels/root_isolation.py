"""Every zero of an impulse response or periodic sum on an interval: isolated with a guarantee, then found to round-off.

An interval flows in, zeros with their uncertainty and a status flow out. Intervals are halved until one of these holds,
with c the middle, r the radius and B a bound on ``|f''|`` over the interval:

- ``|f(c)| > r |f'(c)| + r^2 B/2`` + round-off: no zero;
- ``|f'(c)| > r B`` + round-off: f is monotone, and the signs at the ends say whether there is one zero;
- the interval is relatively shorter than NEAR_DOUBLE_WIDTH: f and f' vanish together to round-off, and
  neighbouring intervals of that kind are reported as one near-double zero. Nothing is dropped.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers
from grazemap_core.grazing.tolerances import MAX_CELLS, NEAR_DOUBLE_WIDTH
from grazemap_core.model.kernels.response_sums import curvature_bound, response_at
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.tolerances import EPSILON

SIMPLE = 0
"""One zero, where the derivative is bounded away from zero."""
NEAR_DOUBLE = 1
"""Two zeros too close to tell apart, or a minimum of the modulus that round-off cannot tell from zero."""

COMPLETE = 0
"""Every zero of the interval is in the list."""
TOO_MANY_CELLS = 1
"""MAX_CELLS were not enough; the list is not complete."""

_STACK = 256
_POLISHING_STEPS = 100


@njit(cache=True, nogil=True, error_model="numpy")
def _polish(
    kind: int,
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    value: Floats,
    slope: Floats,
    shift: float,
    left: float,
    right: float,
    left_value: float,
) -> tuple[float, float]:
    """Return the zero between `left` and `right` and the slope there: Newton's method, kept inside by bisection."""
    point = 0.5 * (left + right)
    derivative = 0.0
    for _ in range(_POLISHING_STEPS):
        function, derivative, _, _ = response_at(
            kind, decay, discriminant, frequency_squared, value, slope, shift, point
        )
        if function == 0.0:
            break
        if (function > 0.0) == (left_value > 0.0):
            left = point
        else:
            right = point
        following = point - function / derivative
        if not left <= following <= right:
            following = 0.5 * (left + right)
        if abs(following - point) <= EPSILON * point:
            point = following
            break
        point = following
    return point, derivative


@njit(cache=True, nogil=True, error_model="numpy")
def isolate(
    kind: int,
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    value: Floats,
    slope: Floats,
    conditioning: float,
    shift: float,
    start: float,
    stop: float,
) -> tuple[Floats, Integers, int]:
    """Return all zeros on ``[start, stop]``, increasing.

    Parameters
    ----------
    kind : int
        IMPULSE, SAME_SIGN or ALTERNATING, from `response_sums`.
    decay, discriminant, frequency_squared, value, slope : ndarray of shape (N,)
    conditioning, shift : float
        As for `response_sums.response_at`; the shift is the slowest decay rate.
    start, stop : float
        0 < start < stop.

    Returns
    -------
    zeros : ndarray of shape (n, 2)
        Zero, and how far round-off may have moved it (for a near-double one, half the width of the undecided interval).
    kinds : ndarray of int, shape (n,)
        SIMPLE or NEAR_DOUBLE.
    status : int
        COMPLETE or TOO_MANY_CELLS.
    """
    noise = RESPONSE_ROUNDOFF * conditioning
    stack = np.empty((_STACK, 2))
    stack[0, 0], stack[0, 1] = start, stop
    top = 1
    zeros = np.empty((64, 2))
    kinds = np.empty(64, dtype=np.int64)
    found = 0
    status = COMPLETE
    cells = 0
    previous_at_end = False
    while top > 0:
        cells += 1
        if cells > MAX_CELLS:
            status = TOO_MANY_CELLS
            break
        top -= 1
        left, right = stack[top, 0], stack[top, 1]
        middle = 0.5 * (left + right)
        radius = 0.5 * (right - left) * (1.0 + 4.0 * EPSILON)
        function, derivative, terms, derivative_terms = response_at(
            kind, decay, discriminant, frequency_squared, value, slope, shift, middle
        )
        bound = curvature_bound(kind, decay, discriminant, frequency_squared, value, slope, shift, middle, radius)
        if not bound >= 0.0:
            bound = math.inf
        error = noise * (terms + middle * derivative_terms)
        if abs(function) > error + radius * (abs(derivative) + 0.5 * radius * bound):
            continue

        at_end = False
        if abs(derivative) > radius * bound + noise * (derivative_terms + middle * bound):
            what = SIMPLE
            zero, uncertainty, values = math.nan, 0.0, (0.0, 0.0)
            for side in range(2):
                end = right if side == 1 else left
                end_value, end_slope, end_terms, end_slope_terms = response_at(
                    kind, decay, discriminant, frequency_squared, value, slope, shift, end
                )
                end_error = noise * (end_terms + end * end_slope_terms)
                values = (values[1], end_value)
                if abs(end_value) <= end_error and not at_end:
                    at_end = True
                    zero = end - end_value / end_slope
                    uncertainty = end_error / abs(end_slope)
            if not at_end:
                if (values[0] > 0.0) == (values[1] > 0.0):
                    continue
                zero, steepness = _polish(
                    kind, decay, discriminant, frequency_squared, value, slope, shift, left, right, values[0]
                )
                uncertainty = min(2.0 * radius, error * math.exp(shift * (zero - middle)) / abs(steepness))
        elif right - left <= NEAR_DOUBLE_WIDTH * middle:
            zero, uncertainty, what = middle, 0.5 * (right - left), NEAR_DOUBLE
        elif top + 2 > _STACK:
            status = TOO_MANY_CELLS
            break
        else:
            stack[top, 0], stack[top, 1] = middle, right
            stack[top + 1, 0], stack[top + 1, 1] = left, middle
            top += 2
            continue

        overlaps = found > 0 and zero - uncertainty <= zeros[found - 1, 0] + 2.0 * zeros[found - 1, 1]
        double = what == NEAR_DOUBLE or (found > 0 and kinds[found - 1] == NEAR_DOUBLE)
        if overlaps and (double or at_end or previous_at_end):
            # the same zero as in the cell before: a simple one at the common end, or an undecided stretch goes on;
            # two zeros that were each bracketed are two, however close
            before = zeros[found - 1]
            if double:
                lowest = before[0] - before[1]
                highest = zero + uncertainty
                before[0], before[1] = 0.5 * (lowest + highest), 0.5 * (highest - lowest)
                kinds[found - 1] = NEAR_DOUBLE
            continue
        if found == kinds.size:
            zeros = np.concatenate((zeros, np.empty_like(zeros)))
            kinds = np.concatenate((kinds, np.empty_like(kinds)))
        zeros[found, 0], zeros[found, 1] = zero, uncertainty
        kinds[found] = what
        found += 1
        previous_at_end = at_end
    return zeros[:found].copy(), kinds[:found].copy(), status
