"""All zeros of an impulse response or periodic sum on an interval, isolated rigorously and computed to round-off.

Intervals are halved until one of these conditions holds, with c the middle, r the radius and B a bound of ``|f''|``
over the interval:

- ``|f(c)| > r |f'(c)| + r^2 B/2`` + round-off: no zero;
- ``|f'(c)| > r B`` + round-off: f is monotone, and the signs at the ends decide whether there is one zero;
- the relative width of the interval is below NEAR_DOUBLE_WIDTH: f and f' vanish together to round-off. Adjacent
  intervals of this kind are reported as one near-double zero.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats, Integers
from grazemap_core.grazing.tolerances import CELL_ROUNDING, ISOLATION_STACK, MAX_CELLS, NEAR_DOUBLE_WIDTH
from grazemap_core.model.kernels.response_sums import ResponseBlocks, curvature_bound, response_at
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.tolerances import ROOT_STEPS
from grazemap_core.tolerances import EPSILON

SIMPLE = 0
"""One zero, at which the derivative is bounded away from zero."""
NEAR_DOUBLE = 1
"""Two zeros that are too close to be resolved, or a minimum of the modulus that is zero to within round-off."""

_NONE = 2
"""No zero in a cell."""
_UNDECIDED = 3
"""The bounds do not decide whether a cell has a zero."""

COMPLETE = 0
"""Every zero of the interval is in the list."""
TOO_MANY_CELLS = 1
"""More than MAX_CELLS are needed; the list is not complete."""


@kernel
def _polish(
    kind: int, blocks: ResponseBlocks, shift: float, left: float, right: float, left_value: float
) -> tuple[float, float]:
    """Return the zero between `left` and `right` and the derivative there, by safeguarded Newton steps."""
    point = 0.5 * (left + right)
    derivative = 0.0
    for _ in range(ROOT_STEPS):
        function, derivative, _, _ = response_at(kind, blocks, shift, point)
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


@kernel
def _zero_of_monotone(
    kind: int, blocks: ResponseBlocks, noise: float, shift: float, left: float, right: float
) -> tuple[float, float, bool, float]:
    """Return the zero of a monotone function between `left` and `right`, NaN if there is none.

    Returns
    -------
    zero, uncertainty : float
        The uncertainty is that of a zero at an end; it is 0 otherwise.
    at_end : bool
        Whether the zero is at an end, to within round-off.
    steepness : float
        Derivative at a zero that is not at an end.
    """
    zero, uncertainty, at_end = math.nan, 0.0, False
    left_value, right_value = 0.0, 0.0
    for side in range(2):
        end = right if side == 1 else left
        value, slope, terms, slope_terms = response_at(kind, blocks, shift, end)
        error = noise * (terms + end * slope_terms)
        left_value, right_value = right_value, value
        if abs(value) <= error and not at_end:
            at_end = True
            zero = end - value / slope
            uncertainty = error / abs(slope)
    if at_end or (left_value > 0.0) == (right_value > 0.0):
        return zero, uncertainty, at_end, 0.0
    zero, steepness = _polish(kind, blocks, shift, left, right, left_value)
    return zero, uncertainty, at_end, steepness


@kernel
def _zero_in_cell(
    kind: int, blocks: ResponseBlocks, noise: float, shift: float, left: float, right: float
) -> tuple[int, float, float, bool]:
    """Return the zero between `left` and `right` if bounds decide whether there is one.

    Returns
    -------
    what : SIMPLE, NEAR_DOUBLE, _NONE or _UNDECIDED.
    zero, uncertainty : float
    at_end : bool
        Whether the zero is at an end, to within round-off.
    """
    middle = 0.5 * (left + right)
    radius = 0.5 * (right - left) * CELL_ROUNDING
    function, derivative, terms, derivative_terms = response_at(kind, blocks, shift, middle)
    bound = curvature_bound(kind, blocks, shift, middle, radius)
    if not bound >= 0.0:
        bound = math.inf
    error = noise * (terms + middle * derivative_terms)
    if abs(function) > error + radius * (abs(derivative) + 0.5 * radius * bound):
        return _NONE, math.nan, 0.0, False
    if abs(derivative) > radius * bound + noise * (derivative_terms + middle * bound):
        zero, uncertainty, at_end, steepness = _zero_of_monotone(kind, blocks, noise, shift, left, right)
        if not at_end:
            if math.isnan(zero):
                return _NONE, math.nan, 0.0, False
            uncertainty = min(2.0 * radius, error * math.exp(shift * (zero - middle)) / abs(steepness))
        return SIMPLE, zero, uncertainty, at_end
    if right - left <= NEAR_DOUBLE_WIDTH * middle:
        return NEAR_DOUBLE, middle, 0.5 * (right - left), False
    return _UNDECIDED, math.nan, 0.0, False


@kernel
def _merge(last: Floats, zero: float, uncertainty: float) -> None:
    """Extend a near-double zero, `last` of shape (2,), by an overlapping one, in place."""
    lowest = last[0] - last[1]
    highest = zero + uncertainty
    last[0], last[1] = 0.5 * (lowest + highest), 0.5 * (highest - lowest)


@njit(cache=True, nogil=True, error_model="numpy")
def isolate(
    kind: int, blocks: ResponseBlocks, conditioning: float, shift: float, start: float, stop: float
) -> tuple[Floats, Integers, int]:
    """Return all zeros on ``[start, stop]``, increasing.

    Parameters
    ----------
    kind : int
        IMPULSE, SAME_SIGN or ALTERNATING, from `response_sums`.
    blocks : ResponseBlocks
    conditioning, shift : float
        Condition number of the modal model, and slowest decay rate.
    start, stop : float
        0 < start < stop.

    Returns
    -------
    zeros : ndarray of shape (n, 2)
        Zero and its uncertainty by round-off (for a near-double one, half the width of the undecided interval).
    kinds : ndarray of int, shape (n,)
        SIMPLE or NEAR_DOUBLE.
    status : int
        COMPLETE or TOO_MANY_CELLS.
    """
    noise = RESPONSE_ROUNDOFF * conditioning
    stack = np.empty((ISOLATION_STACK, 2))
    stack[0, 0], stack[0, 1] = start, stop
    top = 1
    zeros = np.empty((64, 2))
    kinds = np.empty(64, dtype=np.int64)
    count = 0
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
        what, zero, uncertainty, at_end = _zero_in_cell(kind, blocks, noise, shift, left, right)
        if what == _NONE:
            continue
        if what == _UNDECIDED:
            if top + 2 > ISOLATION_STACK:
                status = TOO_MANY_CELLS
                break
            stack[top, 0], stack[top, 1] = middle, right
            stack[top + 1, 0], stack[top + 1, 1] = left, middle
            top += 2
            continue

        overlaps = count > 0 and zero - uncertainty <= zeros[count - 1, 0] + 2.0 * zeros[count - 1, 1]
        double = what == NEAR_DOUBLE or (count > 0 and kinds[count - 1] == NEAR_DOUBLE)
        if overlaps and (double or at_end or previous_at_end):
            # the same zero as in the previous cell: a simple one at the common end, or a continued undecided interval;
            # two zeros that were each bracketed are two, however close
            if double:
                _merge(zeros[count - 1], zero, uncertainty)
                kinds[count - 1] = NEAR_DOUBLE
            continue
        if count == kinds.size:
            zeros = np.concatenate((zeros, np.empty_like(zeros)))
            kinds = np.concatenate((kinds, np.empty_like(kinds)))
        zeros[count, 0], zeros[count, 1] = zero, uncertainty
        kinds[count] = what
        count += 1
        previous_at_end = at_end
    return zeros[:count].copy(), kinds[:count].copy(), status
