"""Orbits with one impact in n forcing periods, or one on each stop, between any stops and under any harmonics.

The speed of the impact follows from its phase, so the orbits at a frequency are explicit in this phase, for all gaps of
the stop: no guess is needed. With the impact at the phase t0 on the right stop,

    v = q_f'(t0)/D,    gap = q_f(t0) - c v,    D = 1 + (1 + R) H'(1), c = (1 + R) H(1)

where q_f is the steady motion and H the periodic sums of `grazing.one_impact_family`. On the left stop q is -q. Every
condition on the phase is a trigonometric polynomial, of the degree of the highest harmonic (theory, "One impact a
period"). Whether an orbit meets a stop a second time is decided in `special_orbits`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.errors import ConditioningError
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.orbits.family import ForcedFamily, OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.equations import rebound_of
from grazemap_core.orbits.single_impact.harmonics import Harmonics, Places
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class OneImpactOrbits:
    """All orbits with one impact in n forcing periods on one stop, at several frequencies, for all gaps of that stop.

    Symmetric ones have an impact on the other stop, too, half of n periods later. ConditioningError is raised where
    round-off hides by which factor the steady motion determines the speed. Rows are frequencies.
    """

    forced: Sequence[ForcedFamily]
    """The family at each frequency, (m,)."""
    stop: int
    """+1 or -1."""
    rebound: float
    """1 + R of the stop."""

    def __post_init__(self) -> None:
        size = 1.0 + self.rebound * np.abs(self._sum("velocity"))
        if np.any(np.abs(self.straight) <= RESPONSE_ROUNDOFF * size):
            raise ConditioningError("the impact speed is not determined: hardly any energy is lost in a period")

    @property
    def family(self) -> OrbitFamily:
        """The structure and the pattern of impacts."""
        return self.forced[0].family

    @cached_property
    def omega(self) -> Floats:
        """The forcing frequencies, (m,)."""
        return np.array([at.omega for at in self.forced])

    @cached_property
    def toward(self) -> Harmonics:
        """The steady motion toward the stop."""
        return Harmonics.of_steady(self.forced).times(float(self.stop))

    def _sum(self, name: str) -> Floats:
        """Return a number of `PeriodicSums`, the response to unit impulses at all earlier impacts, (m,)."""
        return np.array([getattr(at.sums, name) for at in self.forced])

    @cached_property
    def straight(self) -> Floats:
        """D = 1 + (1 + R) H'(1), the velocity of the steady motion at an impact over the speed of the impact, (m,)."""
        return 1.0 + self.rebound * self._sum("velocity")

    @cached_property
    def speeds(self) -> Harmonics:
        """The impact speed, over omega, as a function of the phase of the impact."""
        return self.toward.derivative().times(1.0 / self.straight)

    @cached_property
    def gaps(self) -> Harmonics:
        """The gap as a function of the phase of the impact."""
        return self.toward.plus(-self.rebound * self._sum("displacement") * self.omega, self.speeds)

    @cached_property
    def pressing(self) -> Harmonics:
        """The acceleration toward the stop just after the impact, over omega^2, as a function of its phase."""
        steady = self.toward.derivative().derivative()
        return steady.plus(-self.rebound * self._sum("acceleration_after") / self.omega, self.speeds)

    def speed(self, phases: Floats | float, rows: Integers | int = 0) -> Floats:
        """Return the speeds of the impacts at phases, as `Harmonics.at`; an impact is virtual where it is negative."""
        return self.omega[rows] * self.speeds.at(phases, rows)

    def gap(self, phases: Floats | float, rows: Integers | int = 0) -> Floats:
        """Return the gaps of the stop, as `Harmonics.at`, with which there is an impact at a phase."""
        return self.gaps.at(phases, rows)

    def phases(self, gap: float) -> Places:
        """Return the phases of impacts that are not virtual, for a gap of the stop."""
        zeros = self.gaps._replace(constants=np.full(len(self.forced), -gap)).zeros()
        return zeros.where(self.speeds.at(*zeros) > 0.0)

    def saddle_nodes(self) -> Places:
        """Return the phases at which the gap has an extremum over the phase, and the impact is not virtual.

        ``q_f' - e H(1) v' = 0`` with e = 1 + R; here v' is the derivative of the speed by the phase.
        """
        factor = self.rebound * self._sum("displacement") * self.omega
        return self._balances(self.straight, factor, self.speeds.derivative())

    def period_doublings(self) -> Places:
        """Return the phases at which a multiplier is -1, and the impact is not virtual; a half one of symmetric orbits.

        ``[D(-1)^2 + e^2 H(-1) (H''(1) - H''(-1))] q_f'/D(1) - e H(-1) q_f'' = 0`` with e = 1 + R, D = 1 + e H'.
        """
        e, doubled = self.rebound, self._sum("doubled_displacement")
        straight = 1.0 + e * self._sum("doubled_velocity")
        change = e * e * doubled * (self._sum("acceleration") - self._sum("doubled_acceleration"))
        acceleration = self.toward.derivative().derivative()
        return self._balances(straight * straight + change, e * doubled * self.omega, acceleration)

    def _balances(self, factor: Floats, other_factor: Floats, other: Harmonics) -> Places:
        """Return the phases at which a multiple of the speed is one of other polynomials, and the speed is positive.

        Where the factor of the other one is small, so is the speed, and round-off may hide its sign; that of the other
        polynomial then shows it.
        """
        zeros = self.speeds.times(factor).plus(-other_factor, other).zeros()
        sign = other.times(factor * other_factor).plus(other_factor * other_factor, self.speeds)
        return zeros.where(sign.at(*zeros) > 0.0)

    def impacts(self, phase: float, row: int = 0) -> ImpactSequence:
        """Return the impacts of the orbit with an impact at a phase."""
        pattern, velocity = self.family.pattern, self.stop * float(self.speed(phase, row))
        return ImpactSequence.create(pattern.multiple, [self.stop], [phase], [velocity], pattern.symmetric)


def one_impact_sequences(forced: ForcedFamily, stops: Stops, stop: int) -> list[ImpactSequence]:
    """Return the impacts of all orbits with one impact on a stop in the family's period, by decreasing speed."""
    orbits = OneImpactOrbits([forced], stop, rebound_of(stops, stop))
    phases = orbits.phases(gap_of(stops, stop)).phases
    order = np.argsort(-orbits.speed(phases), kind="stable")
    return [orbits.impacts(phase) for phase in phases[order].tolist()]
