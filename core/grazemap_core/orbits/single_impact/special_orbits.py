"""Special orbits with one impact on a stop in n periods at one frequency, and whether orbits meet a stop a second time.

Saddle-nodes (SN), period doublings (PD) and symmetry breakings (SB) are zeros of trigonometric polynomials of the phase
of the impact, of which none is missed. Under one harmonic, alone with one stop or between like ones, the orbits that
meet no stop a second time are those above one phase, which is found without a grid; otherwise such phases, at which a
further contact begins (GR), are looked for on a grid.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.periodic_impulses import ADMISSIBLE, NEVER, contact_margin
from grazemap_core.orbits.family import OrbitFamily, steady_size
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, NO_FURTHER_CONTACT, TOUCHES, contact_scratch
from grazemap_core.orbits.kernels.one_impact_contacts import (
    Contacts,
    MotionScratch,
    OneImpactMotions,
    contacts_at,
    contacts_begin,
    first_admissible,
)
from grazemap_core.orbits.single_impact.harmonics import Harmonics, within_turn
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from grazemap_core.orbits.tolerances import GRAZE_OFFSET, GRAZE_PHASES, ORBIT_FLOOR
from grazemap_core.records import NamedTuple, dataclass


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


class SecondStop(NamedTuple):
    """The gap ``fixed + by_gap gap`` of the stop without an impact; infinite if it is absent."""

    fixed: float
    """The gap where `by_gap` is 0; infinite for an absent stop."""
    by_gap: float = 0.0
    """Change of the gap by that of the other stop."""


ABSENT = SecondStop(math.inf)
ALIKE = SecondStop(0.0, 1.0)
"""It has the gap of the stop that is struck."""


class AdmissibleFrom(NamedTuple):
    """Where the admissible orbits of one interval of phases begin."""

    phase: float
    """Orbits up to this phase are not admissible, orbits above it are."""
    stop: int
    """The stop that is touched there, +1 or -1; 0 where both gaps are 0 there."""
    any: bool | None
    """Whether there are any; None where round-off hides it."""


@dataclass(frozen=True, eq=False)
class StopFamily:
    """Orbits with one impact on a stop in n periods; symmetric orbits have its mirror image on the other stop."""

    family: OrbitFamily
    """All motions of the pattern."""
    stop: int
    """+1 or -1."""
    other: SecondStop
    """The gap of the other stop."""

    def at(self, omega: float, steady: Complexes) -> StopMotions:
        """Return the orbits at a frequency; `steady` are the amplitudes there."""
        return StopMotions(self, omega, steady)

    @property
    def has_one_harmonic(self) -> bool:
        """Whether the forces have one harmonic, of order 1."""
        return [harmonic.order for harmonic in self.family.oscillator.forces] == [1]

    @property
    def has_one_interval(self) -> bool:
        """Whether the phases of admissible orbits at a frequency, if there are any, are one interval next to the graze.

        They are under one harmonic where the other stop is absent or alike (theory, "One impact a period").
        """
        return self.has_one_harmonic and (self.other == ABSENT or self.other == ALIKE)

    def has_at_most_one(self, kind: str) -> bool:
        """Return whether there is at most one special orbit of a type at every frequency."""
        return self.has_one_interval if kind == "GR" else self.has_one_harmonic

    @property
    def types(self) -> tuple[str, ...]:
        """The types of its special orbits."""
        return ("SN", "SB" if self.family.pattern.symmetric else "PD", "GR")


class StopMotions:
    """The orbits of a `StopFamily` at one frequency."""

    def __init__(self, of: StopFamily, omega: float, steady: Complexes) -> None:
        """Set up the polynomials of the phase, and the equations."""
        self.of = of
        restitution = of.family.oscillator.restitution_of(of.stop)
        self.orbits = OneImpactOrbits.of(of.family, omega, of.stop, 1.0 + restitution, steady)
        self.problem = of.family.problem(omega, steady_size(steady), steady)
        self._restitution = restitution
        self._scratch = MotionScratch(
            sides=np.zeros(1),
            phases=np.zeros(1),
            speeds=np.zeros(1),
            flow_between=np.zeros((1, len(self.problem.decay), 4)),
            contact=contact_scratch(len(self.problem.decay)),
        )

    def _motions(self, own: SecondStop, other: SecondStop) -> OneImpactMotions:
        return OneImpactMotions(
            speed=_parts(self.orbits.speeds, self.problem.length),
            gap=_parts(self.orbits.gaps),
            pressing=_parts(self.orbits.pressing, self.problem.length),
            stop=float(self.of.stop),
            own=own.fixed,
            own_by_gap=own.by_gap,
            other=other.fixed,
            other_by_gap=other.by_gap,
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
        motions = self._motions(ALIKE, self.of.other)
        contacts_at(self.problem, motions, phases, -ORBIT_FLOOR, contacts, self._scratch)
        if np.any(contacts.status == GIVEN_UP):
            raise _too_many_oscillations()
        return contacts

    def reach(self, phases: Floats) -> Floats:
        """Return how far the orbits at phases (m,) move toward the other stop: the gap at which they touch it.

        Minus infinity without a maximum.
        """
        contacts = _empty(len(phases))
        motions = self._motions(ABSENT, SecondStop(0.0))
        contacts_at(self.problem, motions, phases, -math.inf, contacts, self._scratch)
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

        Without energy that impacts feed in, the speed has the sign of the velocity of the steady motion, and the graze
        is at the end of its interval.
        """
        return self.of.has_one_interval and self.orbits.straight > 0.0

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
            return self._graze_of_interval() if self._ends_at_graze else self._grazes()
        return self.orbits_at(self.orbits.saddle_nodes() if kind == "SN" else self.orbits.period_doublings())

    @cached_property
    def admissible_from(self) -> AdmissibleFrom:
        """Where the admissible orbits begin, if they are those above one phase.

        Whether there are any is a question of the orbits of vanishing speed. Where round-off hides what these do, an
        admissible orbit between the phase and the graze is the answer.
        """
        response, sums, pattern = self.of.family.response, self.orbits.sums, self.of.family.pattern
        is_alone, omega = self.of.other == ABSENT, self.orbits.omega
        _, slow = contact_margin(
            *response.blocks[:3], sums.state, sums.displacement, omega, pattern.half_periods, is_alone
        )
        start, end = self.phases_of_impacts[0]
        if slow == NEVER:
            return AdmissibleFrom(end, 0, False)
        begin, stop = start, 0
        if not is_alone:  # both gaps are 0 at a phase; below it the stops have changed sides
            begin = _zero_after(start, self.orbits.gaps)
        if self._restitution == 0.0:  # up to a phase the contact is pressed to the stop and stays on it
            released = _zero_after(start, self.orbits.pressing)
            if released > begin:
                begin, stop = released, self.of.stop
        motions = self._motions(ALIKE, self.of.other)
        status, phase, touched = first_admissible(self.problem, motions, begin, end, self._scratch)
        if status == GIVEN_UP:
            raise _too_many_oscillations()
        answer = AdmissibleFrom(phase, touched or stop, None)
        if phase < end and status == NO_FURTHER_CONTACT:
            middle = np.array([0.5 * (phase + end)])
            if slow == ADMISSIBLE or self.contacts(middle).status[0] == NO_FURTHER_CONTACT:
                return answer._replace(any=True)
        return answer

    def _graze_of_interval(self) -> list[SpecialOrbit]:
        """Return the orbit at which the admissible ones begin, if it touches a stop."""
        begin = self.admissible_from
        return [] if begin.any is False or begin.stop == 0 else [self._orbit(begin.phase, begin.any, begin.stop)]

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
        motions = self._motions(ALIKE, self.of.other)
        contacts_begin(self.problem, motions, places, np.array(met), -ORBIT_FLOOR, contacts, self._scratch)
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


def nearest_special(here: StopMotions, kind: str, gap: float) -> SpecialOrbit | None:
    """Return the special orbit of a type whose gap is nearest to a given one; None where there is none of the type."""
    return min(here.special(kind), key=lambda orbit: abs(orbit.gap - gap), default=None)


def _parts(polynomial: Harmonics, unit: float = 1.0) -> Floats:
    """Return the amplitudes of a polynomial in a unit, (H, 2): real and imaginary parts."""
    return np.array([[amplitude.real / unit, amplitude.imag / unit] for amplitude in polynomial.amplitudes])


def _empty(count: int) -> Contacts:
    return Contacts(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count, dtype=np.int64))
