"""The modal model: the free motion of the chain as N independent second-order blocks, for every kind of damping.

A block has coordinates (u, u') with ``u'' = -frequency_squared u - 2 decay u'`` and stands for one pair of exponents,
complex, real or equal, so critical damping needs no special treatment. Proportional damping gives the classical modes
(theory, section 2); a damping coefficient for each link gives blocks whose shapes also depend on u'
(`grazemap_core.model.link_modes`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import svd

from grazemap_core.arrays import Floats
from grazemap_core.model.chain import Chain
from grazemap_core.model.link_modes import chain_elongations, link_blocks
from grazemap_core.model.modal_refinement import Blocks, refine
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.tolerances import PROPORTIONAL_SPREAD, UNDAMPED_RATIO

KEPT_MODELS = 16
"""Number of modal models that are kept; one of 64 masses has 256 KiB."""


@dataclass(frozen=True, eq=False)
class ModalModel:
    """The free motion of an oscillator in block coordinates; blocks in order of increasing frequency.

    Attributes
    ----------
    frequency_squared : ndarray of shape (N,)
        Product of the block's two exponents, ``w_j^2``.
    decay : ndarray of shape (N,)
        ``eta_j``, minus the mean of the block's two exponents.
    discriminant : ndarray of shape (N,)
        ``w_j^2 - eta_j^2``: positive for an underdamped block, zero for a critical, negative for an overdamped one.
        It is computed without cancellation; do not recompute it from the other two.
    shape : ndarray of shape (N, N, 2)
        Displacement of mass i is ``sum_j shape[i, j, 0] u_j + shape[i, j, 1] u_j'``. With proportional damping
        ``shape[:, :, 0]`` holds the mode shapes with ``P^T M P = I`` and ``shape[:, :, 1]`` is zero.
    unit_impulse : ndarray of shape (N, 2)
        Change of (u_j, u_j') by a unit velocity given to mass 1.
    to_modal : ndarray of shape (2N, 2N)
        Maps (x_1 .. x_N, v_1 .. v_N) to (u_1, u_1', u_2, u_2', ...).
    from_modal : ndarray of shape (2N, 2N)
        Inverse of `to_modal`.
    conditioning : float
        Condition number of `from_modal` with unit columns in the energy norm; 1 for proportional damping.
    undamped : ndarray of bool, shape (N,)
        True where the block's decay is zero to round-off.
    """

    frequency_squared: Floats
    decay: Floats
    discriminant: Floats
    shape: Floats
    unit_impulse: Floats
    to_modal: Floats
    from_modal: Floats
    conditioning: float
    undamped: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]

    @property
    def size(self) -> int:
        """Number of blocks N."""
        return len(self.decay)


@lru_cache(maxsize=KEPT_MODELS)
def modal_model(oscillator: Oscillator | Chain) -> ModalModel:
    """Return the modal model of an oscillator or of a chain; the last ones are kept, by the object.

    Raises
    ------
    ConditioningError
        With a damping coefficient for each link, two blocks are nearly defective together.
    """
    chain = oscillator.chain if isinstance(oscillator, Oscillator) else oscillator
    if chain.gamma is not None:
        return _proportional(chain, chain.gamma)
    ratios = chain.link_damping / chain.stiffnesses
    if chain.wall_stiffness > 0.0:
        ratios = np.append(ratios, chain.wall_damping / chain.wall_stiffness)
    if np.ptp(ratios) <= PROPORTIONAL_SPREAD * np.max(ratios):
        return _proportional(chain, 0.5 * float(np.mean(ratios)))
    return _assemble(chain, link_blocks(chain))


def _proportional(chain: Chain, gamma: float) -> ModalModel:
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
        columns[:count, 0::2] = chain_elongations(columns[count:, 1::2])
    undamped = replace(chain, link_damping=np.zeros(count), wall_damping=0.0)
    blocks = refine(undamped, columns, singular**2, np.zeros(count))
    frequency, modes = singular, columns[count:, 1::2]
    if np.isfinite(blocks.conditioning):
        frequency, modes = np.sqrt(blocks.frequency_squared), blocks.columns[count:, 1::2]
    order = np.argsort(frequency, kind="stable")
    frequency, modes = frequency[order], modes[:, order]
    modes = modes * (np.where(modes[0] < 0.0, -1.0, 1.0) / np.sqrt(mass @ modes**2))

    damping_ratio = gamma * frequency
    shape = np.zeros((count, count, 2))
    shape[:, :, 0] = modes
    to_modal = np.zeros((2 * count, 2 * count))
    from_modal = np.zeros((2 * count, 2 * count))
    momentum = modes.T * mass  # rows P_j^T M
    to_modal[0::2, :count] = momentum
    to_modal[1::2, count:] = momentum
    from_modal[:count, 0::2] = modes
    from_modal[count:, 1::2] = modes
    unit_impulse = np.zeros((count, 2))
    unit_impulse[:, 1] = momentum[:, 0]
    return ModalModel(
        frequency_squared=frequency**2,
        decay=damping_ratio * frequency,
        discriminant=frequency**2 * ((1.0 - damping_ratio) * (1.0 + damping_ratio)),
        shape=shape,
        unit_impulse=unit_impulse,
        to_modal=to_modal,
        from_modal=from_modal,
        conditioning=1.0,
        undamped=np.full(count, gamma == 0.0),
    )


def _assemble(chain: Chain, blocks: Blocks) -> ModalModel:
    """Return the modal model of refined blocks: convert elongations to displacements; fix order, length and sign."""
    count = chain.size
    frequency = np.sqrt(blocks.frequency_squared)
    order = np.argsort(frequency, kind="stable")
    pick = np.stack((2 * order, 2 * order + 1), axis=1).ravel()
    weights = np.sqrt(np.concatenate((chain.stiffnesses, chain.masses)))
    energy = weights[:, None] * blocks.columns[:, pick]

    # a displacement is the sum of the elongations of the mass's own link and of all following links
    displacement = np.cumsum(blocks.columns[count - 1 :: -1, pick], axis=0)[::-1]
    length = np.linalg.norm(energy[:, 1::2], axis=0)
    factor = np.repeat(np.where(displacement[0, 0::2] < 0.0, -1.0, 1.0) / length, 2)
    from_modal = np.concatenate((displacement, blocks.columns[count:, pick])) * factor

    column_length = np.linalg.norm(energy * factor, axis=0)
    inverse = np.linalg.inv(energy * factor / column_length) / column_length[:, None]
    to_elongation = inverse * weights
    to_modal = to_elongation.copy()
    to_modal[:, 1:count] -= to_elongation[:, : count - 1]  # elongation i is x_i - x_{i+1}

    decay = blocks.decay[order]
    undamped = decay <= UNDAMPED_RATIO * frequency[order]
    return ModalModel(
        frequency_squared=blocks.frequency_squared[order],
        decay=np.where(undamped, 0.0, decay),
        discriminant=blocks.discriminant[order],
        shape=np.ascontiguousarray(from_modal[:count].reshape(count, count, 2)),
        unit_impulse=np.ascontiguousarray(to_modal[:, count].reshape(count, 2)),
        to_modal=to_modal,
        from_modal=from_modal,
        conditioning=blocks.conditioning,
        undamped=undamped,
    )
