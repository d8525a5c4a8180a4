"""Orbits with one impact in n forcing periods, or one on each stop, between any stops and under any harmonics.

The speed of the impact follows from its phase, so the orbits at a frequency are explicit in this phase, for all gaps of
the stop: no guess is needed. With the impact at the phase t0 on the right stop,

    v = q_f'(t0)/D,    gap = q_f(t0) - c v,    D = 1 + (1 + R) H'(1), c = (1 + R) H(1)

where q_f is the steady motion and H the periodic sums of `grazing.one_impact_family`. On the left stop q is -q. Every
condition on the phase is a trigonometric polynomial, of the degree of the highest harmonic (theory, "Any linear
structure"). Whether an orbit meets a stop a second time is decided in `special_orbits`.
"""

from __future__ import annotations

from functools import cached_property

from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.errors import ConditioningError
from grazemap_core.grazing.one_impact_family import PeriodicSums
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.orbits.family import ForcedFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import rebound_of
from grazemap_core.orbits.single_impact.harmonics import Harmonics
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class OneImpactOrbits:
    """All orbits with one impact in n forcing periods on one stop, at one frequency, for all gaps of that stop.

    Symmetric ones have an impact on the other stop, too, half of n periods later. ConditioningError is raised where
    round-off hides by which factor the steady motion determines the speed.
    """

    forced: ForcedFamily
    """The family at the frequency."""
    stop: int
    """+1 or -1."""
    rebound: float
    """1 + R of the stop."""

    def __post_init__(self) -> None:
        if abs(self.straight) <= RESPONSE_ROUNDOFF * (1.0 + self.rebound * abs(self.sums.velocity)):
            raise ConditioningError("the impact speed is not determined: hardly any energy is lost in a period")

    @property
    def omega(self) -> float:
        """The forcing frequency."""
        return self.forced.omega

    @cached_property
    def toward(self) -> Harmonics:
        """The steady motion toward the stop."""
        return Harmonics.of_steady(self.forced).times(float(self.stop))

    @property
    def sums(self) -> PeriodicSums:
        """The response to unit impulses at all earlier impacts."""
        return self.forced.sums

    @property
    def straight(self) -> float:
        """D = 1 + (1 + R) H'(1), the velocity of the steady motion at an impact over the speed of the impact."""
        return 1.0 + self.rebound * self.sums.velocity

    @cached_property
    def speeds(self) -> Harmonics:
        """The impact speed, over omega, as a function of the phase of the impact."""
        return self.toward.derivative().times(1.0 / self.straight)

    @cached_property
    def gaps(self) -> Harmonics:
        """The gap as a function of the phase of the impact."""
        return self.toward.plus(-self.rebound * self.sums.displacement * self.omega, self.speeds)

    @cached_property
    def pressing(self) -> Harmonics:
        """The acceleration toward the stop just after the impact, over omega^2, as a function of its phase."""
        steady = self.toward.derivative().derivative()
        return steady.plus(-self.rebound * self.sums.acceleration_after / self.omega, self.speeds)

    def speed(self, phase: float) -> float:
        """Return the speed of the impact at a phase; the impact is virtual where it is negative."""
        return self.omega * self.speeds.at(phase)

    def gap(self, phase: float) -> float:
        """Return the gap of the stop, with which there is an impact at a phase."""
        return self.gaps.at(phase)

    def phases(self, gap: float) -> list[float]:
        """Return the phases of impacts that are not virtual, for a gap of the stop."""
        level = Harmonics(self.toward.orders, self.gaps.amplitudes, -gap)
        return [phase for phase in level.zeros() if self.speeds.at(phase) > 0.0]

    def saddle_nodes(self) -> list[float]:
        """Return the phases at which the gap has an extremum over the phase, and the impact is not virtual.

        ``q_f' - e H(1) v' = 0`` with e = 1 + R; here v' is the derivative of the speed by the phase.
        """
        factor = self.rebound * self.sums.displacement * self.omega
        return self._balances(self.straight, factor, self.speeds.derivative())

    def period_doublings(self) -> list[float]:
        """Return the phases at which a multiplier is -1, and the impact is not virtual; a half one of symmetric orbits.

        ``[D(-1)^2 + e^2 H(-1) (H''(1) - H''(-1))] q_f'/D(1) - e H(-1) q_f'' = 0`` with e = 1 + R, D = 1 + e H'.
        """
        sums, e = self.sums, self.rebound
        straight = 1.0 + e * sums.doubled_velocity
        change = e * e * sums.doubled_displacement * (sums.acceleration - sums.doubled_acceleration)
        acceleration = self.toward.derivative().derivative()
        return self._balances(straight * straight + change, e * sums.doubled_displacement * self.omega, acceleration)

    def _balances(self, factor: float, other_factor: float, other: Harmonics) -> list[float]:
        """Return the phases at which a multiple of the speed is one of another polynomial, and the speed is positive.

        Where the factor of the other one is small, so is the speed, and round-off may hide its sign; that of the other
        polynomial then shows it.
        """
        zeros = self.speeds.times(factor).plus(-other_factor, other).zeros()
        sign = other.times(factor * other_factor).plus(other_factor * other_factor, self.speeds)
        return [phase for phase in zeros if sign.at(phase) > 0.0]

    def impacts(self, phase: float) -> ImpactSequence:
        """Return the impacts of the orbit with an impact at a phase."""
        pattern, velocity = self.forced.family.pattern, self.stop * self.speed(phase)
        return ImpactSequence.create(pattern.multiple, [self.stop], [phase], [velocity], pattern.symmetric)


def one_impact_sequences(forced: ForcedFamily, stops: Stops, stop: int) -> list[ImpactSequence]:
    """Return the impacts of all orbits with one impact on a stop in the family's period, by decreasing speed."""
    orbits = OneImpactOrbits(forced, stop, rebound_of(stops, stop))
    phases = orbits.phases(gap_of(stops, stop))
    return [orbits.impacts(phase) for phase in sorted(phases, key=orbits.speed, reverse=True)]
