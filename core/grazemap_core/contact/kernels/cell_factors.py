"""Constant factors of the loop over cells in twice the working precision, as sums of two doubles.

A factor that is rounded once and used a million times causes the same error a million times. Therefore the flow over
1, 2, .. n cells is tabulated together with the rounding errors of its entries, and so is the effect of a unit impulse,
which changes the velocity of the contact by exactly one unit.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.contact.tolerances import FACTOR_TERMS
from grazemap_core.numerics.kernels.double_double import TWO_PI, Pair, add, divide, multiply, negative, scale, two_prod


@njit(cache=True, nogil=True, error_model="numpy")
def cell_length(omega: float, cells: int) -> Pair[float]:
    """Return 2 pi / (omega cells)."""
    return divide(TWO_PI, two_prod(omega, float(cells)))


@njit(cache=True, nogil=True, error_model="numpy")
def tabulate_flow(decay: Floats, frequency_squared: Floats, step: Pair[float], table: Floats) -> None:
    """Write the flow of every block over n cells into table[n], n from 0.

    Parameters
    ----------
    decay, frequency_squared : (N,)
    step : Pair
        Length of a cell; its product with any exponent is at most 1.
    table : (n, N, 8)
        The entries of the 2 x 2 matrix row by row, then their rounding errors.
    """
    high, low = np.empty(4), np.empty(4)
    for j in range(decay.shape[0]):
        # y'' = -w^2 y - 2 eta y' from y = 0, y' = 1: y is e12, and the other entries follow from y and y'
        twice_decay = 2.0 * decay[j]
        p = scale(step, twice_decay)
        q = scale(multiply(step, step), frequency_squared[j])
        before, term, y, rate = Pair(0.0, 0.0), step, step, step
        for m in range(FACTOR_TERMS):
            following = add(scale(multiply(p, term), m + 1.0), multiply(q, before))
            before = term
            term = divide(negative(following), Pair((m + 1.0) * (m + 2.0), 0.0))
            y = add(y, term)
            rate = add(rate, scale(term, m + 2.0))
        rate = divide(rate, step)
        high[0], low[0] = add(rate, scale(y, twice_decay))
        high[1], low[1] = y
        high[2], low[2] = scale(y, -frequency_squared[j])
        high[3], low[3] = rate
        table[0, j, :] = 0.0
        table[0, j, 0] = 1.0
        table[0, j, 3] = 1.0
        for n in range(1, table.shape[0]):
            for i in range(4):
                row, column = 2 * (i // 2), i % 2
                first = multiply(Pair(table[n - 1, j, row], table[n - 1, j, 4 + row]), Pair(high[column], low[column]))
                second = multiply(
                    Pair(table[n - 1, j, row + 1], table[n - 1, j, 5 + row]), Pair(high[column + 2], low[column + 2])
                )
                table[n, j, i], table[n, j, 4 + i] = add(first, second)


@njit(cache=True, nogil=True, error_model="numpy")
def shortfall(factors: Floats, values: Floats, goal: float) -> float:
    """Return goal - sum factors * values, rounded once; both arrays have the same shape."""
    total = Pair(goal, 0.0)
    for a, b in zip(factors.ravel(), values.ravel()):  # noqa: B905 - numba has no strict zip
        total = add(total, negative(two_prod(a, b)))
    return total.high + total.low
