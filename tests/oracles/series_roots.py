"""The first zero of a Taylor series in multi-precision arithmetic, decided by signs of its values.

A series is cut into pieces on which its slope or its curvature provably keeps its sign: there it has one zero, or one
lowest value between two positive ones, whose sign decides. Nothing is imported from the core.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flint import arb, arb_poly

SLACK = 1e-12
"""Relative margin of sums in double precision."""

GUARD = 8
"""Digits below the noise at which a value counts as zero."""

SHORTEST = 1e-30
"""Relative length of a piece at which the search gives up."""


def power_of_ten(exponent: int) -> arb:
    """Return 10^exponent."""
    return (arb(10) ** exponent).mid()


class Undecided(ArithmeticError):
    """A sign depends on a number that is not larger than its own rounding."""


class Precision(NamedTuple):
    """Wanted digits, and the size of a value of the series below which its sign means nothing.

    The size is no float: of more than 300 digits it would be 0.
    """

    digits: int
    noise: arb


def first_fall(series: list[arb], length: float, precision: Precision) -> arb | None:
    """Return the first zero in [0, length] of a series that is positive at 0, or None.

    Raises Undecided where the series touches zero.
    """
    at, whole = arb(0), length
    while True:
        terms = np.array([float(c) for c in series]) * length ** np.arange(len(series))
        sizes = np.abs(terms)
        if terms[0] > (1.0 + SLACK) * sizes[1:].sum():
            return None
        order = np.arange(len(terms))
        steep = sizes[1] > (1.0 + SLACK) * (order * sizes)[2:].sum()
        bent = 2.0 * sizes[2] > (1.0 + SLACK) * (order * (order - 1) * sizes)[3:].sum()
        if steep or bent:
            zero = _zero_of_piece(series, terms, length, precision, bent=bent)
            return None if zero is None else (at + zero).mid()
        if length < SHORTEST * whole:
            raise Undecided("the zeros of the series are not separated by these digits")
        length /= 2
        before = first_fall(series, length, precision)
        if before is not None:
            return (at + before).mid()
        at = at + arb(length)
        series = [c.mid() for c in arb_poly(series)(arb_poly([arb(length), arb(1)]))]


def _zero_of_piece(
    series: list[arb], terms: np.ndarray, length: float, precision: Precision, *, bent: bool
) -> arb | None:
    """Return the first zero of a piece that is monotonic, or whose curvature keeps its sign."""
    polynomial = arb_poly(series)
    slope = polynomial.derivative()
    end = arb(length)
    if polynomial(end).mid() < 0:
        return cross(polynomial, slope, (arb(0), end), arb(length * _guess(terms)), precision)
    if not (bent and series[2] > 0 and series[1] < 0 and slope(end).mid() > 0):
        return None
    # between two positive values the piece has one lowest point
    start = arb(float(min(1.0, -0.5 * terms[1] / terms[2])) * length)
    sizes = np.abs(terms)
    of_slope = Precision(precision.digits, precision.noise / length)
    lowest = cross(-slope, -slope.derivative(), (arb(0), end), start, of_slope)
    value = polynomial(lowest).mid()
    if abs(value) < precision.noise + float(sizes.sum()) * power_of_ten(-precision.digits - GUARD):
        raise Undecided("a lowest value is not larger than its rounding")
    if value > 0:
        return None
    depth = float(-value)
    width = (2.0 * depth / float(slope.derivative()(lowest))) ** 0.5
    return cross(polynomial, slope, (arb(0), lowest), (lowest - arb(width)).mid(), precision)


def _guess(terms: np.ndarray) -> float:
    """Return where the first three terms vanish, as a share of the piece; its middle if they do not."""
    inside = terms[1] ** 2 - 4.0 * terms[0] * terms[2]
    if inside >= 0.0:
        divisor = -terms[1] + np.sqrt(inside)
        if divisor > 0.0 and 0.0 <= 2.0 * terms[0] <= divisor:
            return float(2.0 * terms[0] / divisor)
    return 0.5


def cross(polynomial: arb_poly, slope: arb_poly, bounds: tuple[arb, arb], start: arb, precision: Precision) -> arb:
    """Return the zero in the bounds at which a polynomial falls from positive to negative, by Newton's method."""
    low, high = bounds
    t, small = start, power_of_ten(-precision.digits)
    zero = precision.noise * power_of_ten(-GUARD)
    for _ in range(600):
        value = polynomial(t).mid()
        if abs(value) <= zero:
            return t
        low, high = (low, t) if value < 0 else (t, high)
        steep = slope(t).mid()
        new = (t - value / steep).mid() if steep < 0 else low
        if not (low < new and new < high):
            new = ((low + high) / 2).mid()
        if abs(new - t) <= small * abs(new):
            return new
        t = new
    raise AssertionError("the root search did not converge")
