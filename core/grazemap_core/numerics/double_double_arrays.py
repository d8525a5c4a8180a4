"""Arithmetic with unevaluated sums of two doubles on arrays: about 32 digits, element by element.

As `grazemap_core.numerics.kernels.double_double`, for code that is not compiled.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import SPLITTER


class Pair(NamedTuple):
    """The sum ``high + low`` of two arrays of one shape, ``|low| <= ulp(high)/2``."""

    high: Floats
    low: Floats

    @property
    def rounded(self) -> Floats:
        """The nearest doubles."""
        return self.high + self.low


def exact(values: Floats) -> Pair:
    """Return doubles as pairs."""
    return Pair(values, np.zeros_like(values))


def total(a: Floats, b: Floats) -> Pair:
    """Return ``a + b`` exactly."""
    high = a + b
    virtual = high - a
    return Pair(high, (a - (high - virtual)) + (b - virtual))


def product(a: Floats, b: Floats) -> Pair:
    """Return ``a b`` exactly."""
    high = a * b
    shifted = SPLITTER * a
    a_high = shifted - (shifted - a)
    a_low = a - a_high
    shifted = SPLITTER * b
    b_high = shifted - (shifted - b)
    b_low = b - b_high
    return Pair(high, ((a_high * b_high - high) + a_high * b_low + a_low * b_high) + a_low * b_low)


def add(a: Pair, b: Pair) -> Pair:
    """Return the sum of two pairs, to about 2**-104 of the larger one also under cancellation."""
    high, error = total(a.high, b.high)
    low, low_error = total(a.low, b.low)
    high, error = total(high, error + low)
    return total(high, error + low_error)


def multiply(a: Pair, b: Pair) -> Pair:
    """Return the product of two pairs."""
    high, error = product(a.high, b.high)
    return total(high, error + (a.high * b.low + a.low * b.high))


def negative(a: Pair) -> Pair:
    """Return a pair with the other sign."""
    return Pair(-a.high, -a.low)


def transformed(matrix: Floats, vectors: Pair) -> Pair:
    """Return ``matrix @ vectors`` for a matrix (m, n) of doubles and pairs (n, k), shape (m, k)."""
    result = exact(np.zeros((len(matrix), vectors.high.shape[1])))
    for j in range(matrix.shape[1]):
        column = exact(matrix[:, j, None])
        result = add(result, multiply(column, Pair(vectors.high[None, j], vectors.low[None, j])))
    return result
