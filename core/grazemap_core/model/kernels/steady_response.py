"""Steady response of a structure at many forcing frequencies, accurate to round-off also at sharp resonances.

The matrix ``K - w^2 M + i w C`` is factored with partial pivoting, because a part of the structure may resonate by
itself. The solution is refined with residuals in double-double that are computed from the elements, so that a resonance
does not amplify the rounding of the matrix entries. The factors decide only how many steps this takes.

References
----------
Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), chapter 12.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.model.kernels.elements import Elements
from grazemap_core.model.tolerances import STEADY_ACCURACY, STEADY_DIVERGED, STEADY_REFINEMENT_STEPS
from grazemap_core.numerics.jit.compiled import inlined, kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.numerics.kernels.banded import factor, solve
from grazemap_core.numerics.kernels.double_double import Pair, add, multiply, negative, scale, two_prod
from grazemap_core.records import NamedTuple


class System(NamedTuple):
    """The equations ``(K - w^2 M + i w C) x = f`` at one frequency, and their solution."""

    elements: Elements
    """The structure."""
    stiffnesses: Floats
    """(E, 4) The dynamic stiffness ``k - w^2 m + i w c`` of every element: high and low of the real part, then of the
    imaginary part."""
    factors: Complexes
    """(N, 3 reach + 1) The factored matrix, as `grazemap_core.numerics.kernels.banded` has it."""
    pivots: Integers
    """(N,) Of the factorisation."""
    solution: Floats
    """(N, 4) x, in four numbers as the stiffnesses."""
    rest: Floats
    """(N, 4) ``f - (K - w^2 M + i w C) x``, likewise."""


@inlined
def _pair(numbers: Floats, row: int, part: int) -> Pair[float]:
    """Return the real part of a row of four numbers (part 0), or the imaginary part (1)."""
    return Pair(numbers[row, 2 * part], numbers[row, 2 * part + 1])


@inlined
def _add_to(numbers: Floats, row: int, part: int, change: Pair[float]) -> None:
    numbers[row, 2 * part], numbers[row, 2 * part + 1] = add(_pair(numbers, row, part), change)


@kernel
def _set_frequency(system: System, frequency: float) -> None:
    """Write the dynamic stiffnesses at a frequency, and the sum of all as a matrix to `factors`."""
    elements, stiffnesses, matrix, reach = system.elements, system.stiffnesses, system.factors, system.elements.reach
    square = two_prod(frequency, frequency)
    matrix[:] = 0.0
    for e in range(elements.mass.size):
        real = add(Pair(elements.stiffness[e], 0.0), negative(scale(square, elements.mass[e])))
        imag = two_prod(frequency, elements.damping[e])
        stiffnesses[e, 0], stiffnesses[e, 1] = real
        stiffnesses[e, 2], stiffnesses[e, 3] = imag
        for row_side in range(2):
            for column_side in range(2):
                row, column = elements.acts_on[e, row_side], elements.stretched_by[e, column_side]
                if row < matrix.shape[0] and column < matrix.shape[0]:
                    sign = 1.0 if row_side == column_side else -1.0
                    matrix[row, column - row + reach] += sign * complex(real.high, imag.high)


@kernel
def _residual(system: System, forces: Complexes, residual: Complexes) -> None:
    """Write ``f - (K - w^2 M + i w C) x`` to `residual` (N,), rounded once; `forces` (N,) is f."""
    elements, stiffnesses, x, rest = system.elements, system.stiffnesses, system.solution, system.rest
    count = x.shape[0]
    for i in range(count):
        rest[i, 0], rest[i, 1] = forces[i].real, 0.0
        rest[i, 2], rest[i, 3] = forces[i].imag, 0.0
    for e in range(elements.mass.size):
        i, j = elements.stretched_by[e, 0], elements.stretched_by[e, 1]
        stretch_real, stretch_imag = _pair(x, i, 0), _pair(x, i, 1)
        if j < count:
            stretch_real = add(stretch_real, negative(_pair(x, j, 0)))
            stretch_imag = add(stretch_imag, negative(_pair(x, j, 1)))
        stiff, viscous = _pair(stiffnesses, e, 0), _pair(stiffnesses, e, 1)
        force_real, force_imag = multiply(stiff, stretch_real), multiply(stiff, stretch_imag)
        if viscous.high != 0.0:
            force_real = add(force_real, negative(multiply(viscous, stretch_imag)))
            force_imag = add(force_imag, multiply(viscous, stretch_real))
        for side in range(2):
            on = elements.acts_on[e, side]
            force_real, force_imag = negative(force_real), negative(force_imag)
            if on < count:
                _add_to(rest, on, 0, force_real)
                _add_to(rest, on, 1, force_imag)
    for i in range(count):
        residual[i] = complex(rest[i, 0] + rest[i, 1], rest[i, 2] + rest[i, 3])


@kernel
def _take(system: System, step: Complexes) -> tuple[float, float]:
    """Add a step (N,) to the solution, and return the largest moduli of solution and step, |real| + |imaginary|.

    That of the step is infinite if a number of it is not finite.
    """
    x = system.solution
    largest, largest_step = 0.0, 0.0
    for i in range(step.size):
        _add_to(x, i, 0, Pair(step[i].real, 0.0))
        _add_to(x, i, 1, Pair(step[i].imag, 0.0))
        modulus = abs(step[i].real) + abs(step[i].imag)
        largest = max(largest, abs(x[i, 0]) + abs(x[i, 2]))
        largest_step = max(largest_step, modulus) if np.isfinite(modulus) else np.inf
    return largest, largest_step


@kernel
def _refine(system: System, forces: Complexes, row: Floats, step: Complexes) -> bool:
    """Write the solution for `forces` (N,), refined until ``row x`` is accurate; `step` (N,) is scratch.

    Returns whether the iterative refinement converged.
    """
    system.solution[:] = 0.0
    for i in range(step.size):
        step[i] = forces[i]
    taken = 0.0
    remaining = np.inf
    for refinement in range(STEADY_REFINEMENT_STEPS + 1):
        solve(system.factors, system.elements.reach, system.pivots, step)
        previous = taken
        largest, taken = _take(system, step)
        if largest == 0.0:  # no forcing
            return True
        if not np.isfinite(taken):
            return False
        # the next step would be smaller than this one by the same factor as this one was
        remaining = largest if refinement == 0 else taken * (taken / previous)
        real, imag = 0.0, 0.0
        for i in range(row.size):
            real += row[i] * system.solution[i, 0]
            imag += row[i] * system.solution[i, 2]
        if remaining <= STEADY_ACCURACY * max(abs(real) + abs(imag), STEADY_ACCURACY * largest):
            return True
        _residual(system, forces, step)
    return bool(remaining <= STEADY_DIVERGED * largest)


@njit(cache=True, nogil=True, error_model="numpy")
def steady_amplitudes(
    elements: Elements, frequencies: Floats, forces: Complexes, row: Floats
) -> tuple[Complexes, Complexes, Booleans]:
    """Return the response to ``Im(f e^{i w t})`` as complex amplitudes, x(t) = Im(amplitude e^{i w t}).

    Parameters
    ----------
    elements : Elements
    frequencies : ndarray of shape (n,)
        w; 0 gives the static displacements.
    forces : ndarray of complex, shape (n, N)
        f at every frequency.
    row : ndarray of shape (N,)
        A row of zeros has all displacements refined to double-double.

    Returns
    -------
    amplitudes : ndarray of complex, shape (n, N)
        Zero where there is no steady motion.
    coordinate : ndarray of complex, shape (n,)
        ``row x``, to about one rounding also where its terms cancel.
    exists : ndarray of bool, shape (n,)
        False if the matrix is singular, or so nearly that refinement does not converge: there is no steady motion.
    """
    count = row.size
    amplitudes = np.zeros((frequencies.size, count), dtype=np.complex128)
    coordinate = np.zeros(frequencies.size, dtype=np.complex128)
    exists = np.zeros(frequencies.size, dtype=np.bool_)
    whole = System(
        elements,
        np.empty((elements.mass.size, 4)),
        np.empty((count, 3 * elements.reach + 1), dtype=np.complex128),
        np.empty(count, dtype=np.int64),
        np.empty((count, 4)),
        np.empty((count, 4)),
    )
    system, x = reference(whole), whole.solution
    step = np.empty(count, dtype=np.complex128)
    for n in range(frequencies.size):
        _set_frequency(system, frequencies[n])
        exists[n] = factor(whole.factors, elements.reach, whole.pivots) and _refine(system, forces[n], row, step)
        if not exists[n]:
            continue
        real, imag = Pair(0.0, 0.0), Pair(0.0, 0.0)
        for i in range(count):
            amplitudes[n, i] = complex(x[i, 0] + x[i, 1], x[i, 2] + x[i, 3])
            real = add(real, scale(_pair(x, i, 0), row[i]))
            imag = add(imag, scale(_pair(x, i, 1), row[i]))
        coordinate[n] = complex(real.high + real.low, imag.high + imag.low)
    return amplitudes, coordinate, exists
