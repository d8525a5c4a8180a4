"""Extrapolation of the fixed point of the return map from the last returns of a convergent trajectory.

Close to a periodic orbit the return map is linear, and as many returns as it has relevant eigenvalues determine its
fixed point (minimal polynomial extrapolation): with d_i the change at the return i returns ago, the least-squares
solution of

    d_0 = c_1 d_1 + ... + c_q d_q

makes x = (z_0 - c_1 z_1 - ... - c_q z_q) / (1 - c_1 - ... - c_q) the fixed point, and the zeros of
l^q - c_1 l^(q-1) - ... - c_q its multipliers; all of them must lie inside the unit circle, because a
trajectory may approach an unstable orbit for a long time. The smallest q that fits the changes is taken.

The result is not verified: a trajectory that is restarted there must close.

References
----------
S. Cabay, L. W. Jackson, "A polynomial extrapolation method for finding limits and antilimits of vector sequences", SIAM
Journal on Numerical Analysis 13 (1976) 734-752.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory
from grazemap_core.simulation.tolerances import APPROACH_RATE, CHANGES_FIT, DEPENDENT


class Extrapolation(NamedTuple):
    """Scratch for N blocks.

    Attributes
    ----------
    changes : (2 N + 1, 2 N)
        The changes at the last returns, in the units of `CellProblem.displacement_scale`, the last one first.
    basis : (2 N + 1, 2 N)
        The same, each minus its projection on the previous ones.
    shares : (2 N + 1, 2 N + 1)
        Coefficients of these projections.
    weights, coefficients : (2 N + 1,)
    limit : (2 N,)
        Receives the extrapolated state.
    """

    changes: Floats
    basis: Floats
    shares: Floats
    weights: Floats
    coefficients: Floats
    limit: Floats


def extrapolation(blocks: int) -> Extrapolation:
    """Return scratch for an oscillator."""
    size = 2 * blocks
    return Extrapolation(
        changes=np.zeros((size + 1, size)),
        basis=np.zeros((size + 1, size)),
        shares=np.zeros((size + 1, size + 1)),
        weights=np.zeros(size + 1),
        coefficients=np.zeros(size + 1),
        limit=np.zeros(size),
    )


@kernel
def _fit(scratch: Extrapolation, max_terms: int) -> int:
    """Write weights c_1 .. c_q that express the last change by the previous ones, and return q; 0 if none fit.

    The changes are orthogonalised one after the other (Gram-Schmidt).
    """
    changes, basis, shares, weights = scratch.changes, scratch.basis, scratch.shares, scratch.weights
    size = changes.shape[1]
    whole = 0.0
    for c in range(size):
        basis[0, c] = changes[0, c]
        whole += changes[0, c] * changes[0, c]
    for q in range(1, max_terms + 1):
        before = 0.0
        for c in range(size):
            basis[q, c] = changes[q, c]
            before += changes[q, c] * changes[q, c]
        for i in range(1, q):
            along = 0.0
            for c in range(size):
                along += basis[i, c] * basis[q, c]
            along /= shares[i, i]
            shares[i, q] = along
            for c in range(size):
                basis[q, c] -= along * basis[i, c]
        square, along = 0.0, 0.0
        for c in range(size):
            square += basis[q, c] * basis[q, c]
            along += basis[q, c] * basis[0, c]
        if not square > DEPENDENT * DEPENDENT * before:
            return 0
        shares[q, q] = square
        shares[q, 0] = along / square
        left = 0.0
        for c in range(size):
            basis[0, c] -= shares[q, 0] * basis[q, c]
            left += basis[0, c] * basis[0, c]
        if left <= CHANGES_FIT * CHANGES_FIT * whole or q == size:
            for i in range(q, 0, -1):
                weights[i] = shares[i, 0]
                for j in range(i + 1, q + 1):
                    weights[i] -= shares[i, j] * weights[j]
            return q
    return 0


@kernel
def _is_stable(scratch: Extrapolation, count: int) -> bool:
    """Return whether all multipliers of c_1 .. c_q are smaller than APPROACH_RATE, by the Schur-Cohn test."""
    a = scratch.coefficients
    a[0] = 1.0
    scale = 1.0
    for i in range(1, count + 1):
        scale /= APPROACH_RATE
        a[i] = -scratch.weights[i] * scale
    for degree in range(count, 0, -1):
        ratio = a[degree] / a[0]
        if not abs(ratio) < 1.0:
            return False
        for i in range((degree + 1) // 2):
            first, last = a[i], a[degree - i]
            a[i], a[degree - i] = first - ratio * last, last - ratio * first
        if degree % 2 == 0:
            a[degree // 2] -= ratio * a[degree // 2]
    return True


@kernel
def extrapolate(
    problem: CellProblem, ring: StroboscopicHistory, scratch: Extrapolation, lane: int, k: int, m: int, known: int
) -> float:
    """Write the limit of the stroboscopic states of a lane into scratch.limit, and return its distance.

    Parameters
    ----------
    m : int
        Half periods after which the orbit returns.
    known : int
        Half periods of the lane that the ring contains.

    Returns
    -------
    The distance of the limit from the last state, as a displacement; infinite if the limit is not determined.
    """
    size, rows = scratch.changes.shape[1], ring.min_speed.shape[0]
    max_terms = min(size, known // m - 1)
    if max_terms < 1:
        return np.inf
    for i in range(max_terms + 1):
        now, then = (k - i * m) % rows, (k - (i + 1) * m) % rows
        for c in range(size):
            change = ring.states[now, c, lane] - ring.states[then, c, lane]
            scratch.changes[i, c] = change * problem.displacement_scale[c // 2, c % 2]
    count = _fit(scratch, max_terms)
    if count == 0 or not _is_stable(scratch, count):
        return np.inf
    whole = 1.0
    for i in range(1, count + 1):
        whole -= scratch.weights[i]
    farthest = 0.0
    for c in range(size):
        moved, back = 0.0, 0.0
        for i in range(1, count + 1):
            back += scratch.changes[i - 1, c]
            moved += scratch.weights[i] * back
        moved /= whole
        farthest = max(farthest, abs(moved))
        scratch.limit[c] = ring.states[k % rows, c, lane] + moved / problem.displacement_scale[c // 2, c % 2]
    return farthest
