"""Families of periodic motions with one impact, and the periodic sums in their closed forms.

A family is one oscillator at one forcing frequency with a pattern of impacts: one impact on one stop in n forcing
periods, or one on each stop, half of n periods apart (n odd). Its closed forms contain the periodic sums of the impulse
response at the multipliers +1 and -1 (theory, "One impact a period").
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.grazing.kernels.periodic_impulses import PeriodicImpulses, state_before_impulse
from grazemap_core.model.impulse_response import ImpulseResponse, evaluate
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN
from grazemap_core.model.modal import ModalModel
from grazemap_core.records import dataclass


@dataclass(frozen=True)
class Pattern:
    """A pattern of impacts."""

    multiple: int
    """n, the forcing periods after which the motion repeats."""
    symmetric: bool
    """One impact on each stop, half of the n periods apart; otherwise one impact on one stop."""

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
        """Kinds of the sums for the multipliers +1 and -1 (half multipliers, for symmetric motions)."""
        return (ALTERNATING, SAME_SIGN) if self.symmetric else (SAME_SIGN, ALTERNATING)


@dataclass(frozen=True, eq=False)
class PeriodicSums:
    """``sum_{k>=1} mu^-k g(k tau)`` and the same with g', g'', at ``mu = +1`` and ``mu = -1``.

    For symmetric motions, whose impulses alternate in sign, the signs of the terms are alternated too.
    """

    displacement: float
    """H at mu = +1: displacement of the contact just before an impact, caused by unit impulses at all earlier ones."""
    velocity: float
    """H' at mu = +1: its velocity."""
    acceleration: float
    """H'' at mu = +1: its acceleration."""
    acceleration_after: float
    """The acceleration just after an impulse, caused by it and all earlier ones."""
    doubled_displacement: float
    """H at mu = -1."""
    doubled_velocity: float
    """H' at mu = -1."""
    doubled_acceleration: float
    """H'' at mu = -1."""
    impulses: PeriodicImpulses
    """The impulses at mu = +1, as the kernels take them."""


def before_impulse(kind: int, blocks: ImpulseResponse | ModalModel, unit_impulse: Floats, span: float) -> Floats:
    """Return the blocks' state (N, 2) just before an impulse from all earlier ones, one per span.

    `unit_impulse` (N, 2) is the effect of one of them; `kind` is SAME_SIGN or ALTERNATING.
    """
    first, second = np.ascontiguousarray(unit_impulse[:, 0]), np.ascontiguousarray(unit_impulse[:, 1])
    of_blocks = blocks.decay, blocks.discriminant, blocks.frequency_squared, first, second
    return np.asarray(state_before_impulse(kind, of_blocks, span))


def periodic_sums(response: ImpulseResponse, pattern: Pattern, omega: float) -> PeriodicSums:
    """Return the sums of a family."""
    tau = pattern.spacing(omega)
    same, doubled = (state_before_impulse(kind, response.blocks, tau) for kind in pattern.kinds)
    total = np.add.reduce
    after = same.copy()
    after[:, 0] += response.value
    after[:, 1] += response.slope
    acceleration, acceleration_after, doubled_acceleration = (
        float(total(-response.frequency_squared * state[:, 0] - 2.0 * response.decay * state[:, 1]))
        for state in (same, after, doubled)
    )
    return PeriodicSums(
        displacement=float(total(same[:, 0])),
        velocity=float(total(same[:, 1])),
        acceleration=acceleration,
        acceleration_after=acceleration_after,
        doubled_displacement=float(total(doubled[:, 0])),
        doubled_velocity=float(total(doubled[:, 1])),
        doubled_acceleration=doubled_acceleration,
        impulses=PeriodicImpulses(
            decay=response.decay,
            discriminant=response.discriminant,
            frequency_squared=response.frequency_squared,
            after=after,
            omega=float(omega),
            half_periods=pattern.half_periods,
        ),
    )


def sum_slopes(response: ImpulseResponse, pattern: Pattern, omega: float) -> tuple[tuple[float, float, float], ...]:
    """Return for mu = +1 and -1 the derivative of H with respect to omega, its round-off, and the size of its terms."""
    tau = pattern.spacing(omega)
    slopes = []
    for kind in pattern.kinds:
        _, by_spacing, roundoff, terms = evaluate(response, [tau], kind)
        slopes.append((float(-by_spacing[0] * tau / omega), float(roundoff[0]), float(terms[0])))
    return tuple(slopes)
