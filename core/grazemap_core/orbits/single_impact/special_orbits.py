"""Special orbits with one impact on a stop in n periods, and whether orbits meet a stop a second time.

Saddle-nodes (SN), period doublings (PD) and symmetry breakings (SB) are zeros of trigonometric polynomials of the phase
of the impact, of which none is missed. At a graze (GR) a further contact begins. Under one harmonic, with one stop or
with two that are alike, the orbits that meet no stop a second time are those above one phase, and this phase is found
without a grid. In all other cases grazes are looked for on a grid of phases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.contact.reference_motion import real_and_imaginary
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.kernels.periodic_impulses import ADMISSIBLE, NEVER, contact_margin
from grazemap_core.orbits.family import ForcedFamily, OrbitFamily
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, NO_FURTHER_CONTACT, TOUCHES, contact_scratch
from grazemap_core.orbits.kernels.harmonics import within_turn
from grazemap_core.orbits.kernels.newton import newton_scratch
from grazemap_core.orbits.kernels.one_impact_contacts import (
    Contacts,
    MotionScratch,
    OneImpactMotions,
    StopGap,
    contacts_at,
    contacts_begin,
    first_admissible,
    multipliers_at,
)
from grazemap_core.orbits.single_impact.harmonics import Harmonics, Places
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from grazemap_core.orbits.states import stable_beside
from grazemap_core.orbits.tolerances import GRAZE_OFFSET, GRAZE_PHASES, ORBIT_FLOOR, SLOW_SHARE
from grazemap_core.records import NamedTuple


class SpecialOrbit(NamedTuple):
    """A special orbit."""

    row: int
    """Index of the frequency."""
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


PHASES_AT_ONCE = 50_000
"""Maximum number of phases of grids that are in memory at once."""


class AdmissibleFrom(NamedTuple):
    """Where the admissible orbits of one interval of phases begin."""

    phase: float
    """Orbits up to this phase are not admissible, orbits above it are."""
    stop: int
    """The stop that is touched there, +1 or -1; 0 where both gaps are 0 there."""
    any: bool | None
    """Whether there are any; None where round-off hides it."""


class Intervals(NamedTuple):
    """Intervals of phases at several frequencies."""

    starts: Floats
    """(p,) Their starts."""
    ends: Floats
    """(p,) Their ends."""
    rows: Integers
    """(p,) Index of the frequency; it does not decrease."""

    def where(self, chosen: Booleans | Integers) -> Intervals:
        """Return some of the intervals, by flags (p,) or indices."""
        return Intervals(self.starts[chosen], self.ends[chosen], self.rows[chosen])


class StopMotions:
    """Orbits with one impact on a stop in n periods, at several frequencies (m,), the rows.

    Symmetric orbits have its mirror image on the other stop.
    """

    def __init__(self, forced: Sequence[ForcedFamily], stop: int, other: StopGap) -> None:
        """Set up the polynomials of the phase. Raises as `OneImpactOrbits`.

        Parameters
        ----------
        forced : (m,) ForcedFamily
        stop : int
            +1 or -1.
        other : StopGap
            The gap of the other stop.
        """
        self.other = other
        self._restitution = forced[0].family.oscillator.restitution_of(stop)
        self.orbits = OneImpactOrbits(forced, stop, 1.0 + self._restitution)
        self._length = np.array([at.steady_size for at in forced])
        self._scratch = MotionScratch(
            sides=np.zeros(1),
            phases=np.zeros(1),
            speeds=np.zeros(1),
            contact=contact_scratch(1, len(self.family.response.decay)),
        )

    def over(self, omega: Floats) -> StopMotions:
        """Return the orbits at other frequencies (m,)."""
        return StopMotions(self.family.over(omega), self.stop, self.other)

    @property
    def stop(self) -> int:
        """The stop of the impact."""
        return self.orbits.stop

    @property
    def family(self) -> OrbitFamily:
        """The structure and the pattern of impacts."""
        return self.orbits.family

    @property
    def has_one_interval(self) -> bool:
        """Whether the phases of admissible orbits, if there are any, are one interval next to the graze.

        They are under one harmonic where the other stop is absent or alike (theory, "One impact a period").
        """
        return self.family.has_one_harmonic and self.other in (ABSENT, ALIKE)

    def has_at_most_one(self, kind: str) -> bool:
        """Return whether there is at most one special orbit of a type at a frequency."""
        return self.has_one_interval if kind == "GR" else self.family.has_one_harmonic

    @property
    def types(self) -> tuple[str, ...]:
        """The types of special orbits."""
        return ("SN", "SB" if self.family.pattern.symmetric else "PD", "GR")

    @cached_property
    def _motions(self) -> OneImpactMotions:
        """The orbits as the kernels take them, with contacts that are no impacts looked for."""
        forced, orbits, unit = self.orbits.forced, self.orbits, self._length[:, None, None]
        steady = np.array([at.steady[:, -1] for at in forced]) / self._length[:, None]
        return OneImpactMotions(
            problem=forced[0].problem(forced[0].steady_size),
            omega=orbits.omega,
            length=self._length,
            periodic_impulse=np.array([at.sums.after for at in forced]),
            steady=real_and_imaginary(steady),
            speed=real_and_imaginary(orbits.speeds.amplitudes) / unit,
            gap=real_and_imaginary(orbits.gaps.amplitudes),
            pressing=real_and_imaginary(orbits.pressing.amplitudes) / unit,
            stop=float(self.stop),
            struck=ALIKE,
            other=self.other,
            restitution=self._restitution,
        )

    def contacts(self, places: Places) -> Contacts:
        """Return whether the orbits at phases (p,) have a further contact.

        Raises
        ------
        ParameterError
            The motion oscillates too often between two impacts.
        """
        contacts = _empty(len(places.phases))
        contacts_at(self._motions, *places, -ORBIT_FLOOR, contacts, self._scratch)
        _require_searched(contacts)
        return contacts

    def reach(self, places: Places) -> Floats:
        """Return how far the orbits at phases (p,) move toward the other stop: the gap at which they touch it.

        Minus infinity without a maximum.
        """
        contacts = _empty(len(places.phases))
        toward_other = self._motions._replace(struck=ABSENT, other=StopGap(0.0))
        contacts_at(toward_other, *places, -math.inf, contacts, self._scratch)
        return np.asarray(contacts.excess * self._length[places.rows])

    def are_stable_beside(self, kind: str, places: Places) -> Booleans:
        """Return `stable_beside` for special orbits of a type at phases (p,)."""
        count, size = len(places.phases), 2 * len(self.family.response.decay)
        real, imaginary, matrix = np.empty((count, size)), np.empty((count, size)), np.empty((size, size))
        multipliers_at(self._motions, *places, real, imaginary, newton_scratch(1), matrix, self._scratch)
        return stable_beside(kind, real + 1j * imaginary)

    def graze(self, places: Places) -> Booleans:
        """Return whether the orbits at phases (p,) strike the stop so slowly that a curve has come to a graze there."""
        speeds = self.orbits.speeds
        steepest = np.abs(speeds.amplitudes) @ speeds.orders
        return np.asarray(np.abs(speeds.at(*places)) <= SLOW_SHARE * steepest[places.rows])

    def orbits_at(self, places: Places) -> list[SpecialOrbit]:
        """Return the orbits at phases (p,). Raises as `contacts`."""
        return self._orbits(places, self._are_admissible(places), [0] * len(places.phases))

    @cached_property
    def _admissible_end_at_graze(self) -> Booleans:
        """Whether the admissible orbits are those above one phase, up to the graze of the steady motion, (m,).

        Where impacts feed in no energy, the speed has the sign of the velocity of the steady motion. The graze is then
        at the end of the interval of phases.
        """
        return self.has_one_interval & (self.orbits.straight > 0.0)

    def _are_admissible(self, places: Places) -> list[bool | None]:
        """Return whether orbits are admissible."""
        admissible: list[bool | None] = []
        undecided: list[int] = []
        starts, ends, _ = self.phases_of_impacts
        for i, (phase, row) in enumerate(zip(places.phases.tolist(), places.rows.tolist(), strict=True)):
            begin = self.admissible_from[row]
            if begin is None or begin.any is None:
                undecided.append(i)
                admissible.append(None)
            else:
                middle = 0.5 * float(starts[row] + ends[row])
                is_above = math.remainder(phase - middle, 2.0 * math.pi) > begin.phase - middle
                admissible.append(begin.any and is_above)
        if undecided:
            status = self.contacts(places.where(np.array(undecided))).status
            for i, verdict in zip(undecided, status.tolist(), strict=True):
                admissible[i] = _verdict(verdict)
        return admissible

    def special(self, kind: str) -> list[SpecialOrbit]:
        """Return the special orbits of a type at all frequencies."""
        if kind != "GR":
            return self.orbits_at(self.orbits.saddle_nodes() if kind == "SN" else self.orbits.period_doublings())
        grazes = [
            (row, begin)
            for row, begin in enumerate(self.admissible_from)
            if begin is not None and begin.any is not False and begin.stop != 0
        ]
        places = Places.of(np.array([graze.phase for _, graze in grazes]), np.array([row for row, _ in grazes]))
        orbits = self._orbits(places, [graze.any for _, graze in grazes], [graze.stop for _, graze in grazes])
        return sorted(orbits + self._grazes(), key=lambda orbit: orbit.row)

    @cached_property
    def admissible_from(self) -> list[AdmissibleFrom | None]:
        """Where the admissible orbits begin, (m,); None where they are not those above one phase.

        The orbits of vanishing speed decide whether there are any. Where round-off hides their contacts, one admissible
        orbit between the phase and the graze shows that there are.
        """
        answers: list[AdmissibleFrom | None] = [None] * len(self._admissible_end_at_graze)
        rows = np.flatnonzero(self._admissible_end_at_graze)
        if not rows.size:
            return answers
        is_alone, sums = self.other == ABSENT, [self.orbits.forced[row].sums for row in rows.tolist()]
        slow = np.array([contact_margin(at.impulses, at.displacement, is_alone)[1] for at in sums])
        starts, ends, _ = self.phases_of_impacts
        assert len(starts) == len(answers)  # under one harmonic there is one interval at a frequency
        begins, stops = starts, np.zeros(len(starts), dtype=np.int64)
        if not is_alone:  # both gaps are 0 at a phase; below it the stops have changed sides
            begins = _zeros_after(starts, self.orbits.gaps)
        if self._restitution == 0.0:  # up to a phase the contact is pressed to the stop and stays on it
            released = _zeros_after(starts, self.orbits.pressing)
            begins, stops = np.maximum(begins, released), np.where(released > begins, self.stop, stops)
        for row in rows[slow == NEVER].tolist():
            answers[row] = AdmissibleFrom(float(ends[row]), 0, False)
        rows, slow = rows[slow != NEVER], slow[slow != NEVER]
        phases, contacts = begins[rows], _empty(len(rows))
        first_admissible(self._motions, phases, rows, ends[rows], contacts, self._scratch)
        _require_searched(contacts)
        clear = (phases < ends[rows]) & (contacts.status == NO_FURTHER_CONTACT)
        is_admissible, unsure = clear & (slow == ADMISSIBLE), clear & (slow != ADMISSIBLE)
        middles = Places(0.5 * (phases + ends[rows]), rows).where(unsure)
        is_admissible[unsure] = self.contacts(middles).status == NO_FURTHER_CONTACT
        touched = np.where(contacts.stop != 0, contacts.stop, stops[rows])
        columns = (column.tolist() for column in (rows, phases, touched, is_admissible))
        for row, phase, stop, some in zip(*columns, strict=True):
            answers[row] = AdmissibleFrom(phase, stop, some or None)
        return answers

    def _grazes(self) -> list[SpecialOrbit]:
        """Return the orbits at which a further contact begins, next to admissible ones, where a grid is needed."""
        shares = np.linspace(0.0, 1.0, GRAZE_PHASES * len(self.family.orders) + 1)
        shares[0], shares[-1] = GRAZE_OFFSET, 1.0 - GRAZE_OFFSET
        gridded = np.flatnonzero(~self._admissible_end_at_graze[self.phases_of_impacts.rows])
        at_once = max(1, PHASES_AT_ONCE // len(shares))
        parts = (gridded[first : first + at_once] for first in range(0, len(gridded), at_once))
        return [graze for part in parts for graze in self._grazes_in(self.phases_of_impacts.where(part), shares)]

    def _grazes_in(self, intervals: Intervals, shares: Floats) -> list[SpecialOrbit]:
        """Return the orbits of `_grazes` in some intervals, with a grid at these shares of each."""
        starts, ends, rows = intervals
        phases = starts[:, None] + (ends - starts)[:, None] * shares
        status = self.contacts(Places(phases.ravel(), np.repeat(rows, len(shares)))).status
        fine = status.reshape(phases.shape) == NO_FURTHER_CONTACT
        interval, before = np.nonzero(fine[:, 1:] != fine[:, :-1])
        is_fine, low, high = fine[interval, before], phases[interval, before], phases[interval, before + 1]
        clear, met = np.where(is_fine, low, high), np.where(is_fine, high, low)
        places, contacts = Places(clear, rows[interval]), _empty(len(clear))
        contacts_begin(self._motions, *places, met, contacts, self._scratch)
        return self._orbits(places, [True] * len(clear), contacts.stop.tolist())

    @cached_property
    def phases_of_impacts(self) -> Intervals:
        """The intervals of phases in which the impact is not virtual."""
        starts, rows = self.orbits.speeds.zeros()
        is_last = np.ones(len(rows), dtype=np.bool_)
        is_last[:-1] = rows[1:] != rows[:-1]
        ends = np.roll(starts, -1)
        ends[is_last] = starts[np.searchsorted(rows, rows[is_last])] + 2.0 * math.pi
        struck = self.orbits.speeds.at(0.5 * (starts + ends), rows) > 0.0
        return Intervals(starts, ends, rows).where(struck)

    def _orbits(self, places: Places, admissible: Sequence[bool | None], stops: Sequence[int]) -> list[SpecialOrbit]:
        """Return orbits with the verdict on each, and the stop of its further contact."""
        speeds = [max(speed, 0.0) for speed in self.orbits.speed(*places).tolist()]  # below it by round-off alone
        numbers = places.rows.tolist(), places.phases.tolist(), speeds, self.orbits.gap(*places).tolist()
        return [SpecialOrbit(*orbit) for orbit in zip(*numbers, admissible, stops, strict=True)]


def _verdict(status: int) -> bool | None:
    """Return whether an orbit is admissible, from the status of its contacts."""
    return None if status == TOUCHES else status == NO_FURTHER_CONTACT


def _zeros_after(starts: Floats, polynomials: Harmonics) -> Floats:
    """Return the first zero from a phase on of each polynomial of one harmonic; both (m,)."""
    zeros, rows = polynomials.zeros()
    ahead = [within_turn(angle) for angle in (zeros - starts[rows]).tolist()]
    nearest = np.full(len(starts), math.inf)
    np.minimum.at(nearest, rows, ahead)
    return np.asarray(starts + nearest)


def _require_searched(contacts: Contacts) -> None:
    if np.any(contacts.status == GIVEN_UP):
        raise ParameterError("omega", "the motion oscillates too often between two impacts to be searched")


def _empty(count: int) -> Contacts:
    return Contacts(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count, dtype=np.int64))
