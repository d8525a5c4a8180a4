"""Families of periodic motions with one impact: what their closed forms are made of.

A family is one oscillator at one forcing frequency with a pattern of impacts: one impact on one stop in n forcing
periods, or one on either stop, half of n periods apart (n odd). Oscillator, frequency and pattern flow in; the periodic
sums of the impulse response at multipliers +1 and -1 flow out (theory, "One impact a period").
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.kicked_motion import before_kick
from grazemap_core.model.impulse_response import ImpulseResponse, evaluate
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN


@dataclass(frozen=True)
class Pattern:
    """A pattern of impacts.

    Attributes
    ----------
    multiple : int
        n, the forcing periods after which the motion repeats.
    symmetric : bool
        One impact on either stop, half of the n periods apart; otherwise one impact on one stop.
    """

    multiple: int
    symmetric: bool

    def __post_init__(self) -> None:
        checked_order("multiple", self.multiple, 1)
        if self.symmetric and self.multiple % 2 == 0:
            raise ParameterError("multiple", "must be odd for symmetric motions")

    @property
    def half_periods(self) -> int:
        """Half forcing periods between one impact and the next."""
        return self.multiple if self.symmetric else 2 * self.multiple

    def spacing(self, omega: float) -> float:
        """Return the time between one impact and the next."""
        return self.half_periods * (np.pi / omega)

    @property
    def kinds(self) -> tuple[int, int]:
        """Sums for the multipliers +1 and -1 (of the signed half period, for symmetric motions)."""
        return (ALTERNATING, SAME_SIGN) if self.symmetric else (SAME_SIGN, ALTERNATING)


@dataclass(frozen=True, eq=False)
class KickSums:
    """``sum_{k>=1} mu^-k g(k tau)`` and the same with g', g'', at ``mu = +1`` and ``mu = -1``.

    Signs alternate the other way round for symmetric motions, whose kicks do.

    Attributes
    ----------
    displacement, velocity, acceleration : float
        H, H', H'' at mu = +1: what mass 1 has just before an impact from all earlier ones, each a unit kick.
    doubled_displacement, doubled_velocity, doubled_acceleration : float
        At mu = -1.
    state : ndarray of shape (N, 2)
        Each block's part in displacement and velocity of mass 1 just behind a kick, it included.
    """

    displacement: float
    velocity: float
    acceleration: float
    doubled_displacement: float
    doubled_velocity: float
    doubled_acceleration: float
    state: Floats


def kick_sums(response: ImpulseResponse, pattern: Pattern, omega: float) -> KickSums:
    """Return the sums of a family."""
    tau = pattern.spacing(omega)
    before, bends = [], []
    for kind in pattern.kinds:
        state = before_kick(
            kind,
            response.decay,
            response.discriminant,
            response.frequency_squared,
            response.value,
            response.slope,
            tau,
        )
        before.append(state)
        bends.append(float(np.sum(-response.frequency_squared * state[:, 0] - 2.0 * response.decay * state[:, 1])))
    same, doubled = before
    return KickSums(
        displacement=float(np.sum(same[:, 0])),
        velocity=float(np.sum(same[:, 1])),
        acceleration=bends[0],
        doubled_displacement=float(np.sum(doubled[:, 0])),
        doubled_velocity=float(np.sum(doubled[:, 1])),
        doubled_acceleration=bends[1],
        state=same + np.stack([response.value, response.slope], axis=1),
    )


def sum_slopes(response: ImpulseResponse, pattern: Pattern, omega: float) -> tuple[tuple[float, float, float], ...]:
    """Return, for mu = +1 and -1, the derivative of H by omega, H's round-off, and its terms at this omega."""
    tau = pattern.spacing(omega)
    slopes = []
    for kind in pattern.kinds:
        _, by_spacing, roundoff, terms = evaluate(response, [tau], kind)
        slopes.append((float(-by_spacing[0] * tau / omega), float(roundoff[0]), float(terms[0])))
    return tuple(slopes)
