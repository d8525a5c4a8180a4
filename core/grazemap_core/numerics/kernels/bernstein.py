"""First contact of a polynomial with a stop, certified in the Bernstein basis.

What flows in: the Taylor coefficients of the distance to a stop over one step, scaled to t in [0, 1], and a bound on
everything that was rounded or cut off. What flows out: the first t at which the distance turns negative, or the
certificate that it stays positive. No root is skipped: on every piece of [0, 1] the Bernstein coefficients bound the
polynomial (convex hull), and a piece whose coefficients change sign once has exactly one root (Descartes' rule).

References
----------
R. T. Farouki, "The Bernstein polynomial basis: a centennial retrospective", CAGD 29 (2012) 379-419.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE

CLEAR = 0
"""The distance stays positive on the whole step."""
CONTACT = 1
"""The distance turns negative at the returned t."""
GRAZE_UNDECIDED = 2
"""No contact was certain, but somewhere the distance is zero to within the error: the stop may be touched or passed at
a speed that is zero to within round-off."""

MAX_DEPTH = 60
SHORT_DEPTH = 6
"""Halvings after which a search on the first terms alone is given up: the whole series decides faster."""
STACK_SHAPE = (MAX_DEPTH + 2, TAYLOR_DEGREE + 1)

_binomial = np.ones((TAYLOR_DEGREE + 1, TAYLOR_DEGREE + 1))
for _n in range(2, TAYLOR_DEGREE + 1):
    for _k in range(1, _n):
        _binomial[_n, _k] = _binomial[_n - 1, _k - 1] + _binomial[_n - 1, _k]
INVERSE_BINOMIAL = 1.0 / _binomial
"""1 / C(n, k) for k <= n."""


@kernel
def to_bernstein(taylor: Floats, degree: int, out: Floats) -> None:
    """Write the Bernstein coefficients on [0, 1] of sum_k taylor[k] t^k, k <= degree, into out[0 .. degree]."""
    for k in range(degree + 1):
        out[k] = taylor[k] * INVERSE_BINOMIAL[degree, k]
    for j in range(degree):
        for i in range(degree, j, -1):
            out[i] += out[i - 1]


@kernel
def _split(piece: Floats, degree: int, right: Floats) -> None:
    """Halve a piece by de Casteljau: the left half replaces it, the right half goes to `right`."""
    right[degree] = piece[degree]
    for level in range(1, degree + 1):
        for i in range(degree, level - 1, -1):
            piece[i] = 0.5 * (piece[i] + piece[i - 1])
        right[degree - level] = piece[degree]


@kernel
def _value_and_slope(taylor: Floats, degree: int, t: float) -> tuple[float, float]:
    value = taylor[degree]
    slope = 0.0
    for k in range(degree - 1, -1, -1):
        slope = slope * t + value
        value = value * t + taylor[k]
    return value, slope


@kernel
def _polished_root(taylor: Floats, degree: int, low: float, high: float, guess: float) -> float:
    """Return the one root in [low, high] (positive at low, negative at high): Newton kept inside the bracket."""
    t = guess
    for _ in range(100):
        value, slope = _value_and_slope(taylor, degree, t)
        if value < 0.0:
            high = t
        elif value > 0.0:
            low = t
        else:
            return t
        new = t - value / slope if slope != 0.0 else low
        if not (low < new < high):
            new = 0.5 * (low + high)
        if new == t or abs(new - t) <= 1.2e-16 * new:
            return new
        t = new
    return t


@kernel
def _stepped_root(taylor: Floats, degree: int, low: float, width: float) -> float:
    """Return the root next to `low`, where the distance is zero to within round-off and falling."""
    t = low
    for _ in range(3):
        value, slope = _value_and_slope(taylor, degree, t)
        if slope >= 0.0:
            return low
        t = min(max(t - value / slope, max(low - width, 0.0)), low + width)
    return t


@kernel
def _arrives(taylor: Floats, degree: int, error: float) -> bool:
    """Say whether a distance that is zero to within `error` at t = 1 falls too fast there to be a graze.

    Then the series from there on begins on the stop and goes out: a contact of the next step.
    """
    _, slope = _value_and_slope(taylor, degree, 1.0)
    second_derivative = 0.0
    for k in range(2, degree + 1):
        second_derivative += k * (k - 1) * abs(taylor[k])
    # at a graze the distance grows to a few errors with the bend alone, and its slope to the root of their product
    arrives: bool = slope < 0.0 and slope * slope > 64.0 * error * second_derivative
    return arrives


@kernel
def _unsure_between(piece: Floats, error: float, low: int, high: int, degree: int) -> bool:
    """Say whether all unsure coefficients lie between `low` and `high`.

    One of them cannot add a sign change there. More of them could, but only by zeros at which the distance stays within
    round-off of zero, and those count as no contact anyway.
    """
    unsure_outside = 0
    for i in range(degree + 1):
        if abs(piece[i]) <= error and not (low < i < high):
            unsure_outside += 1
    return unsure_outside == 0


@kernel
def first_negative(
    taylor: Floats,
    degree: int,
    short: int,
    error: float,
    stack: Floats,
    start: Floats,
    width: Floats,
) -> tuple[int, float]:
    """Return (status, t) of the first sign change from positive to negative on [0, 1].

    The search may be made on the first terms of the series alone, what they leave out being part of `error`. It is as
    rigorous, because it then decides on sure coefficients only: raising the degree keeps "all positive" and "positive,
    then negative", and adding what was left out moves no coefficient by more than `error`. It is cheaper, and
    undecided more often.

    Parameters
    ----------
    taylor : (degree + 1,) coefficients of the distance in t; positive, or zero to round-off, at t = 0.
    degree : of the series.
    short : degree searched at; `degree` itself, or a smaller one.
    error : bound on the rounding and truncation in any Bernstein coefficient.
    stack, start, width : scratch of shapes STACK_SHAPE, (MAX_DEPTH + 2,), (MAX_DEPTH + 2,); overwritten.

    Returns
    -------
    status : CLEAR, CONTACT or GRAZE_UNDECIDED. t is where the contact is, or the first place that was left undecided;
        with GRAZE_UNDECIDED of a short search it means nothing.
    """
    to_bernstein(taylor, short, stack[0])
    start[0] = 0.0
    width[0] = 1.0
    top = 0
    undecided = -1.0
    whole = short == degree
    while top >= 0:
        piece = stack[top]
        largest = 0.0
        first_positive = short + 1
        last_positive = -1
        first_negative_at = short + 1
        last_negative = -1
        last_unsure = -1
        for i in range(short + 1):
            value = piece[i]
            largest = max(largest, abs(value))
            if value > error:
                last_positive = i
                first_positive = min(first_positive, i)
            elif value < -error:
                last_negative = i
                first_negative_at = min(first_negative_at, i)
            else:
                last_unsure = i
        if last_negative < 0 and last_unsure < 0:
            top -= 1  # positive
            continue
        if whole and last_negative < 0 and last_positive >= 0 and last_unsure < first_positive:
            top -= 1  # positive but for unsure values at the very start: the stop that was just left
            continue
        if whole and last_positive < 0 and last_negative >= 0 and last_unsure < first_negative_at:
            # at the stop to within round-off, and going out
            return CONTACT, _stepped_root(taylor, degree, start[top], width[top])
        if (
            first_positive == 0
            and last_negative == short
            and last_positive < first_negative_at
            and (last_unsure < 0 or (whole and _unsure_between(piece, error, last_positive, first_negative_at, short)))
        ):
            # the guess is where the control polygon crosses zero
            fall = piece[last_positive] - piece[first_negative_at]
            place = last_positive + (first_negative_at - last_positive) * piece[last_positive] / fall
            low, high = start[top], start[top] + width[top]
            return CONTACT, _polished_root(taylor, degree, low, high, low + width[top] * place / short)
        if not whole and top >= SHORT_DEPTH:
            return GRAZE_UNDECIDED, 1.0
        if largest <= 4.0 * error or top >= MAX_DEPTH or width[top] <= 1e-15:
            ends = start[top] + width[top] >= 1.0
            if undecided < 0.0 and not (ends and _arrives(taylor, degree, error)):
                undecided = start[top] + 0.5 * width[top]
            top -= 1
            continue
        _split(piece, short, stack[top + 1])
        half = 0.5 * width[top]
        # the right half waits below, the left half is looked at first
        for i in range(short + 1):
            left = piece[i]
            piece[i] = stack[top + 1, i]
            stack[top + 1, i] = left
        start[top + 1] = start[top]
        width[top + 1] = half
        start[top] += half
        width[top] = half
        top += 1
    return (GRAZE_UNDECIDED, undecided) if undecided >= 0.0 else (CLEAR, 1.0)
