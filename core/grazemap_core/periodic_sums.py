"""Periodic sums of the impulse response, whose zeros are the resonant grazing points (theory, section 7).

    h(tau)   = sum_{k >= 1} g(k tau)            a kick every tau
    h_s(tau) = sum_{k >= 1} (-1)^k g(k tau)     a kick every tau, from alternating sides

With tau = n T the first belongs to saddle-nodes of one-sided orbits with one impact in n periods and the second to
their period doubling; with tau = n T/2, n odd, the second belongs to saddle-nodes of symmetric orbits and the first to
their symmetry breaking. Both are closed form, block by block.
"""

from __future__ import annotations

from numpy.typing import ArrayLike

from grazemap_core.impulse_response import ImpulseResponse, evaluate
from grazemap_core.kernels.response_sums import ALTERNATING, SAME_SIGN
from grazemap_core.oscillator import Floats


def same_sign_sum(response: ImpulseResponse, spacing: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    """Return h, its derivative, a round-off bound and the size of its terms at spacings of shape (n,), all damped."""
    return evaluate(response, spacing, SAME_SIGN)


def alternating_sum(response: ImpulseResponse, spacing: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    """Return h_s, its derivative, a round-off bound and the size of its terms at spacings of shape (n,), all damped."""
    return evaluate(response, spacing, ALTERNATING)
