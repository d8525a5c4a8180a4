"""Families of periodic motions with one impact, and the periodic sums in their closed forms.

A family is one oscillator at one forcing frequency with a pattern of impacts: one impact on one stop in n forcing
periods, or one on each stop, half of n periods apart (n odd). Its closed forms contain the periodic sums of the impulse
response at the multipliers +1 and -1 (theory, "One impact a period").
"""

from __future__ import annotations

from functools import cached_property

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

    For symmetric motions, whose impulses alternate in sign, the signs of the terms are alternated too. The blocks'
    states are their contributions to displacement and velocity of the contact.
    """

    response: ImpulseResponse
    """g, the response to one impulse."""
    pattern: Pattern
    """The pattern of impacts."""
    omega: float
    """Frequency of the forces."""

    @cached_property
    def before(self) -> Floats:
        """(N, 2) The blocks' state just before one of the unit impulses, at mu = +1."""
        return self._before(self.pattern.kinds[0])

    @cached_property
    def after(self) -> Floats:
        """(N, 2) The blocks' state just after one of the unit impulses, at mu = +1."""
        return self.before + self.response.unit_impulse

    @cached_property
    def doubled_before(self) -> Floats:
        """(N, 2) As `before`, at mu = -1."""
        return self._before(self.pattern.kinds[1])

    @cached_property
    def displacement(self) -> float:
        """H at mu = +1: displacement of the contact just before an impact, caused by unit impulses at earlier ones."""
        return float(np.add.reduce(self.before[:, 0]))

    @cached_property
    def velocity(self) -> float:
        """H' at mu = +1: its velocity."""
        return float(np.add.reduce(self.before[:, 1]))

    @cached_property
    def acceleration(self) -> float:
        """H'' at mu = +1: its acceleration."""
        return self._acceleration(self.before)

    @cached_property
    def acceleration_after(self) -> float:
        """The acceleration just after an impulse, caused by it and all earlier ones."""
        return self._acceleration(self.after)

    @cached_property
    def doubled_displacement(self) -> float:
        """H at mu = -1."""
        return float(np.add.reduce(self.doubled_before[:, 0]))

    @cached_property
    def doubled_velocity(self) -> float:
        """H' at mu = -1."""
        return float(np.add.reduce(self.doubled_before[:, 1]))

    @cached_property
    def doubled_acceleration(self) -> float:
        """H'' at mu = -1."""
        return self._acceleration(self.doubled_before)

    @cached_property
    def impulses(self) -> PeriodicImpulses:
        """The impulses at mu = +1, as the kernels take them."""
        return PeriodicImpulses(
            decay=self.response.decay,
            discriminant=self.response.discriminant,
            frequency_squared=self.response.frequency_squared,
            after=self.after,
            omega=self.omega,
            half_periods=self.pattern.half_periods,
        )

    def _before(self, kind: int) -> Floats:
        return before_impulse(kind, self.response, self.response.unit_impulse, self.pattern.spacing(self.omega))

    def _acceleration(self, state: Floats) -> float:
        response = self.response
        return float(np.add.reduce(-response.frequency_squared * state[:, 0] - 2.0 * response.decay * state[:, 1]))


def before_impulse(kind: int, blocks: ImpulseResponse | ModalModel, unit_impulse: Floats, span: float) -> Floats:
    """Return the blocks' state (N, 2) just before an impulse from all earlier ones, one per span.

    `unit_impulse` (N, 2) is the effect of one of them; `kind` is SAME_SIGN or ALTERNATING.
    """
    first, second = np.ascontiguousarray(unit_impulse[:, 0]), np.ascontiguousarray(unit_impulse[:, 1])
    of_blocks = blocks.decay, blocks.discriminant, blocks.frequency_squared, first, second
    return np.asarray(state_before_impulse(kind, of_blocks, span))


def sum_slopes(response: ImpulseResponse, pattern: Pattern, omega: float) -> tuple[tuple[float, float, float], ...]:
    """Return for mu = +1 and -1 the derivative of H with respect to omega, its round-off, and the size of its terms."""
    tau = pattern.spacing(omega)
    slopes = []
    for kind in pattern.kinds:
        _, by_spacing, roundoff, terms = evaluate(response, [tau], kind)
        slopes.append((float(-by_spacing[0] * tau / omega), float(roundoff[0]), float(terms[0])))
    return tuple(slopes)
