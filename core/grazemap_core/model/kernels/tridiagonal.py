"""Steady response of a chain at many forcing frequencies, right to round-off also at sharp resonances.

In flow the chain's numbers and frequencies, out flow complex amplitudes and a status for each frequency. The matrix
``K - omega^2 M + i omega C`` is complex, symmetric and tridiagonal; it is factored with partial pivoting, because a
part of the chain may resonate by itself, and the solution is refined with residuals in double-double that start from
the given numbers, so that the rounding of the matrix entries themselves, which a resonance would amplify, is undone.

References
----------
Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), chapters 9.6 (tridiagonal) and 12 (refinement).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.model.tolerances import STEADY_ACCURACY, STEADY_DIVERGED, STEADY_REFINEMENT_STEPS
from grazemap_core.numerics.kernels.double_double import dd_add, dd_scale, two_prod, two_sum

CONVERGED = 0
"""The amplitudes are right to round-off."""
RESONANT = 1
"""The matrix is singular, or so nearly that refinement does not converge: no steady motion to speak of."""


@njit(cache=True, nogil=True, error_model="numpy")
def factor(lower: Complexes, diagonal: Complexes, upper: Complexes, second: Complexes, swapped: Booleans) -> bool:
    """Factor a tridiagonal matrix in place with partial pivoting, as LAPACK's gttrf does.

    Parameters
    ----------
    lower, diagonal, upper : ndarray of shape (N,)
        On return the multipliers, and the first two diagonals of the upper triangle. The last entries of `lower` and
        `upper` are not used.
    second : ndarray of shape (N,)
        On return the third diagonal of the upper triangle.
    swapped : ndarray of bool, shape (N,)
        On return whether rows i and i + 1 changed places.

    Returns
    -------
    bool
        False when a pivot is exactly zero.
    """
    count = diagonal.size
    for i in range(count - 1):
        second[i] = 0.0
        here, below = diagonal[i], lower[i]
        if abs(here.real) + abs(here.imag) >= abs(below.real) + abs(below.imag):
            swapped[i] = False
            if here == 0.0:
                return False
            multiplier = below / here
            lower[i] = multiplier
            diagonal[i + 1] -= multiplier * upper[i]
        else:
            swapped[i] = True
            multiplier = here / below
            diagonal[i] = below
            lower[i] = multiplier
            next_diagonal = diagonal[i + 1]
            diagonal[i + 1] = upper[i] - multiplier * next_diagonal
            upper[i] = next_diagonal
            if i + 2 < count:
                second[i] = upper[i + 1]
                upper[i + 1] = -multiplier * second[i]
    return bool(diagonal[count - 1] != 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def solve(
    lower: Complexes,
    diagonal: Complexes,
    upper: Complexes,
    second: Complexes,
    swapped: Booleans,
    vector: Complexes,
) -> None:
    """Solve with what `factor` left; `vector` of shape (N,) is the right side and becomes the solution."""
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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _dd_product(a_high: float, a_low: float, b_high: float, b_low: float) -> tuple[float, float]:
    high, error = two_prod(a_high, b_high)
    return two_sum(high, error + (a_high * b_low + a_low * b_high))


@njit(cache=True, nogil=True, error_model="numpy")
def residual(
    masses: Floats,
    stiffnesses: Floats,
    link_damping: Floats,
    forcing: Floats,
    omega: float,
    high: Floats,
    low: Floats,
    out: Complexes,
    wall_stiffness: float,
    wall_damping: float,
) -> None:
    """Write ``f - (K - omega^2 M + i omega C) x`` to `out` of shape (N,), in double-double until the end.

    `high` + `low`, each of shape (N, 2), is x: real and imaginary parts. The wall as in `steady_amplitudes`.
    """
    count = masses.size
    square_high, square_low = two_prod(omega, omega)
    real_high, real_low, imag_high, imag_low = 0.0, 0.0, 0.0, 0.0  # force in the link before
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
        # f + omega^2 m x + link before - link behind
        inertia_high, inertia_low = dd_scale(square_high, square_low, masses[i])
        a_high, a_low = _dd_product(inertia_high, inertia_low, high[i, 0], low[i, 0])
        a_high, a_low = dd_add(a_high, a_low, forcing[i], 0.0)
        b_high, b_low = dd_add(real_high, real_low, -link_re_high, -link_re_low)
        a_high, a_low = dd_add(a_high, a_low, b_high, b_low)
        real = a_high + a_low
        a_high, a_low = _dd_product(inertia_high, inertia_low, high[i, 1], low[i, 1])
        b_high, b_low = dd_add(imag_high, imag_low, -link_im_high, -link_im_low)
        a_high, a_low = dd_add(a_high, a_low, b_high, b_low)
        out[i] = complex(real, a_high + a_low)
        real_high, real_low, imag_high, imag_low = link_re_high, link_re_low, link_im_high, link_im_low


@njit(cache=True, nogil=True, error_model="numpy")
def steady_amplitudes(
    masses: Floats,
    stiffnesses: Floats,
    link_damping: Floats,
    forcing: Floats,
    omega: Floats,
    wall_stiffness: float = 0.0,
    wall_damping: float = 0.0,
) -> tuple[Complexes, Integers]:
    """Return the response to ``f sin(omega t)`` as complex amplitudes, x(t) = Im(amplitude e^{i omega t}).

    Parameters
    ----------
    masses, stiffnesses, link_damping, forcing : ndarray of shape (N,)
    omega : ndarray of shape (n,)
    wall_stiffness, wall_damping : float
        Of the link that holds the first mass to a wall; 0 when there is none.

    Returns
    -------
    amplitudes : ndarray of complex, shape (n, N)
    status : ndarray of int, shape (n,)
        CONVERGED or RESONANT.
    """
    count = masses.size
    amplitudes = np.zeros((omega.size, count), dtype=np.complex128)
    status = np.zeros(omega.size, dtype=np.int64)
    lower = np.empty(count, dtype=np.complex128)
    diagonal = np.empty(count, dtype=np.complex128)
    upper = np.empty(count, dtype=np.complex128)
    second = np.zeros(count, dtype=np.complex128)
    swapped = np.zeros(count, dtype=np.bool_)
    step = np.empty(count, dtype=np.complex128)
    high = np.empty((count, 2))
    low = np.empty((count, 2))

    for point in range(omega.size):
        frequency = omega[point]
        for i in range(count):
            before = complex(wall_stiffness, frequency * wall_damping)
            if i > 0:
                before = complex(stiffnesses[i - 1], frequency * link_damping[i - 1])
            link = complex(stiffnesses[i], frequency * link_damping[i])
            diagonal[i] = before + link - frequency * frequency * masses[i]
            upper[i] = -link
            lower[i] = -link
            step[i] = forcing[i]
            high[i, 0] = high[i, 1] = low[i, 0] = low[i, 1] = 0.0
        if not factor(lower, diagonal, upper, second, swapped):
            status[point] = RESONANT
            continue
        solve(lower, diagonal, upper, second, swapped, step)

        largest_step = 0.0
        largest = 0.0
        remaining = 0.0
        for refinement in range(STEADY_REFINEMENT_STEPS + 1):
            previous_step = largest_step
            largest = 0.0
            largest_step = 0.0
            finite = True
            for i in range(count):
                finite = finite and np.isfinite(step[i].real) and np.isfinite(step[i].imag)
                high[i, 0], low[i, 0] = dd_add(high[i, 0], low[i, 0], step[i].real, 0.0)
                high[i, 1], low[i, 1] = dd_add(high[i, 1], low[i, 1], step[i].imag, 0.0)
                largest = max(largest, abs(high[i, 0]) + abs(high[i, 1]))
                largest_step = max(largest_step, abs(step[i].real) + abs(step[i].imag))
            if not finite:
                remaining = np.inf
                break
            if largest == 0.0:  # no forcing
                break
            # the next step would be smaller than this one by the same factor as this one was
            remaining = largest if refinement == 0 else largest_step * (largest_step / previous_step)
            first = abs(high[0, 0]) + abs(high[0, 1])
            if remaining <= STEADY_ACCURACY * max(first, STEADY_ACCURACY * largest):
                break
            residual(
                masses,
                stiffnesses,
                link_damping,
                forcing,
                frequency,
                high,
                low,
                step,
                wall_stiffness,
                wall_damping,
            )
            solve(lower, diagonal, upper, second, swapped, step)
        if not remaining <= STEADY_DIVERGED * largest:
            status[point] = RESONANT
            continue
        for i in range(count):
            amplitudes[point, i] = complex(high[i, 0] + low[i, 0], high[i, 1] + low[i, 1])
    return amplitudes, status
