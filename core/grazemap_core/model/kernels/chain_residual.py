"""Residual of a decomposition into blocks, computed in double-double.

Rows are link elongations ``x_i - x_{i+1}`` (the last mass relative to ground) and velocities: with these, every
coefficient of the equations of motion is a given parameter, so nothing is rounded before the residual is formed.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.numerics.kernels.double_double import dd_add, dd_scale, two_prod, two_sum


@njit(cache=True, nogil=True, error_model="numpy")
def invariance_residual(
    masses: Floats,
    stiffnesses: Floats,
    link_damping: Floats,
    columns: Floats,
    frequency_squared: Floats,
    decay: Floats,
    wall_stiffness: float,
    wall_damping: float,
) -> Floats:
    """Return ``A X - X T`` where T holds the companion blocks ``[[0, 1], [-frequency_squared, -2 decay]]``.

    Parameters
    ----------
    masses, stiffnesses, link_damping : ndarray of shape (N,)
    columns : ndarray of shape (2N, 2N)
        X; rows elongations then velocities, columns (a_1, b_1, a_2, b_2, ...): the state is ``a u + b u'``.
    frequency_squared, decay : ndarray of shape (N,)
    wall_stiffness, wall_damping : float
        Coefficients of the link from the first mass to a wall; 0 if there is none.

    Returns
    -------
    ndarray of shape (2N, 2N)
        Velocity rows are divided by the mass.
    """
    count = masses.size
    residual = np.empty((2 * count, 2 * count))
    for block in range(count):
        for which in range(2):
            column = 2 * block + which
            force_high = 0.0
            force_low = 0.0
            if wall_stiffness > 0.0:
                # the displacement of the first mass is the sum of all elongations
                sum_high, sum_low = 0.0, 0.0
                for i in range(count):
                    sum_high, sum_low = dd_add(sum_high, sum_low, columns[i, column], 0.0)
                spring_high, spring_low = dd_scale(sum_high, sum_low, -wall_stiffness)
                dash_high, dash_low = two_prod(-wall_damping, columns[count, column])
                force_high, force_low = dd_add(spring_high, spring_low, dash_high, dash_low)
            for i in range(count):
                # rate of elongation of link i
                if i + 1 < count:
                    rate_high, rate_low = two_sum(columns[count + i, column], -columns[count + i + 1, column])
                else:
                    rate_high, rate_low = columns[count + i, column], 0.0
                # force in the link, then the net force on mass i
                spring_high, spring_low = two_prod(stiffnesses[i], columns[i, column])
                dash_high, dash_low = dd_scale(rate_high, rate_low, link_damping[i])
                link_high, link_low = dd_add(spring_high, spring_low, dash_high, dash_low)
                net_high, net_low = dd_add(force_high, force_low, -link_high, -link_low)
                force_high, force_low = link_high, link_low

                for row, weight, high, low in (
                    (i, 1.0, rate_high, rate_low),
                    (count + i, masses[i], net_high, net_low),
                ):
                    a = columns[row, 2 * block]
                    b = columns[row, 2 * block + 1]
                    if which == 0:  # A a + frequency_squared b
                        term_high, term_low = two_prod(frequency_squared[block], b)
                    else:  # A b - a + 2 decay b
                        term_high, term_low = two_prod(2.0 * decay[block], b)
                        term_high, term_low = dd_add(term_high, term_low, -a, 0.0)
                    term_high, term_low = dd_scale(term_high, term_low, weight)
                    sum_high, sum_low = dd_add(high, low, term_high, term_low)
                    residual[row, column] = (sum_high + sum_low) / weight
    return residual
