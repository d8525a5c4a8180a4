"""The flow of a second-order block ``u'' = -frequency_squared u - 2 decay u'`` in closed form, for every damping.

Underdamped and overdamped blocks have separate expressions, which keep full accuracy up to critical damping, so no
series is needed there.
"""

from __future__ import annotations

import math
from typing import Protocol

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import kernel


class Blocks(Protocol):
    """Records of n blocks."""

    @property
    def decay(self) -> Floats:
        """(n,) Decay of the blocks."""

    @property
    def discriminant(self) -> Floats:
        """(n,) Discriminant of the blocks."""

    @property
    def frequency_squared(self) -> Floats:
        """(n,) Squared frequency of the blocks."""


@kernel
def block_flow(
    decay: float, discriminant: float, frequency_squared: float, t: float
) -> tuple[float, float, float, float]:
    """Return the entries of ``exp([[0, 1], [-frequency_squared, -2 decay]] t)``.

    With eta the decay: ``exp(-eta t) ((C + eta S) u + S u', -frequency_squared S u + (C - eta S) u')``, where
    ``C = cos(wd t), S = sin(wd t)/wd`` with ``wd^2 = discriminant``, their hyperbolic forms for a negative one, and
    ``C = 1, S = t`` for a critical block.

    Parameters
    ----------
    decay : float
        eta >= 0.
    discriminant : float
        ``frequency_squared - decay**2``, signed; the modal model computes it without cancellation.
    frequency_squared : float
        Product of the block's two exponents, > 0.
    t : float
        Time. Negative times are accurate unless a number overflows.

    Returns
    -------
    e11, e12, e21, e22 : float
        Row by row. Errors are a few units in the last place of the larger term of each sum.
    """
    if discriminant > 0.0:
        damped_frequency = math.sqrt(discriminant)
        ratio = decay / damped_frequency
        envelope = math.exp(-decay * t)
        cosine = envelope * math.cos(damped_frequency * t)
        sine = envelope * math.sin(damped_frequency * t)
        # w^2/wd written with wd as rounded: without decay the determinant then has roundings of either sign
        stiffness = damped_frequency + decay * ratio
        return cosine + ratio * sine, sine / damped_frequency, -stiffness * sine, cosine - ratio * sine
    if discriminant == 0.0:
        envelope = math.exp(-decay * t)
        sine = envelope * t
        return envelope + decay * sine, sine, -frequency_squared * sine, envelope - decay * sine

    # exponents -slow and -fast; decay - split would cancel, so the slow one is computed from their product
    split = math.sqrt(-discriminant)
    fast = decay + split
    slow = frequency_squared / fast
    envelope = math.exp(-slow * t)
    vanished = -math.expm1(-2.0 * split * t)  # 1 - exp(-(fast - slow) t)
    sine = envelope * vanished / (2.0 * split)
    if 2.0 * split * t > 1.0:
        # exponents apart: if fast >> slow, 1 - fast*sine would lose the small remainder
        e22 = (fast * math.exp(-fast * t) - slow * envelope) / (2.0 * split)
    else:
        e22 = envelope - fast * sine
    return envelope + slow * sine, sine, -frequency_squared * sine, e22


@kernel
def flow_state(blocks: Blocks, u: Floats, time: float) -> None:
    """Carry the states u (n, 2) of n blocks over any time, in place."""
    for j in range(u.shape[0]):
        e11, e12, e21, e22 = block_flow(blocks.decay[j], blocks.discriminant[j], blocks.frequency_squared[j], time)
        first, second = u[j, 0], u[j, 1]
        u[j, 0] = e11 * first + e12 * second
        u[j, 1] = e21 * first + e22 * second
