"""Newton's method for a periodic orbit, in the frame of z in which all half periods are alike (`closing`).

What flows in is where a trajectory began, where it is m half periods later, and the matrix that carries changes of the
state over them; out flows where the orbit nearby is, to first order. Whoever calls it runs on from there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from grazemap_core.kernels.compiled import kernel

FloatArray = NDArray[np.float64]


@kernel
def newton_step(start: FloatArray, end: FloatArray, sign: float, matrix: FloatArray, scratch: FloatArray) -> bool:
    """Move `end` onto the orbit, to first order: end + s M d with (1 - s M) d = end - start.

    Parameters
    ----------
    start, end : (2 N,)
        States in the frame of z, before and after m half periods. `end` is changed in place.
    sign : float
        s: 1 for even m, else -1.
    matrix : (2 N, 2 N)
        Changes of u over the m half periods.
    scratch : (2 N, 2 N + 1)

    Returns
    -------
    Whether there is one orbit: False for a singular matrix, and end is left as it was.
    """
    size = start.shape[0]
    for i in range(size):
        for j in range(size):
            scratch[i, j] = (1.0 if i == j else 0.0) - sign * matrix[i, j]
        scratch[i, size] = end[i] - start[i]
    for i in range(size):
        pivot = i
        for row in range(i + 1, size):
            if abs(scratch[row, i]) > abs(scratch[pivot, i]):
                pivot = row
        if not abs(scratch[pivot, i]) > 0.0:
            return False
        for j in range(i, size + 1):
            scratch[i, j], scratch[pivot, j] = scratch[pivot, j], scratch[i, j]
        for row in range(i + 1, size):
            factor = scratch[row, i] / scratch[i, i]
            for j in range(i, size + 1):
                scratch[row, j] -= factor * scratch[i, j]
    for i in range(size - 1, -1, -1):
        value = scratch[i, size]
        for j in range(i + 1, size):
            value -= scratch[i, j] * scratch[j, size]
        scratch[i, size] = value / scratch[i, i]
    for i in range(size):
        for j in range(size):
            end[i] += sign * matrix[i, j] * scratch[j, size]
    return True
