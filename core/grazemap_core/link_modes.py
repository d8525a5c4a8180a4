"""Second-order blocks of a chain that is damped link by link.

An oscillator flows in; out flow, for each of N pairs of exponents, the pair's product and sum and two columns (a, b)
such that the state is ``a u + b u'``. The first-order system is set up in energy coordinates, where it is a
skew-symmetric matrix minus a positive semidefinite one; an ordered Schur form gives each block's subspace without ever
using two nearly parallel eigenvectors; Newton steps with residuals in double-double then remove what the
Schur form has lost (on a stiff chain its backward error is relative to the fastest exponent).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.linalg import lapack, schur

from grazemap_core.errors import ConditioningError
from grazemap_core.kernels.chain_residual import invariance_residual
from grazemap_core.oscillator import Floats, Oscillator
from grazemap_core.tolerances import MODAL_CONDITION_LIMIT, MODAL_REFINEMENT_GOAL, MODAL_REFINEMENT_STEPS

Pairs = list[tuple[int, int]]

_NEARLY_DEFECTIVE = (
    "two modes of this chain nearly coincide in frequency, decay and shape, and the modal model would lose digits; "
    "change one of the link dampings slightly"
)


@dataclass(frozen=True, eq=False)
class LinkBlocks:
    """Blocks in no particular order; rows of `columns` are link elongations, then velocities, shape (2N, 2N)."""

    frequency_squared: Floats
    decay: Floats
    discriminant: Floats
    columns: Floats
    conditioning: float


def link_blocks(oscillator: Oscillator) -> LinkBlocks:
    """Return the blocks of a chain that is damped link by link.

    Raises
    ------
    ConditioningError
        Two blocks are nearly defective together.
    """
    weights = np.sqrt(np.concatenate((oscillator.stiffnesses, oscillator.masses)))
    matrix = _energy_matrix(oscillator)
    triangular, basis = schur(matrix, output="real")
    best: LinkBlocks | None = None
    for pairs in _pairings(matrix, triangular):
        start = _initial(triangular, basis, pairs, weights)
        blocks = _refine(oscillator, weights, *start)
        if best is None or blocks.conditioning < best.conditioning:
            best = blocks
        if best.conditioning < np.sqrt(MODAL_CONDITION_LIMIT):
            break
    if best is None or not best.conditioning <= MODAL_CONDITION_LIMIT:
        raise ConditioningError(_NEARLY_DEFECTIVE)
    return best


def _energy_matrix(oscillator: Oscillator) -> Floats:
    """Return A of ``z' = A z``, where z holds ``sqrt(k_i) (x_i - x_{i+1})`` and ``sqrt(m_i) v_i``; shape (2N, 2N)."""
    mass, stiffness = oscillator.masses, oscillator.stiffnesses
    bidiagonal = np.diag(np.sqrt(stiffness / mass)) - np.diag(np.sqrt(stiffness[:-1] / mass[1:]), 1)
    ratios = oscillator.link_damping / stiffness
    return np.block(
        [[np.zeros_like(bidiagonal), bidiagonal], [-bidiagonal.T, -bidiagonal.T @ (ratios[:, None] * bidiagonal)]]
    )


def _pairings(matrix: Floats, triangular: Floats) -> list[Pairs]:
    """Return ways to pair the exponents, best guess first; entries are positions on the Schur form's diagonal.

    Complex pairs are given. Real exponents that are nearly defective together have nearly parallel eigenvectors and
    must share a block; real exponents that are close but independent had better not, because (u, u') coordinates of
    theirs are nearly dependent. So the most parallel ones are paired first; the closest ones and the two halves of
    the sorted list are the alternatives.
    """
    size = len(triangular)
    subdiagonal = np.append(np.diag(triangular, -1), 0.0)
    complex_pairs: Pairs = [(i, i + 1) for i in range(size - 1) if subdiagonal[i] != 0.0]
    taken = {i for pair in complex_pairs for i in pair}
    real = sorted((i for i in range(size) if i not in taken), key=lambda i: float(triangular[i, i]))
    if len(real) <= 2:
        return [complex_pairs + ([(real[0], real[1])] if real else [])]

    values = np.array([triangular[i, i] for i in real])
    exponents, vectors = np.linalg.eig(matrix)
    nearest = [int(np.argmin(np.abs(exponents - value))) for value in values]
    directions = np.real(vectors[:, nearest])
    parallel = 1.0 - np.abs(directions.T @ directions)
    distance = np.abs(values[:, None] - values) / np.abs(values[:, None] + values)
    half = len(real) // 2
    return [
        complex_pairs + _greedy(real, parallel),
        complex_pairs + _greedy(real, distance),
        complex_pairs + list(zip(real[:half], real[half:], strict=True)),
    ]


def _greedy(labels: list[int], cost: Floats) -> Pairs:
    """Pair the labels, cheapest pair first."""
    rows, cols = np.triu_indices(len(labels), 1)
    free = set(range(len(labels)))
    pairs: Pairs = []
    for k in np.argsort(cost[rows, cols], kind="stable"):
        i, j = int(rows[k]), int(cols[k])
        if i in free and j in free:
            free -= {i, j}
            pairs.append((labels[i], labels[j]))
    return pairs


def _initial(triangular: Floats, basis: Floats, pairs: Pairs, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """Return columns (rows elongations and velocities), frequency_squared and decay of every block."""
    size = len(triangular)
    count = size // 2
    columns = np.empty((size, size))
    frequency_squared = np.empty(count)
    decay = np.empty(count)
    for j, pair in enumerate(pairs):
        select = np.zeros(size, dtype=np.int32)
        select[list(pair)] = 1
        moved, vectors, *_, info = lapack.dtrsen(select, triangular, basis, job=b"N", lwork=max(1, size), liwork=1)
        if info != 0:
            raise ConditioningError(_NEARLY_DEFECTIVE)
        block, subspace = moved[:2, :2], vectors[:, :2]
        half_sum = 0.5 * (block[0, 0] + block[1, 1])
        half_difference = 0.5 * (block[0, 0] - block[1, 1])
        decay[j] = -half_sum
        frequency_squared[j] = half_sum**2 - half_difference**2 - block[0, 1] * block[1, 0]
        shifted = block - 2.0 * half_sum * np.eye(2)
        direction = _companion_direction(shifted, subspace[:count])
        columns[:, 2 * j] = subspace @ (shifted @ direction) / weights
        columns[:, 2 * j + 1] = subspace @ direction / weights
    return columns, frequency_squared, decay


def _companion_direction(shifted: Floats, displacements: Floats) -> Floats:
    """Return the unit vector beta for which ``(shifted beta, beta)`` is a good basis of the block.

    First choice is the one with the least displacement, the classical mode's; if the two would be nearly parallel, the
    one on which the symmetric part of `shifted` is smallest.
    """
    classical = np.linalg.svd(displacements)[2][1]
    symmetric = 0.5 * (shifted + shifted.T)
    values, vectors = np.linalg.eigh(symmetric)
    other = vectors[:, int(np.argmin(np.abs(values)))]

    def sine(beta: Floats) -> float:
        image = shifted @ beta
        return abs(float(beta[0] * image[1] - beta[1] * image[0])) / float(np.hypot(image[0], image[1]))

    return classical if sine(classical) >= 0.5 * sine(other) else other


def _refine(
    oscillator: Oscillator, weights: Floats, columns: Floats, frequency_squared: Floats, decay: Floats
) -> LinkBlocks:
    """Newton's method on the whole decomposition ``A X = X T``, T made of companion blocks.

    With ``E = X^-1 (A X - X T)`` the columns become ``X (I + F)``, ``T_i F_ij - F_ij T_j = -E_ij`` off the diagonal;
    on it the two numbers of the block and the freedom left in a are updated exactly.
    """
    count = len(decay)
    previous = np.inf
    conditioning = np.inf
    discriminant = frequency_squared - decay**2
    for _ in range(MODAL_REFINEMENT_STEPS):
        residual = invariance_residual(
            oscillator.masses, oscillator.stiffnesses, oscillator.link_damping, columns, frequency_squared, decay
        )
        energy = weights[:, None] * columns
        lengths = np.linalg.norm(energy, axis=0)
        unit = energy / lengths
        if not np.all(np.isfinite(unit)):
            break
        conditioning = float(np.linalg.cond(unit))
        if not conditioning <= 1e3 * MODAL_CONDITION_LIMIT:
            break
        error = np.linalg.solve(unit, weights[:, None] * residual / lengths)
        try:
            update = _off_diagonal_update(error, frequency_squared, decay, lengths)
        except np.linalg.LinAlgError:
            conditioning = np.inf
            break

        scale = lengths[1::2] / lengths[0::2]  # back from unit columns to (a, b)
        diagonal = error.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count), :]
        e11, e22 = diagonal[:, 0, 0], diagonal[:, 1, 1]
        e12, e21 = diagonal[:, 0, 1] * scale, diagonal[:, 1, 0] / scale
        product_change = e12 * frequency_squared - e21 - 2.0 * decay * e11 + e11 * e22 - e12 * e21
        decay_change = -0.5 * (e11 + e22)
        discriminant = _discriminant(frequency_squared, product_change, decay, decay_change)
        frequency_squared = frequency_squared + product_change
        decay = decay + decay_change

        change = (unit @ update) * lengths / weights[:, None]
        change[:, 0::2] += columns[:, 0::2] * e12 - columns[:, 1::2] * e11
        columns = columns + change
        frequency = np.sqrt(frequency_squared)
        size = max(float(np.max(np.abs(update))), float(np.max(np.abs(diagonal) / frequency[:, None, None])))
        if size <= MODAL_REFINEMENT_GOAL or size > 0.5 * previous:
            break
        previous = size
    return LinkBlocks(frequency_squared, decay, discriminant, columns, conditioning)


def _off_diagonal_update(error: Floats, frequency_squared: Floats, decay: Floats, lengths: Floats) -> Floats:
    """Solve ``T_i F_ij - F_ij T_j = -E_ij`` for all pairs of different blocks, with unit columns; F_jj is zero."""
    count = len(decay)
    blocks = np.zeros((count, 2, 2))
    blocks[:, 0, 1] = lengths[0::2] / lengths[1::2]
    blocks[:, 1, 0] = -frequency_squared / blocks[:, 0, 1]
    blocks[:, 1, 1] = -2.0 * decay
    rows, cols = np.nonzero(~np.eye(count, dtype=bool))
    identity = np.eye(2)
    operator = np.einsum("kac,bd->kabcd", blocks[rows], identity) - np.einsum("ac,kdb->kabcd", identity, blocks[cols])
    given = error.reshape(count, 2, count, 2)[rows, :, cols, :]
    solved = np.linalg.solve(operator.reshape(-1, 4, 4), -given.reshape(-1, 4, 1))
    update = np.zeros((count, 2, count, 2))
    update[rows, :, cols, :] = solved.reshape(-1, 2, 2)
    return update.reshape(2 * count, 2 * count)


def _discriminant(product: Floats, product_change: Floats, decay: Floats, decay_change: Floats) -> Floats:
    """Return ``w^2 - eta^2`` of the corrected numbers before they are rounded: near a critical block they cancel."""
    return np.array(
        [
            float(Fraction(p) + Fraction(dp) - (Fraction(d) + Fraction(dd)) ** 2)
            for p, dp, d, dd in zip(product, product_change, decay, decay_change, strict=True)
        ]
    )
