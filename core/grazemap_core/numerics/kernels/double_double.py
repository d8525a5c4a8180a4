"""Arithmetic with unevaluated sums of two doubles: about 32 digits, from error-free transformations.

No function relies on a fused multiply-add; callers must not be compiled with fast-math. Factors must not overflow when
they are split (|a| < 1e300). Python may also call the functions with pairs of arrays, element by element;
`transformed` multiplies a matrix with such pairs.

References
----------
Dekker, Numerische Mathematik 18 (1971) 224-242; Hida, Li & Bailey, ARITH-15 (2001) 155-162.
"""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import inlined_formula
from grazemap_core.records import NamedTuple

Number = TypeVar("Number", float, Floats)

SPLITTER = 134217729.0  # 2**27 + 1: halves a 53-bit significand


class Pair(NamedTuple, Generic[Number]):
    """The sum ``high + low`` of two numbers, or of two arrays of one shape, ``|low| <= ulp(high)/2``."""

    high: Number
    """The sum, rounded."""
    low: Number
    """The rest."""

    @property
    def rounded(self) -> Number:
        """The nearest double, for Python; kernels add the two."""
        return self.high + self.low


TWO_PI = Pair(6.283185307179586, 2.4492935982947064e-16)
"""2 pi, with an error of 6e-33."""


@inlined_formula
def two_sum(a: Number, b: Number) -> Pair[Number]:
    """Return ``a + b`` exactly."""
    total = a + b
    virtual = total - a
    return Pair(total, (a - (total - virtual)) + (b - virtual))


@inlined_formula
def two_prod(a: Number, b: Number) -> Pair[Number]:
    """Return ``a b`` exactly."""
    product = a * b
    shifted = SPLITTER * a
    a_high = shifted - (shifted - a)
    a_low = a - a_high
    shifted = SPLITTER * b
    b_high = shifted - (shifted - b)
    b_low = b - b_high
    return Pair(product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low)


@inlined_formula
def negative(a: Pair[Number]) -> Pair[Number]:
    """Return a pair with the other sign."""
    return Pair(-a.high, -a.low)


@inlined_formula
def add(a: Pair[Number], b: Pair[Number]) -> Pair[Number]:
    """Return the sum of two pairs, to about 2**-104 of the larger one also under cancellation."""
    high, error = two_sum(a.high, b.high)
    low, low_error = two_sum(a.low, b.low)
    high, error = two_sum(high, error + low)
    return two_sum(high, error + low_error)


@inlined_formula
def scale(a: Pair[Number], factor: Number) -> Pair[Number]:
    """Return a pair times a double."""
    high, error = two_prod(a.high, factor)
    return two_sum(high, error + a.low * factor)


@inlined_formula
def multiply(a: Pair[Number], b: Pair[Number]) -> Pair[Number]:
    """Return the product of two pairs."""
    high, error = two_prod(a.high, b.high)
    return two_sum(high, error + (a.high * b.low + a.low * b.high))


@inlined_formula
def divide(a: Pair[Number], b: Pair[Number]) -> Pair[Number]:
    """Return the quotient of two pairs."""
    first = a.high / b.high
    rest = add(a, negative(scale(b, first)))
    return two_sum(first, rest.high / b.high)


def exact(values: Floats) -> Pair[Floats]:
    """Return doubles as pairs."""
    return Pair(values, np.zeros_like(values))


def transformed(matrix: Floats, vectors: Pair[Floats]) -> Pair[Floats]:
    """Return ``matrix @ vectors`` for a matrix (m, n) of doubles and pairs (n, k), shape (m, k)."""
    result = exact(np.zeros((len(matrix), vectors.high.shape[1])))
    for j in range(matrix.shape[1]):
        result = add(result, scale(Pair(vectors.high[None, j], vectors.low[None, j]), matrix[:, j, None]))
    return result
