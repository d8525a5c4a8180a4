"""Curves of special motions with one impact on a stop in n periods, between any stops and under any harmonics.

At one frequency the impact's phase determines its speed and the gap of its stop (`explicit_orbits`). Saddle-nodes and
period doublings are zeros of trigonometric polynomials of the phase, of which none is missed. Where the motion begins
to meet a stop a second time is looked for on a grid of phases. Special points at successive frequencies are joined to
curves by their phases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.orbits.explicit_orbits import OneImpactOrbits
from grazemap_core.orbits.family import OrbitFamily, steady_size
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT, contact_scratch
from grazemap_core.orbits.kernels.one_impact_contacts import (
    Contacts,
    MotionScratch,
    OneImpactMotions,
    contacts_at,
    contacts_begin,
)
from grazemap_core.orbits.tolerances import GRAZE_OFFSET, GRAZE_PHASES, ORBIT_FLOOR, SAME_CURVE_PHASE
from grazemap_core.records import NamedTuple, dataclass


@dataclass(frozen=True, eq=False)
class OneImpactCurve:
    """One type of special point over all frequencies; NaN, and False, where there is none."""

    clearance: Floats
    """(n,) Gap of the stop that is struck; between symmetric stops its clearance. Of curves over a parameter its
    values."""
    impact_velocity: Floats
    """(n,) Velocity before the impact."""
    admissible: Booleans
    """(n,) The orbit has no contact with a stop other than its impacts."""
    stop: Integers
    """(n,) GR only, else 0: +1 where the further contact is with the stop that is struck (first), -1 with the other
    one."""

    def moved(self, offset: float) -> OneImpactCurve:
        """Return the curve with clearances that are larger by an offset."""
        return replace(self, clearance=self.clearance + offset)


class SpecialOrbit(NamedTuple):
    """A special orbit at one frequency."""

    phase: float
    """Phase of the impact; in closed form the angle on the branch."""
    speed: float
    """Speed of the impact."""
    gap: float
    """Gap of the stop of the impact."""
    admissible: bool
    """Whether the orbit has no contact with a stop other than its impacts."""
    stop: int
    """Stop of the further contact of a GR, +1 or -1; else 0."""


class SecondStop(NamedTuple):
    """The gap ``fixed + by_gap gap`` of the stop without an impact; infinite if it is absent."""

    fixed: float
    """The gap where `by_gap` is 0; infinite for an absent stop."""
    by_gap: float = 0.0
    """Change of the gap by that of the other stop."""


ABSENT = SecondStop(math.inf)


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
            speed=_parts(self.orbits.speeds.amplitudes / self.problem.length),
            gap=_parts(self.orbits.gaps.amplitudes),
            stop=float(self.of.stop),
            own=own.fixed,
            own_by_gap=own.by_gap,
            other=other.fixed,
            other_by_gap=other.by_gap,
            restitution=self._restitution,
        )

    def contacts(self, phases: Floats) -> Contacts:
        """Return whether the orbits at phases (m,) have a further contact."""
        contacts = _empty(len(phases))
        motions = self._motions(SecondStop(0.0, 1.0), self.of.other)
        contacts_at(self.problem, motions, phases, -ORBIT_FLOOR, contacts, self._scratch)
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
        """Return the orbits at phases."""
        places = np.array(phases, dtype=np.float64)
        clear = self.contacts(places).status == NO_FURTHER_CONTACT
        return [self._orbit(phase, bool(fine), 0) for phase, fine in zip(phases, clear, strict=True)]

    def special(self, kind: str) -> list[SpecialOrbit]:
        """Return the special orbits of a type."""
        if kind == "GR":
            return self._grazes()
        return self.orbits_at(self.orbits.saddle_nodes() if kind == "SN" else self.orbits.period_doublings())

    def _grazes(self) -> list[SpecialOrbit]:
        """Return the orbits at which a further contact begins, next to admissible ones."""
        clear: list[float] = []
        met: list[float] = []
        for start, end in self._phases_of_impacts():
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
        motions = self._motions(SecondStop(0.0, 1.0), self.of.other)
        contacts_begin(self.problem, motions, places, np.array(met), -ORBIT_FLOOR, contacts, self._scratch)
        return [
            self._orbit(phase, True, stop) for phase, stop in zip(places.tolist(), contacts.stop.tolist(), strict=True)
        ]

    def _phases_of_impacts(self) -> list[tuple[float, float]]:
        """Return the intervals of phases in which the impact is not virtual."""
        zeros = self.orbits.speeds.zeros()
        ends = [*zeros, zeros[0] + 2.0 * math.pi] if zeros else []
        return [(a, b) for a, b in pairwise(ends) if self.orbits.speeds.at(0.5 * (a + b)) > 0.0]

    def _orbit(self, phase: float, admissible: bool, stop: int) -> SpecialOrbit:
        return SpecialOrbit(phase, self.orbits.speed(phase), self.orbits.gap(phase), admissible, stop)


def explicit_curves(of: StopFamily, omega: Floats, steady: Complexes) -> dict[str, list[OneImpactCurve]]:
    """Return the curves of each type of a family, with their gaps, at frequencies (m,).

    Parameters
    ----------
    of : StopFamily
    omega : (m,)
        Increasing.
    steady : (m, H, N + 1)
        From `OrbitFamily.steady_at`.
    """
    orbits: dict[str, list[list[SpecialOrbit]]] = {kind: [] for kind in of.types}
    for frequency, amplitudes in zip(omega.tolist(), steady, strict=True):
        here = of.at(frequency, amplitudes)
        for kind in of.types:
            orbits[kind].append(here.special(kind))
    turned = turning_frame(of.family, steady)
    return {kind: joined(points, turned) for kind, points in orbits.items()}


def nearest_special(here: StopMotions, kind: str, gap: float) -> SpecialOrbit:
    """Return the special orbit of a type whose gap is nearest to a given one. Raises ValueError where there is none."""
    return min(here.special(kind), key=lambda orbit: abs(orbit.gap - gap))


def turning_frame(family: OrbitFamily, steady: Complexes) -> Floats:
    """Return the angles (m,) by which the steady motion's lowest harmonic is ahead: phases of impacts follow it."""
    lowest = np.angle(steady[:, 0, -1])
    return np.asarray(np.unwrap(lowest) / family.oscillator.forces[0].order)


def joined(points: list[list[SpecialOrbit]], frame: Floats) -> list[OneImpactCurve]:
    """Join special orbits at successive frequencies to curves, by their phases in a frame (m,) that turns with them."""
    curves: list[dict[int, SpecialOrbit]] = []
    ends: list[int] = []
    for i, here in enumerate(points):
        apart = sorted(
            (_angle(orbit.phase + frame[i] - curves[k][i - 1].phase - frame[i - 1]), k, j)
            for k in ends
            for j, orbit in enumerate(here)
            if orbit.stop == curves[k][i - 1].stop
        )
        taken: dict[int, int] = {}
        for angle, k, j in apart:
            if angle <= SAME_CURVE_PHASE and j not in taken and k not in taken.values():
                taken[j] = k
        for j, orbit in enumerate(here):
            if j not in taken:
                taken[j] = len(curves)
                curves.append({})
            curves[taken[j]][i] = orbit
        ends = sorted(taken.values())
    return [_curve(curve, len(points)) for curve in curves]


def _curve(points: dict[int, SpecialOrbit], size: int) -> OneImpactCurve:
    places = list(points)

    def filled(values: list[float]) -> Floats:
        whole = np.full(size, np.nan)
        whole[places] = values
        return whole

    admissible: Booleans = np.zeros(size, dtype=np.bool_)
    admissible[places] = [orbit.admissible for orbit in points.values()]
    stop = np.zeros(size, dtype=np.int64)
    stop[places] = [orbit.stop for orbit in points.values()]
    gaps, speeds = ([getattr(orbit, name) for orbit in points.values()] for name in ("gap", "speed"))
    return OneImpactCurve(filled(gaps), filled(speeds), admissible, stop)


def _angle(difference: float) -> float:
    return abs(math.remainder(difference, 2.0 * math.pi))


def _parts(amplitudes: Complexes) -> Floats:
    return np.stack([amplitudes.real, amplitudes.imag], axis=1)


def _empty(count: int) -> Contacts:
    return Contacts(np.zeros(count, dtype=np.int64), np.zeros(count), np.zeros(count, dtype=np.int64))
