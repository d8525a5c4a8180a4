"""Eigenvalues of a small real matrix in given memory, by Hessenberg reduction and Francis' double-shift QR steps.

The matrix is overwritten. LAPACK's routines are not used, because numba's interface to them allocates and raises.

References
----------
G. H. Golub, C. F. Van Loan, *Matrix Computations*, 4th ed. 2013, sections 7.4.3 and 7.5; R. S. Martin, G. Peters,
J. H. Wilkinson, "The QR algorithm for real Hessenberg matrices", Numerische Mathematik 14 (1970) 219-231.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.tolerances import EXCEPTIONAL_SHIFT, QR_STEPS
from grazemap_core.tolerances import EPSILON

QR_CONVERGED = 0
QR_NOT_CONVERGED = 1


@kernel
def _reflect(matrix: Floats, first: int, v0: float, v1: float, v2: float, size: int, last: int) -> None:
    """Apply the reflection along (v0, v1, v2) to rows and columns first .. first + size - 1 of a Hessenberg matrix.

    `last` is the last row and column of the active block; since only eigenvalues are computed, the rest is not updated.
    """
    square = v0 * v0 + v1 * v1 + v2 * v2
    if square == 0.0:
        return
    for j in range(max(0, first - 1), last + 1):
        total = v0 * matrix[first, j] + v1 * matrix[first + 1, j]
        if size == 3:
            total += v2 * matrix[first + 2, j]
        total *= 2.0 / square
        matrix[first, j] -= total * v0
        matrix[first + 1, j] -= total * v1
        if size == 3:
            matrix[first + 2, j] -= total * v2
    for i in range(min(last, first + 3) + 1):
        total = v0 * matrix[i, first] + v1 * matrix[i, first + 1]
        if size == 3:
            total += v2 * matrix[i, first + 2]
        total *= 2.0 / square
        matrix[i, first] -= total * v0
        matrix[i, first + 1] -= total * v1
        if size == 3:
            matrix[i, first + 2] -= total * v2


@kernel
def _to_hessenberg(matrix: Floats, axis: Floats) -> None:
    """Reduce a matrix to upper Hessenberg form by reflections, in place; axis (n,) is scratch."""
    n = matrix.shape[0]
    for k in range(n - 2):
        scale = 0.0
        for i in range(k + 1, n):
            scale = max(scale, abs(matrix[i, k]))
        if scale == 0.0:
            continue
        square = 0.0
        for i in range(k + 1, n):
            axis[i] = matrix[i, k] / scale
            square += axis[i] * axis[i]
        axis[k + 1] += math.copysign(math.sqrt(square), axis[k + 1])
        square = 0.0
        for i in range(k + 1, n):
            square += axis[i] * axis[i]
        for j in range(n):
            total = 0.0
            for i in range(k + 1, n):
                total += axis[i] * matrix[i, j]
            total *= 2.0 / square
            for i in range(k + 1, n):
                matrix[i, j] -= total * axis[i]
        for i in range(n):
            total = 0.0
            for j in range(k + 1, n):
                total += axis[j] * matrix[i, j]
            total *= 2.0 / square
            for j in range(k + 1, n):
                matrix[i, j] -= total * axis[j]
        for i in range(k + 2, n):
            matrix[i, k] = 0.0


@kernel
def _francis_step(matrix: Floats, low: int, last: int, exceptional: bool) -> None:
    """Apply one double-shift QR step to rows and columns low .. last of a Hessenberg matrix, in place.

    The shifts are the eigenvalues of the last two rows and columns; exceptional ones break a cycle.
    """
    trace = matrix[last - 1, last - 1] + matrix[last, last]
    determinant = matrix[last - 1, last - 1] * matrix[last, last] - matrix[last - 1, last] * matrix[last, last - 1]
    if exceptional:
        other = abs(matrix[last, last - 1]) + abs(matrix[last - 1, last - 2])
        trace, determinant = 1.5 * other, other * other
    h00, h10 = matrix[low, low], matrix[low + 1, low]
    x = h00 * h00 + matrix[low, low + 1] * h10 - trace * h00 + determinant
    y = h10 * (h00 + matrix[low + 1, low + 1] - trace)
    z = h10 * matrix[low + 2, low + 1]
    for k in range(low, last):
        size = 3 if k + 2 <= last else 2
        if size == 2:
            z = 0.0
        scale = max(abs(x), max(abs(y), abs(z)))
        if scale > 0.0:
            x, y, z = x / scale, y / scale, z / scale
            length = math.copysign(math.sqrt(x * x + y * y + z * z), x)
            _reflect(matrix, k, x + length, y, z, size, last)
        if k > low:
            matrix[k + 1, k - 1] = 0.0
            if size == 3:
                matrix[k + 2, k - 1] = 0.0
        if k + 1 <= last:
            x = matrix[k + 1, k]
            y = matrix[k + 2, k] if k + 2 <= last else 0.0
            z = matrix[k + 3, k] if k + 3 <= last else 0.0


@kernel
def eigenvalues_of_two(a: float, b: float, c: float, d: float) -> tuple[float, float, float, float]:
    """Return the eigenvalues of [[a, b], [c, d]] as (real, imaginary, real, imaginary)."""
    half = 0.5 * (a - d)
    scale = max(abs(half), max(abs(b), abs(c)))
    if scale == 0.0:
        return a, 0.0, d, 0.0
    discriminant = (half / scale) * (half / scale) + (b / scale) * (c / scale)
    middle = d + half
    if discriminant < 0.0:
        imaginary = scale * math.sqrt(-discriminant)
        return middle, imaginary, middle, -imaginary
    # d + z and d - b c/z, so that the smaller one does not cancel
    root = half + math.copysign(scale * math.sqrt(discriminant), half)
    return d + root, 0.0, d - (b / root) * c if root != 0.0 else d, 0.0


@kernel
def eigenvalues(matrix: Floats, real: Floats, imaginary: Floats) -> int:
    """Write the eigenvalues of a matrix into real (n,) and imaginary (n,); matrix (n, n) is overwritten.

    The error is a few EPSILON of the norm of the matrix times the condition number of the eigenvalue. The two numbers
    of a complex pair are adjacent. Returns QR_CONVERGED or QR_NOT_CONVERGED; the latter also if an entry is not finite.
    """
    n = matrix.shape[0]
    for i in range(n):
        for j in range(n):
            if not np.isfinite(matrix[i, j]):
                return QR_NOT_CONVERGED
    _to_hessenberg(matrix, real)
    norm = 0.0
    for i in range(n):
        for j in range(max(0, i - 1), n):
            norm = max(norm, abs(matrix[i, j]))
    last = n - 1
    steps = 0
    while last >= 0:
        low = last
        while low > 0:
            size = abs(matrix[low - 1, low - 1]) + abs(matrix[low, low])
            if size == 0.0:
                size = norm
            if abs(matrix[low, low - 1]) <= EPSILON * size:
                matrix[low, low - 1] = 0.0
                break
            low -= 1
        if low == last:
            real[last] = matrix[last, last]
            imaginary[last] = 0.0
            last -= 1
            steps = 0
            continue
        if low == last - 1:
            real[low], imaginary[low], real[last], imaginary[last] = eigenvalues_of_two(
                matrix[low, low], matrix[low, last], matrix[last, low], matrix[last, last]
            )
            last -= 2
            steps = 0
            continue
        if steps == QR_STEPS:
            return QR_NOT_CONVERGED
        steps += 1
        _francis_step(matrix, low, last, steps % EXCEPTIONAL_SHIFT == 0)
    return QR_CONVERGED


@kernel
def spectral_radius(matrix: Floats, real: Floats, imaginary: Floats) -> float:
    """Return the largest modulus of the eigenvalues, which are written as by `eigenvalues`; NaN where it finds none."""
    if eigenvalues(matrix, real, imaginary) != QR_CONVERGED:
        return math.nan
    largest = 0.0
    for i in range(real.shape[0]):
        largest = max(largest, math.hypot(real[i], imaginary[i]))
    return largest
