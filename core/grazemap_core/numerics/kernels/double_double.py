"""Arithmetic with unevaluated sums of two doubles: about 32 digits, from error-free transformations.

Arguments and results are pairs (high, low) with ``|low| <= ulp(high)/2``. No function relies on a fused multiply-add;
callers must not be compiled with fast-math. Factors must not overflow when they are split (|a| < 1e300).

References
----------
Dekker, Numerische Mathematik 18 (1971) 224-242; Hida, Li & Bailey, ARITH-15 (2001) 155-162.
"""

from __future__ import annotations

from grazemap_core.numerics.jit.compiled import inlined

SPLITTER = 134217729.0  # 2**27 + 1: halves a 53-bit significand


@inlined
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Return ``s, e`` with ``s + e = a + b`` exactly and s the rounded sum."""
    total = a + b
    virtual = total - a
    return total, (a - (total - virtual)) + (b - virtual)


@inlined
def two_prod(a: float, b: float) -> tuple[float, float]:
    """Return ``p, e`` with ``p + e = a b`` exactly and p the rounded product."""
    product = a * b
    shifted = SPLITTER * a
    a_high = shifted - (shifted - a)
    a_low = a - a_high
    shifted = SPLITTER * b
    b_high = shifted - (shifted - b)
    b_low = b - b_high
    return product, ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low


@inlined
def dd_add(a_high: float, a_low: float, b_high: float, b_low: float) -> tuple[float, float]:
    """Return the sum of two pairs, to about 2**-104 of the larger one also under cancellation."""
    high, error = two_sum(a_high, b_high)
    low, low_error = two_sum(a_low, b_low)
    high, error = two_sum(high, error + low)
    return two_sum(high, error + low_error)


@inlined
def dd_scale(a_high: float, a_low: float, factor: float) -> tuple[float, float]:
    """Return a pair times a double."""
    high, error = two_prod(a_high, factor)
    return two_sum(high, error + a_low * factor)
