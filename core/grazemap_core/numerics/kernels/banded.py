"""Linear systems with a complex banded matrix, by Gaussian elimination with partial pivoting, as in LAPACK's gbtrf.

A matrix whose entries (i, j) vanish for ``|i - j| > reach`` is an array (N, 3 reach + 1): row i holds its entries from
column i - reach on. The last `reach` columns are for those that exchanges of rows add. A full matrix has the reach
N - 1.
"""

from __future__ import annotations

from grazemap_core.arrays import Complexes, Integers
from grazemap_core.numerics.jit.compiled import inlined, kernel


@inlined
def _modulus(value: complex) -> float:
    return abs(value.real) + abs(value.imag)


@kernel
def factor(matrix: Complexes, reach: int, pivots: Integers) -> bool:
    """Replace a matrix by its factors, and write to `pivots` (N,) the row that row i was exchanged with.

    Returns
    -------
    bool
        False if a pivot is exactly zero.
    """
    count = matrix.shape[0]
    for i in range(count):
        below = min(i + reach, count - 1)
        last = min(i + 2 * reach, count - 1)
        pivot = i
        for k in range(i + 1, below + 1):
            if _modulus(matrix[k, i - k + reach]) > _modulus(matrix[pivot, i - pivot + reach]):
                pivot = k
        pivots[i] = pivot
        if matrix[pivot, i - pivot + reach] == 0.0:
            return False
        if pivot != i:
            for j in range(i, last + 1):
                entry = matrix[i, j - i + reach]
                matrix[i, j - i + reach] = matrix[pivot, j - pivot + reach]
                matrix[pivot, j - pivot + reach] = entry
        for k in range(i + 1, below + 1):
            multiplier = matrix[k, i - k + reach] / matrix[i, reach]
            matrix[k, i - k + reach] = multiplier
            for j in range(i + 1, last + 1):
                matrix[k, j - k + reach] -= multiplier * matrix[i, j - i + reach]
    return True


@kernel
def solve(factors: Complexes, reach: int, pivots: Integers, vector: Complexes) -> None:
    """Solve a factored system in place: `vector` (N,) is the right-hand side and becomes the solution."""
    count = vector.size
    for i in range(count):
        pivot = pivots[i]
        value = vector[pivot]
        vector[pivot] = vector[i]
        vector[i] = value
        for k in range(i + 1, min(i + reach, count - 1) + 1):
            vector[k] -= factors[k, i - k + reach] * value
    for n in range(count):
        i = count - 1 - n
        value = vector[i]
        for j in range(i + 1, min(i + 2 * reach, count - 1) + 1):
            value -= factors[i, j - i + reach] * vector[j]
        vector[i] = value / factors[i, reach]
