"""Constant factors of the loop over cells in twice the working precision, as sums of two doubles.

A factor that is rounded once and used a million times causes the same error a million times. Therefore the flow over
1, 2, .. n cells is tabulated together with the rounding errors of its entries, and so is the effect of a unit impulse,
which changes the velocity of the contact by exactly one unit.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import dd_add, dd_scale, two_prod, two_sum

FACTOR_TERMS = 40
"""Terms of the series of the flow over a cell: with exponents of at most 1 per cell the remainder is below 2**-104."""

TURN_HIGH, TURN_LOW = 6.283185307179586, 2.4492935982947064e-16
"""2 pi as a sum of two doubles."""


@njit(cache=True, nogil=True, error_model="numpy")
def dd_multiply(a_high: float, a_low: float, b_high: float, b_low: float) -> tuple[float, float]:
    """Return the product of two pairs."""
    high, error = two_prod(a_high, b_high)
    return two_sum(high, error + (a_high * b_low + a_low * b_high))


@njit(cache=True, nogil=True, error_model="numpy")
def dd_divide(a_high: float, a_low: float, b_high: float, b_low: float) -> tuple[float, float]:
    """Return the quotient of two pairs."""
    first = a_high / b_high
    p, e = dd_scale(b_high, b_low, first)
    rest, _ = dd_add(a_high, a_low, -p, -e)
    return two_sum(first, rest / b_high)


@njit(cache=True, nogil=True, error_model="numpy")
def cell_length(omega: float, cells: int) -> tuple[float, float]:
    """Return 2 pi / (omega cells) as a pair."""
    high, low = two_prod(omega, float(cells))
    return dd_divide(TURN_HIGH, TURN_LOW, high, low)


@njit(cache=True, nogil=True, error_model="numpy")
def tabulate_flow(decay: Floats, frequency_squared: Floats, step: tuple[float, float], table: Floats) -> None:
    """Write the flow of every block over n cells into table[n], n from 0.

    Parameters
    ----------
    decay, frequency_squared : (N,)
    step : pair
        Length of a cell; its product with any exponent is at most 1.
    table : (n, N, 8)
        The entries of the 2 x 2 matrix row by row, then their rounding errors.
    """
    high, low = np.empty(4), np.empty(4)
    for j in range(decay.shape[0]):
        # y'' = -w^2 y - 2 eta y' from y = 0, y' = 1: y is e12, and the other entries follow from y and y'
        p_high, p_low = dd_scale(step[0], step[1], 2.0 * decay[j])
        q_high, q_low = dd_multiply(step[0], step[1], step[0], step[1])
        q_high, q_low = dd_scale(q_high, q_low, frequency_squared[j])
        before_high, before_low = 0.0, 0.0
        term_high, term_low = step
        y_high, y_low = step
        rate_high, rate_low = step
        for m in range(FACTOR_TERMS):
            a_high, a_low = dd_multiply(p_high, p_low, term_high, term_low)
            a_high, a_low = dd_scale(a_high, a_low, m + 1.0)
            b_high, b_low = dd_multiply(q_high, q_low, before_high, before_low)
            a_high, a_low = dd_add(a_high, a_low, b_high, b_low)
            before_high, before_low = term_high, term_low
            term_high, term_low = dd_divide(-a_high, -a_low, (m + 1.0) * (m + 2.0), 0.0)
            y_high, y_low = dd_add(y_high, y_low, term_high, term_low)
            a_high, a_low = dd_scale(term_high, term_low, m + 2.0)
            rate_high, rate_low = dd_add(rate_high, rate_low, a_high, a_low)
        rate_high, rate_low = dd_divide(rate_high, rate_low, step[0], step[1])
        twice_high, twice_low = dd_scale(y_high, y_low, 2.0 * decay[j])
        high[0], low[0] = dd_add(rate_high, rate_low, twice_high, twice_low)
        high[1], low[1] = y_high, y_low
        high[2], low[2] = dd_scale(y_high, y_low, -frequency_squared[j])
        high[3], low[3] = rate_high, rate_low
        table[0, j, :] = 0.0
        table[0, j, 0] = 1.0
        table[0, j, 3] = 1.0
        for n in range(1, table.shape[0]):
            for i in range(4):
                row, column = 2 * (i // 2), i % 2
                a_high, a_low = dd_multiply(table[n - 1, j, row], table[n - 1, j, 4 + row], high[column], low[column])
                b_high, b_low = dd_multiply(
                    table[n - 1, j, row + 1], table[n - 1, j, 5 + row], high[column + 2], low[column + 2]
                )
                table[n, j, i], table[n, j, 4 + i] = dd_add(a_high, a_low, b_high, b_low)


@njit(cache=True, nogil=True, error_model="numpy")
def shortfall(factors: Floats, values: Floats, goal: float) -> float:
    """Return goal - sum factors * values, rounded once; both arrays have the same shape."""
    high, low = goal, 0.0
    for a, b in zip(factors.ravel(), values.ravel()):  # noqa: B905 - numba has no strict zip
        product, error = two_prod(a, b)
        high, low = dd_add(high, low, -product, -error)
    return high + low
