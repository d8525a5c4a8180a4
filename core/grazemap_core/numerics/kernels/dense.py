"""Small dense matrices in given memory: products, linear systems by Gaussian elimination, Cholesky factors."""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import fused_kernel, kernel
from grazemap_core.numerics.tolerances import PRODUCT_BY_ROWS


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


@fused_kernel
def multiply(left: Floats, right: Floats, product: Floats) -> None:
    """Write the product of two square matrices of even size into a third one; each entry is summed in order."""
    size = product.shape[0]
    if size >= PRODUCT_BY_ROWS:
        for row in range(size):
            _add_row(left[row], right, product[row], size)
        return
    for row in range(0, size, 2):
        lower = row + 1
        for column in range(0, size, 2):
            following = column + 1
            first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
            for m in range(size):
                above, below, entry, next_entry = left[row, m], left[lower, m], right[m, column], right[m, following]
                first += above * entry
                second += above * next_entry
                third += below * entry
                fourth += below * next_entry
            product[row, column], product[row, following] = first, second
            product[lower, column], product[lower, following] = third, fourth


@fused_kernel
def _add_row(factors: Floats, rows: Floats, total: Floats, count: int) -> None:
    """Write the sum of rows, each times its factor, over the first `count` columns."""
    for column in range(count):
        total[column] = 0.0
    for m in range(rows.shape[0]):
        factor = factors[m]
        for column in range(count):
            total[column] += factor * rows[m, column]


@fused_kernel
def add_transposed_product(left: Floats, right: Floats, total: Floats, sums: Floats) -> None:
    """Add ``left^T right``, which is symmetric, to a symmetric matrix of even size; `sums` (size,) is scratch."""
    size = total.shape[0]
    if size >= PRODUCT_BY_ROWS:
        for row in range(size):
            _add_row(left[:, row], right, sums, row + 1)
            for column in range(row + 1):
                total[row, column] += sums[column]
                total[column, row] = total[row, column]
        return
    for row in range(0, size, 2):
        lower = row + 1
        for column in range(0, row + 1, 2):
            following = column + 1
            first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
            for m in range(size):
                above, below, entry, next_entry = left[m, row], left[m, lower], right[m, column], right[m, following]
                first += above * entry
                second += above * next_entry
                third += below * entry
                fourth += below * next_entry
            total[row, column] += first
            total[lower, column] += third
            total[lower, following] += fourth
            if column < row:
                total[row, following] += second
                total[following, row] = total[row, following]
                total[following, lower] = total[lower, following]
            total[column, row] = total[row, column]
            total[column, lower] = total[lower, column]


@kernel
def cholesky(matrix: Floats) -> bool:
    """Replace a symmetric matrix by its lower Cholesky factor; return whether it is positive definite.

    Only the lower triangle is read and written.
    """
    for row in range(matrix.shape[0]):
        for column in range(row + 1):
            value = matrix[row, column]
            for m in range(column):
                value -= matrix[row, m] * matrix[column, m]
            if column < row:
                matrix[row, column] = value / matrix[column, column]
            elif value > 0.0:
                matrix[row, row] = math.sqrt(value)
            else:
                return False
    return True
