"""The impulse response ``g(s) = Phi_12(s)``: the displacement of the contact after it was given a unit velocity.

The zeros of g and of its periodic sums are the codimension-two points of the grazing curve.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.model.kernels.response_sums import IMPULSE, ResponseBlocks, response_sum
from grazemap_core.model.modal import ModalModel
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class ImpulseResponse:
    """``g(s) = sum_j y_j(s)``, each term the solution of one second-order block."""

    decay: Floats
    """(N,) As in `ModalModel`."""
    discriminant: Floats
    """(N,) As in `ModalModel`."""
    frequency_squared: Floats
    """(N,) As in `ModalModel`."""
    value: Floats
    """(N,) ``y_j(0)``; the sum is 0. With proportional damping each is 0."""
    slope: Floats
    """(N,) ``y_j'(0)``; the sum is 1. With proportional damping each is ``m_c (h^T phi_j)^2``."""
    seen: Booleans
    """(M,) Which blocks of the modal model these are: those that an impulse excites and contact sees."""
    slowest: float
    """The smallest decay rate of all exponents; ``exp(slowest s) g(s)`` neither overflows nor underflows."""
    conditioning: float
    """Condition number of the modal model."""

    @cached_property
    def unit_impulse(self) -> Floats:
        """(N, 2) Changes of each block's part in displacement and velocity of the contact by a unit impulse."""
        return np.stack([self.value, self.slope], axis=1)

    @property
    def blocks(self) -> ResponseBlocks:
        """The blocks as the kernels take them."""
        return self.decay, self.discriminant, self.frequency_squared, self.value, self.slope


def impulse_response(model: ModalModel) -> ImpulseResponse:
    """Return the impulse response of the contact from the modal model."""
    unit_impulse, row = model.unit_impulse, model.contact_row
    acceleration = -model.frequency_squared * unit_impulse[:, 0] - 2.0 * model.decay * unit_impulse[:, 1]
    value = row[:, 0] * unit_impulse[:, 0] + row[:, 1] * unit_impulse[:, 1]
    slope = row[:, 0] * unit_impulse[:, 1] + row[:, 1] * acceleration
    # a mode that contact does not see adds nothing, and may be free
    seen = (value != 0.0) | (slope != 0.0)
    split = np.sqrt(np.maximum(-model.discriminant, 0.0))
    rates = model.decay.copy()
    np.divide(model.frequency_squared, model.decay + split, out=rates, where=split > 0.0)
    return ImpulseResponse(
        decay=model.decay[seen],
        discriminant=model.discriminant[seen],
        frequency_squared=model.frequency_squared[seen],
        value=value[seen],
        slope=slope[seen],
        seen=seen,
        slowest=float(np.min(rates[seen])),
        conditioning=model.conditioning,
    )


def evaluate(
    response: ImpulseResponse, times: ArrayLike, kind: int = IMPULSE, shift: float = 0.0
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return a response function, its derivative, a bound of its round-off, and the sum of its terms' amplitudes.

    Parameters
    ----------
    response : ImpulseResponse
    times : array_like of shape (n,)
        Times s > 0 (or the spacing tau of a periodic sum).
    kind : {IMPULSE, SAME_SIGN, ALTERNATING}
        g, or one of its periodic sums, from `grazemap_core.model.kernels.response_sums`.
    shift : float
        The results are multiplied by ``exp(shift s)``; ``response.slowest`` prevents underflow at long times.

    Returns
    -------
    value, derivative, roundoff, terms : ndarray of shape (n,)
        `terms` is the sum of the amplitudes of the blocks.
    """
    points = np.ascontiguousarray(times, dtype=np.float64)
    result = response_sum(kind, response.blocks, response.conditioning, shift, points)
    return result[:, 0], result[:, 1], result[:, 2], result[:, 3]
