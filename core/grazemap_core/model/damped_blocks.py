"""Second-order blocks of a structure with damping of any kind.

For each of N pairs of exponents a block has their product and sum, and two columns (a, b) such that the state is
``a u + b u'``. The first-order system is set up in energy coordinates, where it is a skew-symmetric matrix minus a
positive semidefinite one. An ordered Schur form gives the subspace of each block without nearly parallel eigenvectors.
`modal_refinement` then restores the accuracy of slow blocks: in a stiff structure the backward error of the Schur form
is relative to the fastest exponent.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack, schur

from grazemap_core.arrays import Floats
from grazemap_core.errors import ConditioningError
from grazemap_core.model.modal_refinement import Blocks, refine
from grazemap_core.model.structure import Structure
from grazemap_core.model.tolerances import MODAL_CONDITION_LIMIT, SEPARATING_CHANGE, SEPARATING_TRIALS
from grazemap_core.tolerances import EPSILON

Pairs = list[tuple[int, int]]

_NEARLY_DEFECTIVE = (
    "two modes of this structure nearly coincide in frequency, decay and shape, and the modal model would lose "
    "digits; change a damping slightly"
)
_TOO_SLOW = (
    "a mode of this structure is so slow compared with the others that double precision does not resolve it; its "
    "stiffnesses or its dampings differ too much in size"
)


def damped_blocks(structure: Structure) -> Blocks:
    """Return the blocks of a structure with damping of any kind.

    Raises
    ------
    ConditioningError
        Two blocks are nearly defective together, or one is too slow to be resolved.
    """
    matrix = structure.energy_matrix()
    triangular, basis = schur(matrix, output="real")
    triangular = _without_round_pairs(triangular)
    blocks, resolved = _best_blocks(structure, matrix, triangular, basis)
    for trial in range(SEPARATING_TRIALS):
        if blocks.conditioning <= MODAL_CONDITION_LIMIT:
            break
        # equal exponents cannot be reordered; a small change separates them, and refinement takes it back
        change = np.random.default_rng(trial).uniform(size=len(triangular)) * np.linalg.norm(triangular, 2)
        for i in np.flatnonzero(np.diag(triangular, -1)):
            change[i + 1] = change[i]
        separated = triangular + SEPARATING_CHANGE * np.diag(change)
        blocks, _ = _best_blocks(structure, basis @ separated @ basis.T, separated, basis)
    if not blocks.conditioning <= MODAL_CONDITION_LIMIT:
        raise ConditioningError(_NEARLY_DEFECTIVE if resolved else _TOO_SLOW)
    return blocks


def _without_round_pairs(triangular: Floats) -> Floats:
    """Return the Schur form with equal real exponents apart that round-off has made a complex pair.

    Their block is a multiple of the identity but for a smaller part than the change that separates exponents.
    """
    corner = np.arange(len(triangular) - 1)
    above, below = triangular[corner, corner + 1], triangular[corner + 1, corner]
    largest = SEPARATING_CHANGE * np.abs(np.diag(triangular)[:-1])
    real = (below != 0.0) & (np.maximum(np.abs(above), np.abs(below)) <= largest)
    apart = triangular.copy()
    apart[corner[real] + 1, corner[real]] = 0.0
    return apart


def _best_blocks(structure: Structure, matrix: Floats, triangular: Floats, basis: Floats) -> tuple[Blocks, bool]:
    """Return the best blocks that begin with the Schur form of a matrix, and whether it resolved the slowest one."""
    to_columns = structure.from_energy()
    best: Blocks | None = None
    resolved = True
    for pairs in _pairings(matrix, triangular):
        start = _initial(triangular, basis, pairs, to_columns)
        resolved = resolved and bool(np.min(start[1]) > EPSILON * np.max(start[1]))
        blocks = refine(structure, *start)
        if best is None or blocks.conditioning < best.conditioning:
            best = blocks
        if best.conditioning < np.sqrt(MODAL_CONDITION_LIMIT):
            break
    assert best is not None
    return best, resolved


def _pairings(matrix: Floats, triangular: Floats) -> list[Pairs]:
    """Return pairings of the exponents, the best guess first, as indices on the diagonal of the Schur form.

    Complex pairs are given. Real exponents that are nearly defective together have nearly parallel eigenvectors and
    must share a block; real exponents that are close but independent should not share one, because their (u, u')
    coordinates would be nearly dependent. The most parallel ones are therefore paired first; the closest ones and the
    two halves of the sorted list are the alternatives.
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
    apart, total = np.abs(values[:, None] - values), np.abs(values[:, None] + values)
    distance = np.divide(apart, total, out=np.zeros_like(total), where=total > 0.0)
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


def _initial(triangular: Floats, basis: Floats, pairs: Pairs, to_columns: Floats) -> tuple[Floats, Floats, Floats]:
    """Return columns of coordinates, frequency_squared and decay of every block."""
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
        columns[:, 2 * j] = to_columns @ (subspace @ (shifted @ direction))
        columns[:, 2 * j + 1] = to_columns @ (subspace @ direction)
    return columns, frequency_squared, decay


def _companion_direction(shifted: Floats, displacements: Floats) -> Floats:
    """Return the unit vector beta for which ``(shifted beta, beta)`` is a good basis of the block.

    The first choice is the direction of minimum displacement, that of the classical mode. If the two vectors would be
    nearly parallel, it is the one on which the symmetric part of `shifted` is smallest.
    """
    classical = np.linalg.svd(displacements)[2][1]
    symmetric = 0.5 * (shifted + shifted.T)
    values, vectors = np.linalg.eigh(symmetric)
    other = vectors[:, int(np.argmin(np.abs(values)))]

    def sine(beta: Floats) -> float:
        image = shifted @ beta
        length = float(np.hypot(image[0], image[1]))
        return abs(float(beta[0] * image[1] - beta[1] * image[0])) / length if length > 0.0 else 0.0

    return classical if sine(classical) >= 0.5 * sine(other) else other
