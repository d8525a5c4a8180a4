"""Newton's method for a decomposition into second-order blocks, with residuals in double-double.

The error of the refined blocks is a few roundings, however stiff the structure is.

References
----------
Ogita & Aishima, Japan J. Indust. Appl. Math. 35 (2018) 1007-1035, for the symmetric case; the general case is similar.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.model import tolerances
from grazemap_core.model.structure import Structure
from grazemap_core.numerics.kernels.double_double import two_prod
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class Blocks:
    """Second-order blocks in no particular order: the state is ``sum_j a_j u_j + b_j u_j'``."""

    frequency_squared: Floats
    """(N,) As in `grazemap_core.model.modal.ModalModel`."""
    decay: Floats
    """(N,) As in `grazemap_core.model.modal.ModalModel`."""
    discriminant: Floats
    """(N,) As in `grazemap_core.model.modal.ModalModel`."""
    columns: Floats
    """(2N, 2N) (a_1, b_1, a_2, b_2, ...); rows are the coordinates of the structure."""
    conditioning: float
    """Condition number of `columns` with unit columns in the energy norm; infinite when refinement did not converge."""


def refine(structure: Structure, columns: Floats, frequency_squared: Floats, decay: Floats) -> Blocks:
    """Return refined blocks of the decomposition ``A X = X T``, where T consists of companion blocks.

    With ``E = X^-1 (A X - X T)`` the columns become ``X (I + F)``, ``T_i F_ij - F_ij T_j = -E_ij`` off the diagonal;
    on the diagonal, frequency_squared, decay, and a along its remaining degree of freedom are updated exactly.

    A block whose product and decay are 0 is that of a free mode: it is exact, and keeps them.

    Blocks of the same exponents may be mixed at will: where the equations for F_ij are singular, the smallest solution
    is taken. What is left of E_ij is round-off if the blocks are independent; else they are nearly defective together.
    """
    count = len(decay)
    previous = tolerances.MODAL_REFINEMENT_REACH
    conditioning, have_equal = np.inf, False
    discriminant = frequency_squared - decay**2
    free = (frequency_squared == 0.0) & (decay == 0.0)
    for _ in range(tolerances.MODAL_REFINEMENT_STEPS):
        residual = structure.invariance_residual(columns, frequency_squared, decay)
        energy = structure.weighted(columns)
        lengths = np.linalg.norm(energy, axis=0)
        if not np.all((lengths > 0.0) & np.isfinite(lengths)):
            conditioning = np.inf
            break
        unit = energy / lengths
        conditioning = float(np.linalg.cond(unit)) if np.all(np.isfinite(unit)) else np.inf
        if not conditioning <= tolerances.REFINEMENT_CONDITION_FACTOR * tolerances.MODAL_CONDITION_LIMIT:
            break
        error = np.linalg.solve(unit, structure.weighted(residual) / lengths)
        update, left = _off_diagonal_update(error, frequency_squared, decay, lengths, have_equal)
        if not have_equal and not np.max(np.abs(update)) <= tolerances.MODAL_REFINEMENT_REACH:
            have_equal = True
            update, left = _off_diagonal_update(error, frequency_squared, decay, lengths, have_equal)
        diagonal = error.reshape(count, 2, count, 2)[np.arange(count), :, np.arange(count), :]
        if not np.all((frequency_squared > 0.0) | free):  # smaller than the round-off of faster blocks
            conditioning = np.inf
            break
        frequency = np.sqrt(frequency_squared[~free])
        relative = np.abs(diagonal[~free]) / frequency[:, None, None]
        size = max(float(np.max(np.abs(update))), float(np.max(relative, initial=0.0)))
        if not size <= tolerances.MODAL_REFINEMENT_REACH:
            # too far for Newton's method
            conditioning = np.inf
            break

        scale = lengths[1::2] / lengths[0::2]  # back from unit columns to (a, b)
        e11, e22 = diagonal[:, 0, 0], diagonal[:, 1, 1]
        e12, e21 = diagonal[:, 0, 1] * scale, diagonal[:, 1, 0] / scale
        product_change = e12 * frequency_squared - e21 - 2.0 * decay * e11 + e11 * e22 - e12 * e21
        product_change = np.where(free, 0.0, product_change)
        decay_change = np.where(free, 0.0, -0.5 * (e11 + e22))
        discriminant = _discriminant(frequency_squared, product_change, decay, decay_change)
        frequency_squared = frequency_squared + product_change
        decay = decay + decay_change

        change = structure.unweighted((unit @ update) * lengths)
        change[:, 0::2] += columns[:, 0::2] * e12 - columns[:, 1::2] * e11
        columns = columns + change
        if size <= tolerances.MODAL_REFINEMENT_GOAL or size > 0.5 * previous:
            break
        previous = size
    if have_equal and np.isfinite(conditioning):
        coupling = np.linalg.norm(unit @ left @ np.linalg.inv(unit), 2)
        if coupling > tolerances.MODAL_REFINEMENT_GOAL * count * np.linalg.norm(structure.energy_matrix(), 2):
            conditioning = np.inf
    return Blocks(frequency_squared, decay, discriminant, columns, conditioning)


def _off_diagonal_update(
    error: Floats, frequency_squared: Floats, decay: Floats, lengths: Floats, have_equal: bool
) -> tuple[Floats, Floats]:
    """Solve ``T_i F_ij - F_ij T_j = -E_ij`` for all pairs of different blocks, with unit columns; F_jj is zero.

    Returns F, and what it leaves of E.
    """
    count = len(decay)
    blocks = np.zeros((count, 2, 2))
    blocks[:, 0, 1] = lengths[0::2] / lengths[1::2]
    blocks[:, 1, 0] = -frequency_squared / blocks[:, 0, 1]
    blocks[:, 1, 1] = -2.0 * decay
    rows, cols = np.nonzero(~np.eye(count, dtype=bool))
    identity = np.eye(2)
    operator = np.einsum("kac,bd->kabcd", blocks[rows], identity) - np.einsum("ac,kdb->kabcd", identity, blocks[cols])
    operator = operator.reshape(-1, 4, 4)
    residual = -error.reshape(count, 2, count, 2)[rows, :, cols, :].reshape(-1, 4, 1)
    try:
        if have_equal:
            solved = np.linalg.pinv(operator, rcond=tolerances.EQUAL_EXPONENTS) @ residual
        else:
            solved = np.linalg.solve(operator, residual)
    except np.linalg.LinAlgError:  # two blocks share an exponent exactly
        return np.full_like(error, np.inf), error
    matrices = []
    for pairs in (solved, operator @ solved - residual):
        whole = np.zeros((count, 2, count, 2))
        whole[rows, :, cols, :] = pairs.reshape(-1, 2, 2)
        matrices.append(whole.reshape(2 * count, 2 * count))
    return matrices[0], matrices[1]


def _discriminant(product: Floats, product_change: Floats, decay: Floats, decay_change: Floats) -> Floats:
    """Return ``w^2 - eta^2`` of the corrected, unrounded numbers: near critical damping the two terms cancel.

    The terms of the sum are exact, unless they underflow, and it is rounded once.
    """
    squares = two_prod(np.array([decay, 2.0 * decay, decay_change]), np.array([decay, decay_change, decay_change]))
    terms = np.array([product, product_change, *(-squares.high), *(-squares.low)])
    return np.array([math.fsum(each) for each in terms.T.tolist()])
