"""Steady response of a chain at many forcing frequencies, accurate to round-off also at sharp resonances.

The matrix ``K - omega^2 M + i omega C`` is complex, symmetric and tridiagonal. It is factored with partial pivoting,
because a part of the chain may resonate by itself. The solution is refined with residuals in double-double that are
computed from the given parameters, so that a resonance does not amplify the rounding of the matrix entries.

References
----------
Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), chapters 9.6 (tridiagonal) and 12 (refinement).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.model.tolerances import STEADY_ACCURACY, STEADY_DIVERGED, STEADY_REFINEMENT_STEPS
from grazemap_core.numerics.jit.compiled import inlined, kernel
from grazemap_core.numerics.kernels.double_double import dd_add, dd_scale, two_prod, two_sum
from grazemap_core.records import NamedTuple

REFINED = 0
"""The amplitudes are accurate to round-off."""
RESONANT = 1
"""The matrix is singular, or so nearly that refinement does not converge: there is no steady motion."""


class Links(NamedTuple):
    """Masses and links of a chain."""

    masses: Floats
    """(N,) Masses."""
    stiffnesses: Floats
    """(N,) Stiffnesses of the links."""
    link_damping: Floats
    """(N,) Damping coefficients of the links."""
    wall_stiffness: float
    """Stiffness of the link from the first mass to a wall; 0 if there is none."""
    wall_damping: float
    """Damping coefficient of this link; 0 likewise."""


class Factors(NamedTuple):
    """The factors of a tridiagonal matrix, as `factor` writes them; arrays of shape (N,)."""

    lower: Complexes
    """The matrix's lower diagonal, without the last entry; then the multipliers."""
    diagonal: Complexes
    """The matrix's diagonal; then that of the upper triangle."""
    upper: Complexes
    """The matrix's upper diagonal, without the last entry; then the second diagonal of the upper triangle."""
    second: Complexes
    """Third diagonal of the upper triangle."""
    swapped: Booleans
    """Whether rows i and i + 1 were exchanged."""


@kernel
def factor(matrix: Factors) -> bool:
    """Factor a tridiagonal matrix in place with partial pivoting, as LAPACK's gttrf does.

    Parameters
    ----------
    matrix : Factors
        `lower`, `diagonal` and `upper` hold the matrix; the last entries of `lower` and `upper` are not used. On return
        they hold the multipliers and the first two diagonals of the upper triangle, `second` its third diagonal, and
        `swapped` whether rows i and i + 1 were exchanged.

    Returns
    -------
    bool
        False if a pivot is exactly zero.
    """
    lower, diagonal, upper, second, swapped = matrix
    count = diagonal.size
    for i in range(count - 1):
        second[i] = 0.0
        pivot, below = diagonal[i], lower[i]
        if abs(pivot.real) + abs(pivot.imag) >= abs(below.real) + abs(below.imag):
            swapped[i] = False
            if pivot == 0.0:
                return False
            multiplier = below / pivot
            lower[i] = multiplier
            diagonal[i + 1] -= multiplier * upper[i]
        else:
            swapped[i] = True
            multiplier = pivot / below
            diagonal[i] = below
            lower[i] = multiplier
            next_diagonal = diagonal[i + 1]
            diagonal[i + 1] = upper[i] - multiplier * next_diagonal
            upper[i] = next_diagonal
            if i + 2 < count:
                second[i] = upper[i + 1]
                upper[i + 1] = -multiplier * second[i]
    return bool(diagonal[count - 1] != 0.0)


@kernel
def solve(factors: Factors, vector: Complexes) -> None:
    """Solve a factored system in place; `vector` of shape (N,) is the right-hand side and becomes the solution."""
    lower, diagonal, upper, second, swapped = factors
    count = diagonal.size
    for i in range(count - 1):
        if swapped[i]:
            above = vector[i + 1]
            vector[i + 1] = vector[i] - lower[i] * above
            vector[i] = above
        else:
            vector[i + 1] -= lower[i] * vector[i]
    for i in range(count - 1, -1, -1):
        value = vector[i]
        if i + 1 < count:
            value -= upper[i] * vector[i + 1]
        if i + 2 < count:
            value -= second[i] * vector[i + 2]
        vector[i] = value / diagonal[i]


@inlined
def _dd_product(a_high: float, a_low: float, b_high: float, b_low: float) -> tuple[float, float]:
    """Return the product of two pairs."""
    high, error = two_prod(a_high, b_high)
    return two_sum(high, error + (a_high * b_low + a_low * b_high))


@kernel
def residual(links: Links, omega: float, forces: Complexes, high: Floats, low: Floats, out: Complexes) -> None:
    """Write ``f - (K - omega^2 M + i omega C) x`` to `out` of shape (N,), computed in double-double.

    `forces` (N,) is f, and `high` + `low`, each of shape (N, 2), is x as real and imaginary parts.
    """
    masses, stiffnesses, link_damping, wall_stiffness, wall_damping = links
    count = masses.size
    square_high, square_low = two_prod(omega, omega)
    real_high, real_low, imag_high, imag_low = 0.0, 0.0, 0.0, 0.0  # force in the previous link
    if wall_stiffness > 0.0:  # (k + i omega c)(0 - x_1)
        dash_high, dash_low = two_prod(omega, wall_damping)
        a_high, a_low = dd_scale(high[0, 0], low[0, 0], -wall_stiffness)
        b_high, b_low = _dd_product(high[0, 1], low[0, 1], dash_high, dash_low)
        real_high, real_low = dd_add(a_high, a_low, b_high, b_low)
        a_high, a_low = dd_scale(high[0, 1], low[0, 1], -wall_stiffness)
        b_high, b_low = _dd_product(high[0, 0], low[0, 0], dash_high, dash_low)
        imag_high, imag_low = dd_add(a_high, a_low, -b_high, -b_low)
    for i in range(count):
        if i + 1 < count:
            re_high, re_low = dd_add(high[i, 0], low[i, 0], -high[i + 1, 0], -low[i + 1, 0])
            im_high, im_low = dd_add(high[i, 1], low[i, 1], -high[i + 1, 1], -low[i + 1, 1])
        else:
            re_high, re_low, im_high, im_low = high[i, 0], low[i, 0], high[i, 1], low[i, 1]
        # link force (k + i omega c)(x_i - x_{i+1})
        dash_high, dash_low = two_prod(omega, link_damping[i])
        a_high, a_low = dd_scale(re_high, re_low, stiffnesses[i])
        b_high, b_low = _dd_product(im_high, im_low, dash_high, dash_low)
        link_re_high, link_re_low = dd_add(a_high, a_low, -b_high, -b_low)
        a_high, a_low = dd_scale(im_high, im_low, stiffnesses[i])
        b_high, b_low = _dd_product(re_high, re_low, dash_high, dash_low)
        link_im_high, link_im_low = dd_add(a_high, a_low, b_high, b_low)
        # f + omega^2 m x + force of the previous link - force of the next link
        inertia_high, inertia_low = dd_scale(square_high, square_low, masses[i])
        a_high, a_low = _dd_product(inertia_high, inertia_low, high[i, 0], low[i, 0])
        a_high, a_low = dd_add(a_high, a_low, forces[i].real, 0.0)
        b_high, b_low = dd_add(real_high, real_low, -link_re_high, -link_re_low)
        a_high, a_low = dd_add(a_high, a_low, b_high, b_low)
        real = a_high + a_low
        a_high, a_low = _dd_product(inertia_high, inertia_low, high[i, 1], low[i, 1])
        a_high, a_low = dd_add(a_high, a_low, forces[i].imag, 0.0)
        b_high, b_low = dd_add(imag_high, imag_low, -link_im_high, -link_im_low)
        a_high, a_low = dd_add(a_high, a_low, b_high, b_low)
        out[i] = complex(real, a_high + a_low)
        real_high, real_low, imag_high, imag_low = link_re_high, link_re_low, link_im_high, link_im_low


@kernel
def _set_matrix(links: Links, omega: float, matrix: Factors) -> None:
    """Write ``K - omega^2 M + i omega C`` to `matrix`."""
    for i in range(links.masses.size):
        before = complex(links.wall_stiffness, omega * links.wall_damping)
        if i > 0:
            before = complex(links.stiffnesses[i - 1], omega * links.link_damping[i - 1])
        link = complex(links.stiffnesses[i], omega * links.link_damping[i])
        matrix.diagonal[i] = before + link - omega * omega * links.masses[i]
        matrix.upper[i] = -link
        matrix.lower[i] = -link


@kernel
def _add_step(step: Complexes, high: Floats, low: Floats) -> tuple[float, float, bool]:
    """Add a step (N,) to the solution `high` + `low`, each (N, 2), in place.

    Returns
    -------
    largest, largest_step : float
        Largest moduli, as sums of the moduli of real and imaginary part, of solution and step.
    finite : bool
        Whether all numbers of the step are finite.
    """
    largest = 0.0
    largest_step = 0.0
    finite = True
    for i in range(step.size):
        finite = finite and np.isfinite(step[i].real) and np.isfinite(step[i].imag)
        high[i, 0], low[i, 0] = dd_add(high[i, 0], low[i, 0], step[i].real, 0.0)
        high[i, 1], low[i, 1] = dd_add(high[i, 1], low[i, 1], step[i].imag, 0.0)
        largest = max(largest, abs(high[i, 0]) + abs(high[i, 1]))
        largest_step = max(largest_step, abs(step[i].real) + abs(step[i].imag))
    return largest, largest_step, finite


@kernel
def _refine(
    links: Links,
    omega: float,
    forces: Complexes,
    row: Floats,
    factors: Factors,
    step: Complexes,
    high: Floats,
    low: Floats,
) -> bool:
    """Write the solution to `high` + `low`, each (N, 2), starting from the first solution `step`, which is overwritten.

    Returns whether the iterative refinement converged; it continues until ``row x`` is accurate.
    """
    high[:] = 0.0
    low[:] = 0.0
    largest_step = 0.0
    largest = 0.0
    remaining = 0.0
    for refinement in range(STEADY_REFINEMENT_STEPS + 1):
        previous_step = largest_step
        largest, largest_step, finite = _add_step(step, high, low)
        if not finite:
            remaining = np.inf
            break
        if largest == 0.0:  # no forcing
            break
        # the next step would be smaller than this one by the same factor as this one was
        remaining = largest if refinement == 0 else largest_step * (largest_step / previous_step)
        real, imag = 0.0, 0.0
        for i in range(row.size):
            real += row[i] * high[i, 0]
            imag += row[i] * high[i, 1]
        if remaining <= STEADY_ACCURACY * max(abs(real) + abs(imag), STEADY_ACCURACY * largest):
            break
        residual(links, omega, forces, high, low, step)
        solve(factors, step)
    converged: bool = remaining <= STEADY_DIVERGED * largest
    return converged


@njit(cache=True, nogil=True, error_model="numpy")
def steady_amplitudes(
    links: Links, omega: Floats, forces: Complexes, row: Floats
) -> tuple[Complexes, Complexes, Integers]:
    """Return the response to ``Im(f e^{i omega t})`` as complex amplitudes, x(t) = Im(amplitude e^{i omega t}).

    Parameters
    ----------
    links : Links
    omega : ndarray of shape (n,)
    forces : ndarray of complex, shape (n, N)
        f at every omega.
    row : ndarray of shape (N,)

    Returns
    -------
    amplitudes : ndarray of complex, shape (n, N)
    coordinate : ndarray of complex, shape (n,)
        ``row x``, to about one rounding also where its terms cancel.
    status : ndarray of int, shape (n,)
        REFINED or RESONANT.
    """
    count = links.masses.size
    amplitudes = np.zeros((omega.size, count), dtype=np.complex128)
    coordinate = np.zeros(omega.size, dtype=np.complex128)
    status = np.zeros(omega.size, dtype=np.int64)
    factors = Factors(
        np.empty(count, dtype=np.complex128),
        np.empty(count, dtype=np.complex128),
        np.empty(count, dtype=np.complex128),
        np.zeros(count, dtype=np.complex128),
        np.zeros(count, dtype=np.bool_),
    )
    step = np.empty(count, dtype=np.complex128)
    high = np.empty((count, 2))
    low = np.empty((count, 2))
    for point in range(omega.size):
        _set_matrix(links, omega[point], factors)
        for i in range(count):
            step[i] = forces[point, i]
        if not factor(factors):
            status[point] = RESONANT
            continue
        solve(factors, step)
        if not _refine(links, omega[point], forces[point], row, factors, step, high, low):
            status[point] = RESONANT
            continue
        for i in range(count):
            amplitudes[point, i] = complex(high[i, 0] + low[i, 0], high[i, 1] + low[i, 1])
        real_high, real_low, imag_high, imag_low = 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            a_high, a_low = dd_scale(high[i, 0], low[i, 0], row[i])
            real_high, real_low = dd_add(real_high, real_low, a_high, a_low)
            a_high, a_low = dd_scale(high[i, 1], low[i, 1], row[i])
            imag_high, imag_low = dd_add(imag_high, imag_low, a_high, a_low)
        coordinate[point] = complex(real_high + real_low, imag_high + imag_low)
    return amplitudes, coordinate, status
