"""The free motion of the contact under unit impulses at equal intervals, one at every impact of a family of orbits."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from grazemap_core.arrays import Floats
from grazemap_core.grazing.tolerances import CONTACT_ROUNDOFF
from grazemap_core.model.kernels.block_flow import advance_block
from grazemap_core.model.kernels.response_sums import block_sum
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.records import NamedTuple

ADMISSIBLE = 0
"""Orbits of vanishing impact speed meet no stop between their impacts."""
UNDECIDED = 1
"""Round-off hides whether they do."""
NEVER = 2
"""They do: no orbit of the family is admissible."""


class PeriodicImpulses(NamedTuple):
    """Unit impulses on the contact at equal intervals, and the free motion that they cause."""

    decay: Floats
    """(N,) Of the blocks."""
    discriminant: Floats
    """(N,) Of the blocks."""
    frequency_squared: Floats
    """(N,) Of the blocks."""
    after: Floats
    """(N, 2) Contribution of each block to displacement and velocity of the contact just after an impulse."""
    omega: float
    """Frequency of the forces."""
    half_periods: int
    """Half forcing periods between two impulses."""


@njit(cache=True, nogil=True, error_model="numpy")
def states_before_impulse(kind: int, blocks: tuple[Floats, Floats, Floats], impulse: Floats, spans: Floats) -> Floats:
    """Return ``sum_{k>=1} (+-1)^k exp(T k span) impulse`` of every block, for each of several spans, (m, N, 2).

    Parameters
    ----------
    kind : int
        SAME_SIGN or ALTERNATING, from `response_sums`.
    blocks : decay, discriminant, frequency_squared of shape (N,) each
    impulse : (m, N, 2)
        The changes of the first and of the second coordinate of each block by an impulse.
    spans : (m,)
        Times between the impulses.
    """
    decay, discriminant, frequency_squared = blocks
    result = np.empty(impulse.shape)
    for i in range(spans.size):
        for j in range(decay.size):
            first, second = impulse[i, j, 0], impulse[i, j, 1]
            p, q, _ = block_sum(kind, decay[j], discriminant[j], frequency_squared[j], 0.0, spans[i])
            result[i, j, 0] = p * first + q * second
            result[i, j, 1] = p * second - q * (frequency_squared[j] * first + 2.0 * decay[j] * second)
    return result


@kernel
def contact_margin(impulses: PeriodicImpulses, level: float, one_stop: bool) -> tuple[float, int]:
    """Return by how much orbits of vanishing impact speed miss the stops between their impacts, and the verdict.

    They are near the stops only at the returns of the forcing to its phase at the graze, or to the opposite one. Below,
    G is the displacement of the contact after an impulse.

    Parameters
    ----------
    impulses : PeriodicImpulses
        One at every impact.
    level : float
        H, the displacement of the contact at an impulse, caused by all earlier ones.
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
    after, frequency_squared = impulses.after, impulses.frequency_squared
    size = abs(level)
    for j in range(after.shape[0]):
        size += abs(after[j, 0]) + abs(after[j, 1]) / math.sqrt(frequency_squared[j])
    for m in range(1, impulses.half_periods):
        stop = 1 if m % 2 == 0 else -1
        if one_stop and stop < 0:
            continue
        time = m * (math.pi / impulses.omega)
        value, terms = 0.0, abs(level)
        for j in range(after.shape[0]):
            y, rate = advance_block(impulses, j, after[j, 0], after[j, 1], time)
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
