"""Families of periodic motions with one impact, and the periodic sums in their closed forms.

A family is one oscillator at one forcing frequency with a pattern of impacts: one impact on one stop in n forcing
periods, or one on each stop, half of n periods apart (n odd). Its closed forms contain the periodic sums of the impulse
response at the multipliers +1 and -1 (theory, "One impact a period").
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.grazing.kernels.periodic_impulses import PeriodicImpulses, states_before_impulse
from grazemap_core.model.impulse_response import ImpulseResponse, evaluate
from grazemap_core.model.kernels.response_sums import ALTERNATING, SAME_SIGN
from grazemap_core.model.modal import ModalModel
from grazemap_core.records import NamedTuple, dataclass

Numbers = TypeVar("Numbers", float, Floats)


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

    def spacing(self, omega: Numbers) -> Numbers:
        """Return the time between one impact and the next."""
        return self.half_periods * (np.pi / omega)

    @property
    def kinds(self) -> tuple[int, int]:
        """Kinds of the sums for the multipliers +1 and -1 (half multipliers, for symmetric motions)."""
        return (ALTERNATING, SAME_SIGN) if self.symmetric else (SAME_SIGN, ALTERNATING)


class PeriodicSums(NamedTuple):
    """``sum_{k>=1} mu^-k g(k tau)`` and the same with g', g'', at ``mu = +1`` and ``mu = -1``.

    For symmetric motions, whose impulses alternate in sign, the signs of the terms are alternated too.
    """

    response: ImpulseResponse
    """g, the response to one impulse."""
    pattern: Pattern
    """The pattern of impacts, which gives tau."""
    omega: float
    """Frequency of the forces."""
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
    after: Floats
    """(N, 2) The blocks' contributions to displacement and velocity of the contact just after an impulse, mu = +1."""
    doubled_after: Floats
    """(N, 2) The same at mu = -1."""
    after_by_span: Floats
    """(N, 2) The derivative of `after` with respect to the span, without the factor of the blocks' generator."""

    @property
    def impulses(self) -> PeriodicImpulses:
        """The impulses at mu = +1, as the kernels take them."""
        g = self.response
        rates = g.decay, g.discriminant, g.frequency_squared
        return PeriodicImpulses(*rates, self.after, self.omega, self.pattern.half_periods)


def before_impulse(kind: int, blocks: ImpulseResponse | ModalModel, impulse: Floats, spans: Floats) -> Floats:
    """Return the blocks' state just before an impulse from all earlier ones, one per span, for spans (m,); (m, N, 2).

    `impulse` (N, 2), or (m, N, 2), is the effect of one of them; `kind` is SAME_SIGN or ALTERNATING.
    """
    impulses = np.ascontiguousarray(np.broadcast_to(impulse, (len(spans), *impulse.shape[-2:])))
    of_blocks = blocks.decay, blocks.discriminant, blocks.frequency_squared
    return np.asarray(states_before_impulse(kind, of_blocks, impulses, spans))


def periodic_sums(response: ImpulseResponse, pattern: Pattern, omega: Floats) -> list[PeriodicSums]:
    """Return the sums of a family at each of several frequencies (m,)."""
    spans, unit = pattern.spacing(omega), response.unit_impulse
    before, doubled = (before_impulse(kind, response, unit, spans) for kind in pattern.kinds)
    after = before + unit
    numbers = [
        *(np.add.reduce(before[:, :, c], axis=1) for c in range(2)),
        _acceleration(response, before),
        _acceleration(response, after),
        *(np.add.reduce(doubled[:, :, c], axis=1) for c in range(2)),
        _acceleration(response, doubled),
    ]
    states = after, doubled + unit, spans[:, None, None] * before_impulse(pattern.kinds[0], response, after, spans)
    at_each = zip(omega.tolist(), np.stack(numbers, axis=1).tolist(), *states, strict=True)
    return [PeriodicSums(response, pattern, at, *sums, *of_blocks) for at, sums, *of_blocks in at_each]


def _acceleration(response: ImpulseResponse, states: Floats) -> Floats:
    """Return the acceleration of the contact (m,) from the blocks' states (m, N, 2)."""
    terms = -response.frequency_squared * states[:, :, 0] - 2.0 * response.decay * states[:, :, 1]
    return np.asarray(np.add.reduce(terms, axis=1))


def sum_slopes(sums: PeriodicSums) -> tuple[tuple[float, float, float], ...]:
    """Return for mu = +1 and -1 the derivative of H with respect to omega, its round-off, and the size of its terms."""
    omega, tau = sums.omega, sums.pattern.spacing(sums.omega)
    slopes = []
    for kind in sums.pattern.kinds:
        _, by_spacing, roundoff, terms = evaluate(sums.response, [tau], kind)
        slopes.append((float(-by_spacing[0] * tau / omega), float(roundoff[0]), float(terms[0])))
    return tuple(slopes)
