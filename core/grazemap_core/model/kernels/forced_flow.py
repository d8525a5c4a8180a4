"""The harmonic response of an underdamped block from rest, without cancellation at any distance from resonance.

Away from resonance it is the steady motion minus a transient. Both are unbounded toward an undamped resonance, where
they cancel. Their difference is a divided difference of the exponential function at the exponents of the block and of
the forcing, and is computed as such.
"""

from __future__ import annotations

import math

from grazemap_core.numerics.jit.compiled import inlined, kernel


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
