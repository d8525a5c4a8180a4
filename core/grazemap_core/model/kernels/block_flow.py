"""The motion of a second-order block ``u'' = -frequency_squared u - 2 decay u'`` in closed form, free and forced.

*Free.* Underdamped and overdamped blocks have separate expressions, which keep full accuracy up to critical damping, so
no series is needed there.

*Forced, underdamped, from rest.* Away from resonance this is the steady motion minus a transient. Both are unbounded
toward an undamped resonance, where they cancel. Their difference is a divided difference of the exponential function at
the exponents of the block and of the forcing, and is computed as such.
"""

from __future__ import annotations

import math
from typing import Protocol

from grazemap_core.arrays import Floats
from grazemap_core.numerics.jit.compiled import inlined, kernel


class BlockFields(Protocol):
    """A record of kernels that has N second-order blocks among its fields, each of shape (N,)."""

    @property
    def decay(self) -> Floats:
        """As in `block_flow`."""

    @property
    def discriminant(self) -> Floats:
        """As in `block_flow`."""

    @property
    def frequency_squared(self) -> Floats:
        """As in `block_flow`."""


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


@inlined
def advance_block(blocks: BlockFields, j: int, u: float, rate: float, time: float) -> tuple[float, float]:
    """Return u and u' of block j a time after they were `u` and `rate`."""
    e11, e12, e21, e22 = block_flow(blocks.decay[j], blocks.discriminant[j], blocks.frequency_squared[j], time)
    return e11 * u + e12 * rate, e21 * u + e22 * rate


@kernel
def advance_state(blocks: BlockFields, state: Floats, time: float) -> None:
    """Carry a free state (N, 2) over a time of either sign, in place."""
    for j in range(state.shape[0]):
        state[j, 0], state[j, 1] = advance_block(blocks, j, state[j, 0], state[j, 1], time)


@kernel
def advance_columns(blocks: BlockFields, columns: Floats, time: float) -> None:
    """Carry columns over a time, in place; their first 2 N rows are u and u' of one block after another."""
    for j in range(blocks.decay.shape[0]):
        e11, e12, e21, e22 = block_flow(blocks.decay[j], blocks.discriminant[j], blocks.frequency_squared[j], time)
        for c in range(columns.shape[1]):
            u, rate = columns[2 * j, c], columns[2 * j + 1, c]
            columns[2 * j, c], columns[2 * j + 1, c] = e11 * u + e12 * rate, e21 * u + e22 * rate


@inlined
def _exponential_difference(decay: float, detuning: float, t: float) -> complex:
    """Return (1 - exp(-z t))/z for z = decay + i detuning, and t for z = 0."""
    if decay == 0.0 and detuning == 0.0:
        return complex(t, 0.0)
    shrunk = math.expm1(-decay * t)
    sine, half_sine = math.sin(detuning * t), math.sin(0.5 * detuning * t)
    difference = complex(2.0 * half_sine * half_sine - shrunk * math.cos(detuning * t), (1.0 + shrunk) * sine)
    return difference / complex(decay, detuning)


@kernel
def response_from_rest(decay: float, discriminant: float, omega: float, t: float) -> tuple[complex, complex]:
    """Return u and u' at time t for ``u'' = -w^2 u - 2 decay u' + exp(i omega t)``, u = u' = 0 at time 0.

    With f(z) = (exp(i omega t) - exp(z t))/(i omega - z) and the exponents z of the block, u and u' are the divided
    differences of f(z) and z f(z).

    Parameters
    ----------
    decay : float
        eta >= 0.
    discriminant : float
        ``w^2 - eta^2`` > 0.
    omega, t : float
        Forcing frequency > 0, and time >= 0.
    """
    damped_frequency = math.sqrt(discriminant)
    turn = complex(math.cos(omega * t), math.sin(omega * t))
    near = turn * _exponential_difference(decay, omega - damped_frequency, t)
    far = turn * _exponential_difference(decay, omega + damped_frequency, t)
    upper, lower = complex(-decay, damped_frequency), complex(-decay, -damped_frequency)
    between = complex(0.0, 2.0 * damped_frequency)
    return (near - far) / between, (upper * near - lower * far) / between


@kernel
def forced_block(
    decay: float, discriminant: float, frequency_squared: float, first: complex, second: complex, omega: float, t: float
) -> tuple[complex, complex]:
    """Return u and u' of a block at time t, zero at time 0, with a forcing of both of its equations.

    ``du/dt = u' + first exp(i omega t)``, ``du'/dt = -frequency_squared u - 2 decay u' + second exp(i omega t)``.
    Other parameters as in `response_from_rest`.
    """
    displacement, velocity = response_from_rest(decay, discriminant, omega, t)
    return (
        velocity * first + displacement * (2.0 * decay * first + second),
        velocity * second - displacement * frequency_squared * first,
    )
