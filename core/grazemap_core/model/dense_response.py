"""Steady response of a structure with dense matrices, with residuals in double-double.

As `grazemap_core.model.kernels.tridiagonal` for chains: the residuals are computed from the given numbers, so that a
resonance does not amplify the rounding of ``K - w^2 M + i w C``.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.model.structure import Response
from grazemap_core.model.tolerances import STEADY_ACCURACY, STEADY_DIVERGED, STEADY_REFINEMENT_STEPS
from grazemap_core.numerics.double_double_arrays import Pair, add, exact, multiply, negative, product, transformed

_SOLVED_AT_ONCE = 1 << 20
"""Entries of the matrices that are inverted together: 16 MiB."""

_RealMatrices = tuple[Floats, Floats, Floats]


def dense_response(matrices: _RealMatrices, frequencies: Floats, forces: Complexes, row: Floats) -> Response:
    """Return the response of the structure with matrices M, C and K, each (N, N); see `Structure.response`."""
    chunk = max(1, _SOLVED_AT_ONCE // len(row) ** 2)
    parts = [
        _response(matrices, frequencies[i : i + chunk], forces[i : i + chunk], row)
        for i in range(0, len(frequencies), chunk)
    ]
    if not parts:
        return Response(np.zeros_like(forces), np.zeros(0, np.complex128), np.zeros(0, np.bool_))
    return Response(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _response(matrices: _RealMatrices, frequencies: Floats, forces: Complexes, row: Floats) -> Response:
    mass, damping, stiffness = matrices
    count, size = len(frequencies), len(row)
    w = frequencies[:, None, None]
    dynamic = stiffness - w * w * mass + 1j * w * damping
    inverse, exists = _inverses(dynamic)
    # x as pairs of shape (N, 2 n): the real parts at all frequencies, then the imaginary ones
    x = exact(np.zeros((size, 2 * count)))
    residual = forces
    remaining, previous = np.full(count, np.inf), np.full(count, np.inf)
    for refinement in range(STEADY_REFINEMENT_STEPS + 1):
        step = np.einsum("nij,nj->ni", inverse, residual)
        x = add(x, exact(np.concatenate((step.real, step.imag)).T))
        largest = np.max(_moduli(x.high, count), axis=0)
        taken = np.max(np.abs(step.real) + np.abs(step.imag), axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            remaining = largest if refinement == 0 else np.where(taken > 0.0, taken * (taken / previous), 0.0)
        previous = taken
        seen = _moduli(row @ x.high, count)
        if np.all(~exists | (remaining <= STEADY_ACCURACY * np.maximum(seen, STEADY_ACCURACY * largest))):
            break
        residual = _residual(matrices, frequencies, forces, x)
    exists = exists & (remaining <= STEADY_DIVERGED * largest)
    coordinate = transformed(row[None], x).rounded[0]
    displacement = x.rounded
    amplitudes = (displacement[:, :count] + 1j * displacement[:, count:]).T
    return Response(
        np.where(exists[:, None], amplitudes, 0.0),
        np.where(exists, coordinate[:count] + 1j * coordinate[count:], 0.0),
        exists,
    )


def _inverses(dynamic: Complexes) -> tuple[Complexes, Booleans]:
    """Return the inverses of matrices (n, N, N), and which of them have one."""
    try:
        return np.linalg.inv(dynamic).astype(np.complex128), np.ones(len(dynamic), dtype=np.bool_)
    except np.linalg.LinAlgError:
        if len(dynamic) == 1:
            return np.zeros_like(dynamic), np.zeros(1, dtype=np.bool_)
        each = [_inverses(matrix[None]) for matrix in dynamic]
        return np.concatenate([inverse for inverse, _ in each]), np.concatenate([exists for _, exists in each])


def _moduli(values: Floats, count: int) -> Floats:
    """Return |real| + |imaginary| of values whose last axis holds the real parts, then the imaginary ones."""
    return np.abs(values[..., :count]) + np.abs(values[..., count:])


def _residual(matrices: _RealMatrices, frequencies: Floats, forces: Complexes, x: Pair) -> Complexes:
    """Return ``f - (K - w^2 M + i w C) x`` of pairs (N, 2 n), rounded once; shape (n, N)."""
    mass, damping, stiffness = matrices
    count = len(frequencies)
    both = np.concatenate((frequencies, frequencies))
    square = product(both, both)
    inertia = multiply(square, transformed(mass, x))
    # i w C x has the real part -w C x_imag and the imaginary part w C x_real
    swapped = Pair(
        np.concatenate((-x.high[:, count:], x.high[:, :count]), axis=1),
        np.concatenate((-x.low[:, count:], x.low[:, :count]), axis=1),
    )
    viscous = multiply(exact(both), transformed(damping, swapped))
    load = exact(np.concatenate((forces.real, forces.imag)).T)
    result = add(add(load, inertia), negative(add(transformed(stiffness, x), viscous))).rounded
    return np.asarray((result[:, :count] + 1j * result[:, count:]).T)
