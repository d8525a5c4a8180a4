"""Residual of a decomposition into blocks, for dense matrices, computed in double-double."""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import dd_add, dd_scale, two_prod


@njit(cache=True, nogil=True, error_model="numpy")
def matrix_invariance_residual(
    mass: Floats, damping: Floats, stiffness: Floats, columns: Floats, frequency_squared: Floats, decay: Floats
) -> Floats:
    """Return the residual of ``x' = v``, ``M v' = -K x - C v`` for the columns ``X`` and the companion blocks T.

    Parameters
    ----------
    mass, damping, stiffness : ndarray of shape (N, N)
    columns : ndarray of shape (2N, 2N)
        X; rows displacements then velocities, columns (a_1, b_1, a_2, b_2, ...): the state is ``a u + b u'``.
    frequency_squared, decay : ndarray of shape (N,)
        T has the blocks ``[[0, 1], [-frequency_squared, -2 decay]]``.

    Returns
    -------
    ndarray of shape (2N, 2N)
        The velocity rows are momenta: not divided by the mass.
    """
    count = mass.shape[0]
    residual = np.empty((2 * count, 2 * count))
    high, low = np.empty(2 * count), np.empty(2 * count)
    for block in range(count):
        for which in range(2):
            column = 2 * block + which
            for row in range(2 * count):  # X T
                a, b = columns[row, 2 * block], columns[row, 2 * block + 1]
                if which == 0:
                    high[row], low[row] = two_prod(-frequency_squared[block], b)
                else:
                    term_high, term_low = two_prod(-2.0 * decay[block], b)
                    high[row], low[row] = dd_add(term_high, term_low, a, 0.0)
            for i in range(count):
                sum_high, sum_low = dd_add(columns[count + i, column], 0.0, -high[i], -low[i])
                residual[i, column] = sum_high + sum_low
                sum_high, sum_low = 0.0, 0.0
                for j in range(count):
                    term_high, term_low = two_prod(-stiffness[i, j], columns[j, column])
                    sum_high, sum_low = dd_add(sum_high, sum_low, term_high, term_low)
                    term_high, term_low = two_prod(-damping[i, j], columns[count + j, column])
                    sum_high, sum_low = dd_add(sum_high, sum_low, term_high, term_low)
                    term_high, term_low = dd_scale(high[count + j], low[count + j], -mass[i, j])
                    sum_high, sum_low = dd_add(sum_high, sum_low, term_high, term_low)
                residual[count + i, column] = sum_high + sum_low
    return residual
