"""The free motion of the contact under unit impulses at equal intervals, one at every impact of a family of orbits."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.grazing.tolerances import CONTACT_ROUNDOFF
from grazemap_core.model.kernels.block_flow import block_flow
from grazemap_core.model.kernels.response_sums import block_sum

ADMISSIBLE = 0
"""Orbits of vanishing impact speed meet no stop between their impacts."""
UNDECIDED = 1
"""Round-off hides whether they do."""
NEVER = 2
"""They do: no orbit of the family is admissible."""


@njit(cache=True, nogil=True, error_model="numpy")
def state_before_impulse(
    kind: int, decay: Floats, discriminant: Floats, frequency_squared: Floats, first: Floats, second: Floats, tau: float
) -> Floats:
    """Return ``sum_{k>=1} (+-1)^k exp(T k tau) (first, second)`` of every block, shape (N, 2).

    Parameters
    ----------
    kind : int
        SAME_SIGN or ALTERNATING, from `response_sums`.
    decay, discriminant, frequency_squared : ndarray of shape (N,)
    first, second : ndarray of shape (N,)
        Change of the first coordinate of a block, and of its second, by an impulse.
    tau : float
        Time between the impulses.
    """
    result = np.empty((decay.size, 2))
    for j in range(decay.size):
        p, q, _ = block_sum(kind, decay[j], discriminant[j], frequency_squared[j], 0.0, tau)
        result[j, 0] = p * first[j] + q * second[j]
        result[j, 1] = p * second[j] - q * (frequency_squared[j] * first[j] + 2.0 * decay[j] * second[j])
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def contact_margin(
    decay: Floats,
    discriminant: Floats,
    frequency_squared: Floats,
    state: Floats,
    level: float,
    omega: float,
    half_periods: int,
    one_stop: bool,
) -> tuple[float, int]:
    """Return by how much orbits of vanishing impact speed miss the stops between their impacts, and the verdict.

    They are near the stops only at the returns of the forcing to its phase at the graze, or to the opposite one.

    Parameters
    ----------
    decay, discriminant, frequency_squared : ndarray of shape (N,)
    state : ndarray of shape (N, 2)
        Contribution of each block to the displacement G of the contact, and to G', just after an impulse.
    level : float
        H, the displacement of the contact at an impulse, caused by all earlier ones.
    omega : float
    half_periods : int
        Half forcing periods between two impacts.
    one_stop : bool
        Whether only returns after whole periods count: the other stop is too far to be met.

    Returns
    -------
    margin : float
        The minimum of ``(-1)^j G(j T/2) - H`` over the returns j between two impacts, relative to the terms of G(0);
        infinity if there is no such return.
    verdict : int
        ADMISSIBLE if all distances are positive, UNDECIDED or NEVER.
    """
    margin, verdict = math.inf, ADMISSIBLE
    size = abs(level)
    for j in range(decay.size):
        size += abs(state[j, 0]) + abs(state[j, 1]) / math.sqrt(frequency_squared[j])
    for m in range(1, half_periods):
        stop = 1 if m % 2 == 0 else -1
        if one_stop and stop < 0:
            continue
        time = m * (math.pi / omega)
        value, terms = 0.0, abs(level)
        for j in range(decay.size):
            e11, e12, e21, e22 = block_flow(decay[j], discriminant[j], frequency_squared[j], time)
            y, rate = e11 * state[j, 0] + e12 * state[j, 1], e21 * state[j, 0] + e22 * state[j, 1]
            frequency = math.sqrt(frequency_squared[j])
            value += y
            terms += (abs(y) + abs(rate) / frequency) * (1.0 + frequency * time)
        distance = stop * value - level
        margin = min(margin, distance / size)
        if abs(distance) <= CONTACT_ROUNDOFF * terms:
            verdict = max(verdict, UNDECIDED)
        elif distance < 0.0:
            verdict = NEVER
    return margin, verdict
