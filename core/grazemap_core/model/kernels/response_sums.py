"""The impulse response of the contact and its periodic sums, with rigorous bounds for root isolation.

A block's solution is ``y(t) = e0 y(0) + e1 y'(0)``, because every function of its matrix T is a combination of the
identity and T. With ``E = exp(T tau)`` the periodic sums are

    S = sum_{k>=1} E^k        =  (E - det(E) I)/det(I - E)
    R = sum_{k>=1} (-1)^k E^k = -(E + det(E) I)/det(I + E)

and both obey ``dS/dtau = T S (I + S)``. Determinants are formed as sums of squares or products of positive numbers,
so lightly damped blocks near their resonance and blocks much slower than tau keep their accuracy.

Results are multiplied by ``exp(shift tau)``: with the slowest decay rate as shift they do not underflow at any time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.model.tolerances import BOUND_SAFETY, RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.compiled import inlined, kernel

IMPULSE = 0
"""g(tau) itself."""
SAME_SIGN = 1
"""h(tau) = sum g(k tau)."""
ALTERNATING = 2
"""h_s(tau) = sum (-1)^k g(k tau)."""


ResponseBlocks = tuple[Floats, Floats, Floats, Floats, Floats]
"""Decay, discriminant and frequency_squared of the blocks of a modal model, and the contribution of each to g(0) and
g'(0); arrays of shape (N,). A plain tuple, as numba is slow to unpack a named one from Python."""


@kernel
def block_sum(
    kind: int, decay: float, discriminant: float, frequency_squared: float, shift: float, tau: float
) -> tuple[float, float, float]:
    """Return p, q with ``exp(-shift tau) (p I + q T)`` the block's E, S or R, and ``|det(I -+ E)|`` (1 for E)."""
    if discriminant > 0.0:
        frequency = math.sqrt(discriminant)
        plain = math.exp(-decay * tau)
        envelope = math.exp(-(decay - shift) * tau)
        half_sine = math.sin(0.5 * frequency * tau)
        half_cosine = math.cos(0.5 * frequency * tau)
        cosine = half_cosine * half_cosine - half_sine * half_sine
        sine = 2.0 * half_sine * half_cosine / frequency
        lost = -math.expm1(-decay * tau)
        if kind == IMPULSE:
            return envelope * (cosine + decay * sine), envelope * sine, 1.0
        if kind == SAME_SIGN:
            determinant = lost * lost + 4.0 * plain * half_sine * half_sine
            first = envelope * (lost - 2.0 * half_sine * half_sine + decay * sine)
            return first / determinant, envelope * sine / determinant, determinant
        determinant = lost * lost + 4.0 * plain * half_cosine * half_cosine
        first = envelope * (plain + cosine + decay * sine)
        return -first / determinant, -envelope * sine / determinant, determinant

    split = math.sqrt(-discriminant)
    fast = decay + split
    slow = frequency_squared / fast
    envelope = math.exp(-(slow - shift) * tau)
    # (1 - exp(-(fast - slow) tau))/(fast - slow), also for equal exponents
    sine = envelope * (tau if split == 0.0 else -math.expm1(-2.0 * split * tau) / (2.0 * split))
    if kind == IMPULSE:
        return envelope + slow * sine, sine, 1.0
    if kind == SAME_SIGN:
        lost_fast = -math.expm1(-fast * tau)
        determinant = -math.expm1(-slow * tau) * lost_fast
        return (envelope * lost_fast + slow * sine) / determinant, sine / determinant, determinant
    vanishing = math.exp(-fast * tau)
    determinant = (1.0 + math.exp(-slow * tau)) * (1.0 + vanishing)
    return -(envelope * (1.0 + vanishing) + slow * sine) / determinant, -sine / determinant, determinant


@inlined
def _product(p: float, q: float, r: float, s: float, decay: float, frequency_squared: float) -> tuple[float, float]:
    """Return ``(p I + q T)(r I + s T)``, with ``T^2 = -frequency_squared I - 2 decay T``."""
    return p * r - frequency_squared * q * s, p * s + q * r - 2.0 * decay * q * s


@kernel
def response_at(kind: int, blocks: ResponseBlocks, shift: float, tau: float) -> tuple[float, float, float, float]:
    """Return ``exp(shift tau)`` times: the function, its derivative, and the sizes of the terms of both.

    Parameters
    ----------
    kind : int
        IMPULSE, SAME_SIGN or ALTERNATING.
    blocks : ResponseBlocks
    shift, tau : float
    """
    decay, discriminant, frequency_squared, value, slope = blocks
    total = 0.0
    derivative = 0.0
    terms = 0.0
    derivative_terms = 0.0
    for j in range(decay.size):
        p, q, _ = block_sum(kind, decay[j], discriminant[j], frequency_squared[j], shift, tau)
        r, s = p, q
        if kind != IMPULSE:
            unshifted = math.exp(-shift * tau)
            r, s = _product(p, q, 1.0 + unshifted * p, unshifted * q, decay[j], frequency_squared[j])
        # times T
        r, s = -frequency_squared[j] * s, r - 2.0 * decay[j] * s
        total += p * value[j] + q * slope[j]
        derivative += r * value[j] + s * slope[j]
        # the amplitude of a block, not its value, which passes through zero
        size = abs(p * value[j]) + abs(q * slope[j])
        rate = abs(r * value[j]) + abs(s * slope[j])
        frequency = math.sqrt(frequency_squared[j])
        terms += size + rate / frequency
        split = math.sqrt(max(-discriminant[j], 0.0))
        derivative_terms += rate + size * (frequency if split == 0.0 else frequency_squared[j] / (decay[j] + split))
    return total, derivative, terms, derivative_terms


@kernel
def curvature_bound(kind: int, blocks: ResponseBlocks, shift: float, middle: float, radius: float) -> float:
    """Return a bound of ``|second derivative| exp(shift middle)`` on ``[middle - radius, middle + radius]``.

    Each block takes the smaller of two bounds. Exponents apart: with ``y = Re(Z z)``, ``z = exp(lambda tau)``, the
    second derivatives are ``|Z||lambda|^2`` times ``|z|``, ``|z (1 + z)|/|1 - z|^3``, ``|z (1 - z)|/|1 + z|^3``, and a
    denominator is no smaller than at the middle less the radius times its rate. Exponents together, through the
    critical block: ``|y''(t)| <= exp(-slow t) (|y''(0)| + t |y'''(0) + decay y''(0)|)``, summed over k in closed form.
    """
    decay, discriminant, frequency_squared, value, slope = blocks
    left = middle - radius
    right = middle + radius
    scale = shift * middle
    total = 0.0
    for j in range(decay.size):
        eta, square = decay[j], frequency_squared[j]
        if discriminant[j] > 0.0:
            slow = eta
            largest = math.exp(-eta * left)
            amplitude = math.hypot(value[j], (slope[j] + eta * value[j]) / math.sqrt(discriminant[j]))
            apart = square * amplitude * math.exp(scale - eta * left)
            if kind != IMPULSE:
                _, _, determinant = block_sum(kind, eta, discriminant[j], square, shift, middle)
                distance = max(-math.expm1(-eta * left), math.sqrt(determinant) - radius * math.sqrt(square) * largest)
                apart *= (1.0 + largest) / (distance * distance * distance)
        else:
            split = math.sqrt(-discriminant[j])
            fast = eta + split
            slow = square / fast
            apart = math.inf
            if split > 0.0:
                slow_part = (
                    slow * slow * abs(slope[j] + fast * value[j]) / (2.0 * split) * math.exp(scale - slow * left)
                )
                fast_part = (
                    fast * fast * abs(slope[j] + slow * value[j]) / (2.0 * split) * math.exp(scale - fast * left)
                )
                if kind == SAME_SIGN:
                    slow_lost = -math.expm1(-slow * left)
                    fast_lost = -math.expm1(-fast * left)
                    slow_part *= (2.0 - slow_lost) / (slow_lost * slow_lost * slow_lost)
                    fast_part *= (2.0 - fast_lost) / (fast_lost * fast_lost * fast_lost)
                apart = slow_part + fast_part

        second = -square * value[j] - 2.0 * eta * slope[j]
        third = -square * slope[j] - 2.0 * eta * second
        ratio = math.exp(-slow * left)
        first_weight = 1.0
        second_weight = 1.0
        if kind != IMPULSE:  # sums of k^2 ratio^(k-1) and k^3 ratio^(k-1)
            lost = -math.expm1(-slow * left)
            cube = lost * lost * lost
            first_weight = (1.0 + ratio) / cube
            second_weight = (1.0 + ratio * (4.0 + ratio)) / (cube * lost)
        together = math.exp(scale - slow * left) * (
            first_weight * abs(second) + second_weight * right * abs(third + eta * second)
        )
        total += min(apart, together)
    return total * BOUND_SAFETY


@njit(cache=True, nogil=True, error_model="numpy")
def response_sum(kind: int, blocks: ResponseBlocks, conditioning: float, shift: float, tau: Floats) -> Floats:
    """Return function, derivative, round-off bound and terms at each tau, times ``exp(shift tau)``; shape (n, 4)."""
    result = np.empty((tau.size, 4))
    for i in range(tau.size):
        total, derivative, terms, derivative_terms = response_at(kind, blocks, shift, tau[i])
        result[i, 0] = total
        result[i, 1] = derivative
        result[i, 2] = RESPONSE_ROUNDOFF * conditioning * (terms + tau[i] * derivative_terms)
        result[i, 3] = terms
    return result
