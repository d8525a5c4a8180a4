"""Arithmetic with unevaluated sums of two doubles: about 32 digits, from error-free transformations.

Arguments and results are pairs (high, low) with ``|low| <= ulp(high)/2``. No function relies on a fused multiply-add;
callers must not be compiled with fast-math. Factors must not overflow when they are split (|a| < 1e300). Python may
also call them with arrays, element by element (`grazemap_core.numerics.double_double_arrays`).

References
----------
Dekker, Numerische Mathematik 18 (1971) 224-242; Hida, Li & Bailey, ARITH-15 (2001) 155-162.
"""

from __future__ import annotations

from typing import TypeVar

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import inlined_formula

Number = TypeVar("Number", float, Floats)

SPLITTER = 134217729.0  # 2**27 + 1: halves a 53-bit significand


@inlined_formula
def two_sum(a: Number, b: Number) -> tuple[Number, Number]:
    """Return ``s, e`` with ``s + e = a + b`` exactly and s the rounded sum."""
    total = a + b
    virtual = total - a
    return total, (a - (total - virtual)) + (b - virtual)


@inlined_formula
def two_prod(a: Number, b: Number) -> tuple[Number, Number]:
    """Return ``p, e`` with ``p + e = a b`` exactly and p the rounded product."""
    product = a * b
    shifted = SPLITTER * a
    a_high = shifted - (shifted - a)
    a_low = a - a_high
    shifted = SPLITTER * b
    b_high = shifted - (shifted - b)
    b_low = b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@inlined_formula
def dd_add(a_high: Number, a_low: Number, b_high: Number, b_low: Number) -> tuple[Number, Number]:
    """Return the sum of two pairs, to about 2**-104 of the larger one also under cancellation."""
    high, error = two_sum(a_high, b_high)
    low, low_error = two_sum(a_low, b_low)
    high, error = two_sum(high, error + low)
    return two_sum(high, error + low_error)


@inlined_formula
def dd_scale(a_high: Number, a_low: Number, factor: Number) -> tuple[Number, Number]:
    """Return a pair times a double."""
    high, error = two_prod(a_high, factor)
    return two_sum(high, error + a_low * factor)
