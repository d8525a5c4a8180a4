"""Small dense linear systems in given memory, by Gaussian elimination with partial pivoting."""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel


@kernel
def eliminate(system: Floats, size: int) -> float:
    """Solve a linear system in place for several right-hand sides, and return the determinant.

    Parameters
    ----------
    system : (size, size + n)
        Matrix and right-hand sides; the latter become the solutions, unless the determinant is 0.
    size : int
        Number of unknowns.
    """
    columns = system.shape[1]
    determinant = 1.0
    for i in range(size):
        pivot = i
        for row in range(i + 1, size):
            if abs(system[row, i]) > abs(system[pivot, i]):
                pivot = row
        if not abs(system[pivot, i]) > 0.0:
            return 0.0
        if pivot != i:
            determinant = -determinant
            for j in range(i, columns):
                system[i, j], system[pivot, j] = system[pivot, j], system[i, j]
        determinant *= system[i, i]
        for row in range(i + 1, size):
            factor = system[row, i] / system[i, i]
            for j in range(i + 1, columns):
                system[row, j] -= factor * system[i, j]
    for column in range(size, columns):
        for i in range(size - 1, -1, -1):
            value = system[i, column]
            for j in range(i + 1, size):
                value -= system[i, j] * system[j, column]
            system[i, column] = value / system[i, i]
    return determinant
