"""Arithmetic with unevaluated sums of two doubles on arrays: about 32 digits, element by element.

As `grazemap_core.numerics.kernels.double_double`, for code that is not compiled.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import dd_add, two_prod, two_sum
from grazemap_core.records import NamedTuple


class Pair(NamedTuple):
    """The sum ``high + low`` of two arrays of one shape, ``|low| <= ulp(high)/2``."""

    high: Floats
    """The sum, rounded."""
    low: Floats
    """The rest."""

    @property
    def rounded(self) -> Floats:
        """The nearest doubles."""
        return self.high + self.low


def exact(values: Floats) -> Pair:
    """Return doubles as pairs."""
    return Pair(values, np.zeros_like(values))


def product(a: Floats, b: Floats) -> Pair:
    """Return ``a b`` exactly."""
    return Pair(*two_prod(a, b))


def add(a: Pair, b: Pair) -> Pair:
    """Return the sum of two pairs, to about 2**-104 of the larger one also under cancellation."""
    return Pair(*dd_add(*a, *b))


def multiply(a: Pair, b: Pair) -> Pair:
    """Return the product of two pairs."""
    high, error = product(a.high, b.high)
    return Pair(*two_sum(high, error + (a.high * b.low + a.low * b.high)))


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
