"""The modal model: the free motion of a structure as N independent second-order blocks, for every kind of damping.

A block has coordinates (u, u') with ``u'' = -frequency_squared u - 2 decay u'`` and stands for one pair of exponents,
complex, real or equal, so critical damping needs no special treatment. Damping that is diagonal in the modes gives the
classical modes (theory, section 2); any other gives blocks whose shapes also depend on u'
(`grazemap_core.model.damped_blocks`).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import svd

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.errors import ConditioningError, ParameterError
from grazemap_core.model.chain import Chain, elongations
from grazemap_core.model.damped_blocks import damped_blocks
from grazemap_core.model.matrices import Matrices, has_free_modes, real_modes
from grazemap_core.model.modal_refinement import Blocks, refine
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.structure import Structure
from grazemap_core.model.tolerances import (
    CLASSICAL_COUPLING,
    GROWTH,
    MODAL_CONDITION_LIMIT,
    PROPORTIONAL_SPREAD,
    UNDAMPED_RATIO,
    VANISHING_WEIGHT,
)
from grazemap_core.numerics.kernels.double_double import exact, transformed
from grazemap_core.records import dataclass

KEPT_MODELS = 16
"""Number of modal models that are kept; one of 64 masses has 256 KiB."""

_NO_CONTACT = np.zeros((0, 2))


@dataclass(frozen=True, eq=False)
class ModalModel:
    """The free motion of an oscillator in block coordinates; blocks in order of increasing frequency."""

    frequency_squared: Floats
    """(N,) Product of the block's two exponents, ``w_j^2``."""
    decay: Floats
    """(N,) ``eta_j``, minus the mean of the block's two exponents."""
    discriminant: Floats
    """(N,) ``w_j^2 - eta_j^2``: positive for an underdamped block, zero for a critical, negative for an overdamped one.
    It is computed without cancellation; do not recompute it from the other two."""
    contact_row: Floats
    """(N, 2) The contact coordinate ``h^T x`` in (u, u'); empty for a structure without a contact."""
    unit_impulse: Floats
    """(N, 2) Change of (u_j, u_j') by an impulse that changes the velocity of the contact coordinate by 1; or empty."""
    to_modal: Floats
    """(2N, 2N) Maps (x_1 .. x_N, v_1 .. v_N) to (u_1, u_1', u_2, u_2', ...)."""
    from_modal: Floats
    """(2N, 2N) Inverse of `to_modal`."""
    conditioning: float
    """Condition number of `from_modal` with unit columns in the energy norm; 1 for classical modes."""
    undamped: Booleans
    """(N,) True where the block's decay is zero to round-off."""

    @property
    def size(self) -> int:
        """Number of blocks N."""
        return len(self.decay)

    @cached_property
    def shape(self) -> Floats:
        """(N, N, 2) Displacement i is ``sum_j shape[i, j, 0] u_j + shape[i, j, 1] u_j'``.

        With classical modes ``shape[:, :, 0]`` holds the mode shapes with ``P^T M P = I``, and ``shape[:, :, 1]`` is 0.
        """
        return np.ascontiguousarray(self.from_modal[: self.size].reshape(self.size, self.size, 2))

    @cached_property
    def fastest_exponent(self) -> float:
        """The largest modulus of an exponent of a block; 0 without blocks."""
        real = self.decay + np.sqrt(np.maximum(-self.discriminant, 0.0))
        exponents = np.where(self.discriminant < 0.0, real, np.sqrt(self.frequency_squared))
        return float(np.max(exponents, initial=0.0))


_Decomposition = tuple[ModalModel, Floats]
"""A modal model without a contact, and its columns in the coordinates of the structure, (2N, 2N)."""


@lru_cache(maxsize=KEPT_MODELS)
def modal_model(subject: Oscillator | Structure) -> ModalModel:
    """Return the modal model of an oscillator or of a structure; the last ones are kept, by the object.

    Raises
    ------
    ParameterError
        A free motion of the structure grows.
    ConditioningError
        Two blocks are nearly defective together.
    """
    if not isinstance(subject, Oscillator):
        return _decomposition(subject)[0]
    (model, columns), contact = _decomposition(subject.structure), subject.contact
    count = model.size
    # a contact within a chain is an elongation, or a sum of some, which differences of displacements would round
    inner = subject.structure.row_of_coordinates(contact)
    output = (contact, model.from_modal[:count]) if inner is None else (inner, columns[:count])
    row, impulse = _product(*output), _product(subject.jump, model.to_modal[:, count:].T)
    free = model.frequency_squared == 0.0
    if np.any(row.reshape(count, 2)[free]) or np.any(impulse.reshape(count, 2)[free]):
        raise ParameterError("contact", "sees a free mode of the structure, which this version does not cover")
    return replace(
        model,
        contact_row=np.ascontiguousarray(row.reshape(count, 2)),
        unit_impulse=np.ascontiguousarray(impulse.reshape(count, 2)),
    )


def _product(row: Floats, columns: Floats) -> Floats:
    """Return ``row @ columns``, and 0 where only the rounding of terms that cancel would be left."""
    product = row @ columns
    return np.where(np.abs(product) <= VANISHING_WEIGHT * (np.abs(row) @ np.abs(columns)), 0.0, product)


def _decomposition(structure: Structure) -> _Decomposition:
    if isinstance(structure, Matrices):
        return _of_matrices(structure)
    assert isinstance(structure, Chain)
    if structure.gamma is not None:
        return _proportional(structure, structure.gamma)
    ratios = structure.link_damping / structure.stiffnesses
    if structure.wall_stiffness > 0.0:
        ratios = np.append(ratios, structure.wall_damping / structure.wall_stiffness)
    if np.ptp(ratios) <= PROPORTIONAL_SPREAD * np.max(ratios):
        return _proportional(structure, 0.5 * float(np.mean(ratios)))
    return _assemble(structure, damped_blocks(structure))


def _proportional(chain: Chain, gamma: float) -> _Decomposition:
    """Return the classical modes; the errors of frequencies and shapes are a few roundings, however stiff the chain is.

    ``K`` is a product of bidiagonal matrices, so ``M^-1/2 K M^-1/2 = U^T U`` with U upper bidiagonal and entries that
    are square roots of quotients of the parameters; the singular values of a bidiagonal matrix are found to high
    *relative* accuracy (Demmel & Kahan, SIAM J. Sci. Stat. Comput. 11 (1990) 873-912) by LAPACK's gesvd, but not by
    gesdd, scipy's default. Refinement then gives the shapes the same accuracy. Where two frequencies are too close for
    it, each shape has the accuracy of gesvd, but results that depend on both together are not affected.
    """
    mass, stiffness = chain.masses, chain.stiffnesses
    count = chain.size
    left, singular, right = svd(chain.square_root(), lapack_driver="gesvd")
    columns = np.zeros((2 * count, 2 * count))
    columns[count:, 1::2] = right.T / np.sqrt(mass)[:, None]
    if chain.wall_stiffness == 0.0:
        columns[:count, 0::2] = left * singular / np.sqrt(stiffness)[:, None]
    else:  # the rows of U are not links; the differences lose digits on a stiff chain, and refinement restores them
        columns[:count, 0::2] = elongations(columns[count:, 1::2])
    blocks = refine(chain.undamped(), columns, singular**2, np.zeros(count))
    frequency = singular
    if np.isfinite(blocks.conditioning):
        frequency, columns = np.sqrt(blocks.frequency_squared), blocks.columns
    return _classical(chain, frequency, columns, None, gamma)


def _of_matrices(structure: Matrices) -> _Decomposition:
    """Return the modes of a structure with dense matrices: classical ones where the damping is diagonal in them."""
    if not structure.has_symmetric_stiffness:
        if has_free_modes(structure.stiffness_matrix):
            raise ParameterError("stiffness", "has a free mode and is not symmetric, which is not covered")
        _check_exponents(structure)
        return _assemble(structure, damped_blocks(structure))
    count = structure.size
    squares, modes = real_modes(structure.mass_matrix, structure.stiffness_matrix)
    if np.min(squares) < 0.0:
        raise ParameterError("stiffness", "has a negative direction, in which a free motion grows")
    columns = np.zeros((2 * count, 2 * count))
    columns[:count, 0::2] = columns[count:, 1::2] = modes
    blocks = refine(structure.undamped(), columns, squares, np.zeros(count))
    if np.isfinite(blocks.conditioning):
        squares, columns = blocks.frequency_squared, blocks.columns
        modes = columns[count:, 1::2] / structure.mass_norms(columns[count:, 1::2])
    if structure.ratios is not None:
        return _classical(structure, np.sqrt(squares), columns, structure.ratios * np.sqrt(squares), None)
    coupling = modes.T @ transformed(structure.damping_matrix, exact(modes)).rounded
    twice = np.diag(coupling).copy()
    largest = float(np.max(np.abs(coupling)))
    if np.max(np.abs(coupling - np.diag(twice))) <= CLASSICAL_COUPLING * count * largest:
        twice = np.where(np.abs(twice) <= CLASSICAL_COUPLING * largest, 0.0, twice)
        if np.min(twice) < 0.0:
            raise ParameterError("damping", "has a negative direction, in which a free motion grows")
        return _classical(structure, np.sqrt(squares), columns, 0.5 * twice, None)
    free = squares == 0.0
    if not np.any(free):
        _check_exponents(structure)
        return _assemble(structure, damped_blocks(structure))
    if max(np.max(np.abs(coupling[:, free])), np.max(np.abs(coupling[free]))) > CLASSICAL_COUPLING * count * largest:
        raise ParameterError("damping", "acts on a free mode and is not diagonal in the modes, which is not covered")
    return _assemble(structure, _beside_free_modes(structure, squares, modes, coupling))


def _beside_free_modes(structure: Matrices, squares: Floats, modes: Floats, coupling: Floats) -> Blocks:
    """Return the blocks of a structure with free modes on which no damper acts: the other modes move by themselves."""
    free, count = squares == 0.0, structure.size
    rigid, others = modes[:, free], modes[:, ~free]
    inner = Matrices(np.eye(others.shape[1]), coupling[np.ix_(~free, ~free)], np.diag(squares[~free]))
    _check_exponents(inner)
    blocks = damped_blocks(inner)
    first = 2 * rigid.shape[1]
    columns = np.zeros((2 * count, 2 * count))
    columns[:count, 0:first:2] = columns[count:, 1:first:2] = rigid
    columns[:count, first:] = others @ blocks.columns[: inner.size]
    columns[count:, first:] = others @ blocks.columns[inner.size :]
    still = np.zeros(rigid.shape[1])
    product, decay = np.concatenate((still, blocks.frequency_squared)), np.concatenate((still, blocks.decay))
    refined = refine(structure, columns, product, decay)
    if not refined.conditioning <= MODAL_CONDITION_LIMIT:
        raise ConditioningError("the free modes of this structure are not separated from its other modes")
    # a free mode moves along its displacement, so that the contact does not see its velocity either
    refined.columns[:count, 1:first:2] = refined.columns[count:, 0:first:2] = 0.0
    refined.columns[count:, 1:first:2] = refined.columns[:count, 0:first:2]
    return refined


def _check_exponents(structure: Matrices) -> None:
    matrix = structure.energy_matrix()
    exponents = np.linalg.eigvals(matrix)
    if np.max(exponents.real) > GROWTH * np.max(np.abs(exponents)):
        raise ParameterError("damping", "and stiffness let a free motion grow")


def _classical(
    structure: Structure, frequency: Floats, columns: Floats, decay: Floats | None, gamma: float | None
) -> _Decomposition:
    """Return the model of classical modes, from columns of coordinates in any order and of any length.

    The decay is given for every mode, or by ``C = 2 gamma K``.
    """
    count = structure.size
    modes = columns[count:, 1::2]
    order = np.argsort(frequency, kind="stable")
    frequency, modes = frequency[order], modes[:, order]
    mass = structure.mass_matrix
    factor = np.where(modes[0] < 0.0, -1.0, 1.0) / structure.mass_norms(modes)
    modes = modes * factor

    to_modal = np.zeros((2 * count, 2 * count))
    from_modal = np.zeros((2 * count, 2 * count))
    momentum = modes.T @ mass  # rows P_j^T M
    to_modal[0::2, :count] = momentum
    to_modal[1::2, count:] = momentum
    from_modal[:count, 0::2] = modes
    from_modal[count:, 1::2] = modes
    if gamma is not None:
        ratio = gamma * frequency
        decays, undamped = ratio * frequency, np.full(count, gamma == 0.0)
    else:
        assert decay is not None
        decays = decay[order]
        ratio = np.divide(decays, frequency, out=np.zeros(count), where=frequency > 0.0)
        undamped = decays <= UNDAMPED_RATIO * frequency
    free = (frequency == 0.0) & (decays > 0.0)
    return (
        ModalModel(
            frequency_squared=frequency**2,
            decay=decays,
            discriminant=np.where(free, -(decays**2), frequency**2 * ((1.0 - ratio) * (1.0 + ratio))),
            contact_row=_NO_CONTACT,
            unit_impulse=_NO_CONTACT,
            to_modal=to_modal,
            from_modal=from_modal,
            conditioning=1.0,
            undamped=undamped,
        ),
        columns[:, np.stack((2 * order, 2 * order + 1), axis=1).ravel()] * np.repeat(factor, 2),
    )


def _assemble(structure: Structure, blocks: Blocks) -> _Decomposition:
    """Return the modal model of refined blocks: convert coordinates to displacements; fix order, length and sign."""
    count = structure.size
    frequency = np.sqrt(blocks.frequency_squared)
    order = np.argsort(frequency, kind="stable")
    columns = blocks.columns[:, np.stack((2 * order, 2 * order + 1), axis=1).ravel()]
    energy = structure.weighted(columns)

    displacement = structure.displacements(columns)
    length = np.linalg.norm(energy[:, 1::2], axis=0)
    factor = np.repeat(np.where(displacement[0, 0::2] < 0.0, -1.0, 1.0) / length, 2)
    from_modal = np.concatenate((displacement, columns[count:])) * factor

    column_length = np.linalg.norm(energy * factor, axis=0)
    inverse = np.linalg.inv(energy * factor / column_length) / column_length[:, None]
    to_modal = structure.rows_of_states(inverse)
    for j in np.flatnonzero(blocks.frequency_squared[order] == 0.0):  # a free mode, which an impact does not move
        to_modal[2 * j : 2 * j + 2] = 0.0
        to_modal[2 * j, :count] = to_modal[2 * j + 1, count:] = from_modal[:count, 2 * j] @ structure.mass_matrix

    decay = blocks.decay[order]
    undamped = decay <= UNDAMPED_RATIO * frequency[order]
    return (
        ModalModel(
            frequency_squared=blocks.frequency_squared[order],
            decay=np.where(undamped, 0.0, decay),
            discriminant=blocks.discriminant[order],
            contact_row=_NO_CONTACT,
            unit_impulse=_NO_CONTACT,
            to_modal=to_modal,
            from_modal=from_modal,
            conditioning=blocks.conditioning,
            undamped=undamped,
        ),
        columns * factor,
    )
