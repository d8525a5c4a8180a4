"""First contact of a polynomial with a stop, isolated in the Bernstein basis.

`first_negative` takes the Taylor coefficients of the distance to a stop over one step, scaled to t in [0, 1], and a
bound on their rounding and truncation errors. It returns the first t at which the distance becomes negative, or that
the distance stays positive. No root is missed: on every piece of [0, 1] the Bernstein coefficients bound the
polynomial (convex hull), and a piece whose coefficients change sign once has exactly one root (Descartes' rule).

References
----------
R. T. Farouki, "The Bernstein polynomial basis: a centennial retrospective", CAGD 29 (2012) 379-419.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics import tolerances
from grazemap_core.numerics.jit.compiled import kernel

STAYS_POSITIVE = 0
"""The distance stays positive on the whole step."""
BECOMES_NEGATIVE = 1
"""The distance becomes negative at the returned t."""
GRAZE_UNDECIDED = 2
"""No contact is certain, but somewhere the distance is zero to within its error: the stop may be touched or passed at a
speed that is zero to within round-off."""

STACK_SHAPE = (tolerances.MAX_DEPTH + 2, tolerances.TAYLOR_DEGREE + 1)
"""Shape of the stack of pieces that `first_negative` takes."""

_binomial = np.ones((tolerances.TAYLOR_DEGREE + 1, tolerances.TAYLOR_DEGREE + 1))
for _n in range(2, tolerances.TAYLOR_DEGREE + 1):
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
def value_and_slope(taylor: Floats, degree: int, t: float) -> tuple[float, float]:
    """Return the polynomial and its derivative at t."""
    value = taylor[degree]
    slope = 0.0
    for k in range(degree - 1, -1, -1):
        slope = slope * t + value
        value = value * t + taylor[k]
    return value, slope


@kernel
def _polished_root(taylor: Floats, degree: int, low: float, high: float, guess: float) -> float:
    """Return the one root in [low, high] (positive at low, negative at high), by safeguarded Newton steps."""
    t = guess
    for _ in range(tolerances.ROOT_STEPS):
        value, slope = value_and_slope(taylor, degree, t)
        if value < 0.0:
            high = t
        elif value > 0.0:
            low = t
        else:
            return t
        new = t - value / slope if slope != 0.0 else low
        if not (low < new < high):
            new = 0.5 * (low + high)
        if new == t or abs(new - t) <= tolerances.ROOT_WIDTH * new:
            return new
        t = new
    return t


@kernel
def _stepped_root(taylor: Floats, degree: int, low: float, width: float) -> float:
    """Return the root next to `low`, where the distance is zero to within round-off and falling."""
    t = low
    for _ in range(tolerances.START_STEPS):
        value, slope = value_and_slope(taylor, degree, t)
        if slope >= 0.0:
            return low
        t = min(max(t - value / slope, max(low - width, 0.0)), low + width)
    return t


@kernel
def _arrives(taylor: Floats, degree: int, error: float) -> bool:
    """Return whether a distance that is zero to within `error` at t = 1 decreases too fast there to be a graze.

    If so, the next step starts on the stop and moves beyond it: the contact is found there.
    """
    _, slope = value_and_slope(taylor, degree, 1.0)
    second_derivative = 0.0
    for k in range(2, degree + 1):
        second_derivative += k * (k - 1) * abs(taylor[k])
    # at a graze the distance is a few errors, so its slope squared is a few times error times second derivative
    arrives: bool = slope < 0.0 and slope * slope > tolerances.GRAZE_SLOPE * error * second_derivative
    return arrives


@kernel
def _unsure_between(piece: Floats, error: float, low: int, high: int, degree: int) -> bool:
    """Return whether all coefficients of unknown sign lie between `low` and `high`.

    One such coefficient cannot add a sign change there. Several could, but only by zeros at which the distance stays
    within round-off of zero, and those do not count as contacts.
    """
    unsure_outside = 0
    for i in range(degree + 1):
        if abs(piece[i]) <= error and not (low < i < high):
            unsure_outside += 1
    return unsure_outside == 0


@kernel
def _signs(piece: Floats, degree: int, error: float) -> tuple[float, int, int, int, int, int]:
    """Return the largest modulus, and where coefficients are certainly positive or negative, or of unknown sign.

    Returns
    -------
    largest : float
    first_positive, last_positive, first_negative, last_negative, last_unsure : int
        Index of the first, `degree` + 1 if there is none, or of the last, -1 if there is none.
    """
    largest = 0.0
    first_positive = degree + 1
    last_positive = -1
    first_negative_at = degree + 1
    last_negative = -1
    last_unsure = -1
    for i in range(degree + 1):
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
    return largest, first_positive, last_positive, first_negative_at, last_negative, last_unsure


@kernel
def _halve(stack: Floats, start: Floats, width: Floats, top: int, degree: int) -> None:
    """Replace the piece at `top` by its right half and push its left half, which is searched first, onto the stack."""
    piece = stack[top]
    _split(piece, degree, stack[top + 1])
    half = 0.5 * width[top]
    for i in range(degree + 1):
        left = piece[i]
        piece[i] = stack[top + 1, i]
        stack[top + 1, i] = left
    start[top + 1] = start[top]
    width[top + 1] = half
    start[top] += half
    width[top] = half


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

    The search may use only the first terms of the series, if `error` includes the omitted ones. Such a short search is
    equally rigorous, because it decides only from coefficients of known sign: raising the degree preserves "all
    positive" and "positive, then negative", and the omitted terms change no coefficient by more than `error`. It is
    cheaper, but undecided more often.

    Parameters
    ----------
    taylor : (degree + 1,) coefficients of the distance in t; positive, or zero to round-off, at t = 0.
    degree : of the series.
    short : degree of the polynomial that is searched, at most `degree`.
    error : bound on the rounding and truncation in any Bernstein coefficient.
    stack, start, width : scratch of shapes STACK_SHAPE, (STACK_SHAPE[0],), (STACK_SHAPE[0],); overwritten.

    Returns
    -------
    status : STAYS_POSITIVE, BECOMES_NEGATIVE or GRAZE_UNDECIDED.
    t : the contact, or the first undecided point; not defined if a short search is undecided.
    """
    to_bernstein(taylor, short, stack[0])
    start[0] = 0.0
    width[0] = 1.0
    top = 0
    undecided = -1.0
    whole = short == degree
    while top >= 0:
        piece = stack[top]
        largest, first_positive, last_positive, first_negative_at, last_negative, last_unsure = _signs(
            piece, short, error
        )
        if last_negative < 0 and last_unsure < 0:
            top -= 1  # positive
            continue
        if whole and last_negative < 0 and last_positive >= 0 and last_unsure < first_positive:
            top -= 1  # positive except at the start, which is on the stop that was just left
            continue
        if whole and last_positive < 0 and last_negative >= 0 and last_unsure < first_negative_at:
            # on the stop to within round-off, and moving beyond it
            return BECOMES_NEGATIVE, _stepped_root(taylor, degree, start[top], width[top])
        if (
            first_positive == 0
            and last_negative == short
            and last_positive < first_negative_at
            and (last_unsure < 0 or (whole and _unsure_between(piece, error, last_positive, first_negative_at, short)))
        ):
            # the guess is where the control polygon crosses zero
            fall = piece[last_positive] - piece[first_negative_at]
            crossing = last_positive + (first_negative_at - last_positive) * piece[last_positive] / fall
            low, high = start[top], start[top] + width[top]
            return BECOMES_NEGATIVE, _polished_root(taylor, degree, low, high, low + width[top] * crossing / short)
        too_short = top >= tolerances.MAX_DEPTH or width[top] <= tolerances.MIN_WIDTH
        unresolved = too_short or largest <= tolerances.UNDECIDED_ERRORS * error
        if not whole and (unresolved or top >= tolerances.SHORT_DEPTH):
            return GRAZE_UNDECIDED, 1.0  # even at the end, as the omitted terms are far larger than round-off
        if unresolved:
            ends = start[top] + width[top] >= 1.0
            if undecided < 0.0 and not (ends and _arrives(taylor, degree, error)):
                undecided = start[top] + 0.5 * width[top]
            top -= 1
            continue
        _halve(stack, start, width, top, short)
        top += 1
    return (GRAZE_UNDECIDED, undecided) if undecided >= 0.0 else (STAYS_POSITIVE, 1.0)
