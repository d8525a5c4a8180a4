"""Special orbits with one impact on a stop in n periods at one frequency, and whether orbits meet a stop a second time.

Saddle-nodes (SN), period doublings (PD) and symmetry breakings (SB) are zeros of trigonometric polynomials of the phase
of the impact, of which none is missed. At a graze (GR) a further contact begins. Under one harmonic, with one stop or
with two that are alike, the orbits that meet no stop a second time are those above one phase, and this phase is found
without a grid. In all other cases grazes are looked for on a grid of phases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.periodic_impulses import ADMISSIBLE, NEVER, contact_margin
from grazemap_core.orbits.family import ForcedFamily, OrbitFamily
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, NO_FURTHER_CONTACT, TOUCHES, contact_scratch
from grazemap_core.orbits.kernels.one_impact_contacts import (
    Contacts,
    MotionScratch,
    OneImpactMotions,
    StopGap,
    contacts_at,
    contacts_begin,
    first_admissible,
)
from grazemap_core.orbits.single_impact.harmonics import Harmonics, within_turn
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from grazemap_core.orbits.tolerances import GRAZE_OFFSET, GRAZE_PHASES, ORBIT_FLOOR
from grazemap_core.records import NamedTuple


class SpecialOrbit(NamedTuple):
    """A special orbit at one frequency."""

    phase: float
    """Phase of the impact."""
    speed: float
    """Speed of the impact."""
    gap: float
    """Gap of the stop of the impact."""
    admissible: bool | None
    """Whether the orbit has no contact with a stop other than its impacts; None where round-off hides it."""
    stop: int
    """Stop of the further contact of a GR, +1 or -1; else 0."""


ABSENT = StopGap(math.inf)
"""The gap of an absent stop."""
ALIKE = StopGap(0.0, 1.0)
"""The gap of the stop that is struck."""


class AdmissibleFrom(NamedTuple):
    """Where the admissible orbits of one interval of phases begin."""

    phase: float
    """Orbits up to this phase are not admissible, orbits above it are."""
    stop: int
    """The stop that is touched there, +1 or -1; 0 where both gaps are 0 there."""
    any: bool | None
    """Whether there are any; None where round-off hides it."""


class StopMotions:
    """Orbits with one impact on a stop in n periods, at one frequency.

    Symmetric orbits have its mirror image on the other stop.
    """

    def __init__(self, forced: ForcedFamily, stop: int, other: StopGap) -> None:
        """Set up the polynomials of the phase, and the equations. Raises as `OneImpactOrbits`.

        Parameters
        ----------
        forced : ForcedFamily
        stop : int
            +1 or -1.
        other : StopGap
            The gap of the other stop.
        """
        self.other = other
        self._restitution = forced.family.oscillator.restitution_of(stop)
        self.orbits = OneImpactOrbits(forced, stop, 1.0 + self._restitution)
        self.problem = forced.problem(forced.steady_size)
        self._scratch = MotionScratch(
            sides=np.zeros(1),
            phases=np.zeros(1),
            speeds=np.zeros(1),
            contact=contact_scratch(1, len(self.problem.decay)),
        )

    def at(self, omega: float) -> StopMotions:
        """Return the orbits at another frequency."""
        return StopMotions(self.family.at(omega), self.stop, self.other)

    @property
    def stop(self) -> int:
        """The stop of the impact."""
        return self.orbits.stop

    @property
    def family(self) -> OrbitFamily:
        """The structure and the pattern of impacts."""
        return self.orbits.forced.family

    @property
    def has_one_interval(self) -> bool:
        """Whether the phases of admissible orbits, if there are any, are one interval next to the graze.

        They are under one harmonic where the other stop is absent or alike (theory, "One impact a period").
        """
        return self.family.has_one_harmonic and self.other in (ABSENT, ALIKE)

    def has_at_most_one(self, kind: str) -> bool:
        """Return whether there is at most one special orbit of a type."""
        return self.has_one_interval if kind == "GR" else self.family.has_one_harmonic

    @property
    def types(self) -> tuple[str, ...]:
        """The types of special orbits."""
        return ("SN", "SB" if self.family.pattern.symmetric else "PD", "GR")

    def _motions(self, struck: StopGap, other: StopGap) -> OneImpactMotions:
        """Return the orbits as the kernels take them, with the gaps at which contacts are looked for."""
        length = self.problem.length
        return OneImpactMotions(
            problem=self.problem,
            speed=_parts(self.orbits.speeds, length),
            gap=_parts(self.orbits.gaps),
            pressing=_parts(self.orbits.pressing, length),
            stop=float(self.stop),
            struck=struck,
            other=other,
            restitution=self._restitution,
        )

    def contacts(self, phases: Floats) -> Contacts:
        """Return whether the orbits at phases (m,) have a further contact.

        Raises
        ------
        ParameterError
            The motion oscillates too often between two impacts.
        """
        contacts = _empty(len(phases))
        contacts_at(self._motions(ALIKE, self.other), phases, -ORBIT_FLOOR, contacts, self._scratch)
        if np.any(contacts.status == GIVEN_UP):
            raise _too_many_oscillations()
        return contacts

    def reach(self, phases: Floats) -> Floats:
        """Return how far the orbits at phases (m,) move toward the other stop: the gap at which they touch it.

        Minus infinity without a maximum.
        """
        contacts = _empty(len(phases))
        contacts_at(self._motions(ABSENT, StopGap(0.0)), phases, -math.inf, contacts, self._scratch)
        return contacts.excess * self.problem.length

    def orbits_at(self, phases: Sequence[float]) -> list[SpecialOrbit]:
        """Return the orbits at phases. Raises as `contacts`."""
        return [
            self._orbit(phase, admissible, 0)
            for phase, admissible in zip(phases, self._are_admissible(phases), strict=True)
        ]

    @property
    def _ends_at_graze(self) -> bool:
        """Whether the admissible orbits are those above one phase, up to the graze of the steady motion.

        Where impacts feed in no energy, the speed has the sign of the velocity of the steady motion. The graze is then
        at the end of the interval of phases.
        """
        return self.has_one_interval and self.orbits.straight > 0.0

    def _are_admissible(self, phases: Sequence[float]) -> list[bool | None]:
        begin = self.admissible_from if self._ends_at_graze else None
        if begin is not None and begin.any is not None:
            middle = 0.5 * sum(self.phases_of_impacts[0])
            above = [math.remainder(phase - middle, 2.0 * math.pi) > begin.phase - middle for phase in phases]
            return [begin.any and is_above for is_above in above]
        return [_verdict(status) for status in self.contacts(np.array(phases, dtype=np.float64)).status.tolist()]

    def special(self, kind: str) -> list[SpecialOrbit]:
        """Return the special orbits of a type."""
        if kind == "GR":
            if not self._ends_at_graze:
                return self._grazes()
            begin = self.admissible_from
            return [] if begin.any is False or begin.stop == 0 else [self._orbit(begin.phase, begin.any, begin.stop)]
        return self.orbits_at(self.orbits.saddle_nodes() if kind == "SN" else self.orbits.period_doublings())

    @cached_property
    def admissible_from(self) -> AdmissibleFrom:
        """Where the admissible orbits begin, if they are those above one phase.

        The orbits of vanishing speed decide whether there are any. Where round-off hides their contacts, one admissible
        orbit between the phase and the graze shows that there are.
        """
        sums, is_alone = self.orbits.sums, self.other == ABSENT
        _, slow = contact_margin(sums.impulses, sums.displacement, is_alone)
        start, end = self.phases_of_impacts[0]
        if slow == NEVER:
            return AdmissibleFrom(end, 0, False)
        begin, stop = start, 0
        if not is_alone:  # both gaps are 0 at a phase; below it the stops have changed sides
            begin = _zero_after(start, self.orbits.gaps)
        if self._restitution == 0.0:  # up to a phase the contact is pressed to the stop and stays on it
            released = _zero_after(start, self.orbits.pressing)
            if released > begin:
                begin, stop = released, self.stop
        status, phase, touched = first_admissible(self._motions(ALIKE, self.other), begin, end, self._scratch)
        if status == GIVEN_UP:
            raise _too_many_oscillations()
        answer = AdmissibleFrom(phase, touched or stop, None)
        if phase < end and status == NO_FURTHER_CONTACT:
            middle = np.array([0.5 * (phase + end)])
            if slow == ADMISSIBLE or self.contacts(middle).status[0] == NO_FURTHER_CONTACT:
                return answer._replace(any=True)
        return answer

    def _grazes(self) -> list[SpecialOrbit]:
        """Return the orbits at which a further contact begins, next to admissible ones."""
        clear: list[float] = []
        met: list[float] = []
        for start, end in self.phases_of_impacts:
            shares = np.linspace(0.0, 1.0, GRAZE_PHASES * len(self.orbits.toward.orders) + 1)
            shares[0], shares[-1] = GRAZE_OFFSET, 1.0 - GRAZE_OFFSET
            phases = start + (end - start) * shares
            fine = self.contacts(phases).status == NO_FURTHER_CONTACT
            for i in np.flatnonzero(fine[1:] != fine[:-1]).tolist():
                clear.append(float(phases[i if fine[i] else i + 1]))
                met.append(float(phases[i + 1 if fine[i] else i]))
        if not clear:
            return []
        places, contacts = np.array(clear), _empty(len(clear))
        contacts_begin(self._motions(ALIKE, self.other), places, np.array(met), contacts, self._scratch)
        return [
            self._orbit(phase, True, stop) for phase, stop in zip(places.tolist(), contacts.stop.tolist(), strict=True)
        ]

    @cached_property
    def phases_of_impacts(self) -> list[tuple[float, float]]:
        """The intervals of phases in which the impact is not virtual."""
        zeros = self.orbits.speeds.zeros()
        ends = [*zeros, zeros[0] + 2.0 * math.pi] if zeros else []
        return [(a, b) for a, b in pairwise(ends) if self.orbits.speeds.at(0.5 * (a + b)) > 0.0]

    def _orbit(self, phase: float, admissible: bool | None, stop: int) -> SpecialOrbit:
        speed = max(self.orbits.speed(phase), 0.0)  # below it by round-off alone
        return SpecialOrbit(phase, speed, self.orbits.gap(phase), admissible, stop)


def _verdict(status: int) -> bool | None:
    """Return whether an orbit is admissible, from the status of its contacts."""
    return None if status == TOUCHES else status == NO_FURTHER_CONTACT


def _zero_after(start: float, polynomial: Harmonics) -> float:
    """Return the first zero of a polynomial of one harmonic from a phase on."""
    return start + min(within_turn(zero - start) for zero in polynomial.zeros())


def _too_many_oscillations() -> ParameterError:
    return ParameterError("omega", "the motion oscillates too often between two impacts to be searched")


def _parts(polynomial: Harmonics, unit: float = 1.0) -> Floats:
    """Return the amplitudes of a polynomial in a unit, (H, 2): real and imaginary parts."""
    return np.array([[amplitude.real / unit, amplitude.imag / unit] for amplitude in polynomial.amplitudes])


def _empty(count: int) -> Contacts:
    return Contacts(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count, dtype=np.int64))
