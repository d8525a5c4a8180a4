"""Curves over the frequency of special orbits with one impact on a stop in n periods.

Special orbits at successive frequencies are joined to curves by the phases of their impacts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.orbits.single_impact.special_orbits import SpecialOrbit, StopMotions
from grazemap_core.orbits.tolerances import SAME_CURVE_PHASE
from grazemap_core.records import dataclass


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
    undecided: Booleans
    """(n,) Round-off hides whether it has one; `admissible` is False then."""
    stop: Integers
    """(n,) GR only, else 0: the stop of the further contact, +1 right or -1 left."""
    phase: Floats
    """(n,) Phase of the impact; NaN, too, where the steady motion touches a stop."""

    @classmethod
    def of_grazes(cls, clearance: Floats, admissible: Booleans, stop: int) -> OneImpactCurve:
        """Return the curve on which the steady motion touches a stop."""
        size = len(clearance)
        undecided, phase = np.zeros(size, dtype=np.bool_), np.full(size, np.nan)
        return cls(clearance, np.zeros(size), admissible, undecided, np.full(size, stop), phase)

    def moved(self, offset: float) -> OneImpactCurve:
        """Return the curve with clearances that are larger by an offset."""
        return replace(self, clearance=self.clearance + offset)


def explicit_curves(motions: StopMotions, kind: str) -> list[OneImpactCurve]:
    """Return the curves of special orbits of a type, with their gaps, from orbits at increasing frequencies (m,)."""
    join = _joined_single if motions.has_at_most_one(kind) else joined
    return join(motions.special(kind), turning_frame(motions))


def _joined_single(points: list[SpecialOrbit], frame: Floats) -> list[OneImpactCurve]:
    """Join special orbits as `joined`, where there is at most one at every frequency.

    An orbit continues that of the frequency before, with one exception. Where an orbit becomes virtual, the one half a
    turn later, at a gap of the opposite sign, stops being virtual, and begins another curve. Where the gap of one curve
    passes through 0, the phase changes by less than SAME_CURVE_PHASE.
    """
    curves: list[dict[int, SpecialOrbit]] = []
    for orbit in points:
        i = orbit.row
        last = curves[-1].get(i - 1) if curves else None
        if last is None or (
            last.gap * orbit.gap <= 0.0
            and angle_between(orbit.phase + frame[i], last.phase + frame[i - 1]) > SAME_CURVE_PHASE
        ):
            curves.append({})
        curves[-1][i] = orbit
    return [_curve(curve, len(frame)) for curve in curves]


def turning_frame(motions: StopMotions) -> Floats:
    """Return the angles (m,) by which the steady motion's lowest harmonic is ahead: phases of impacts follow it."""
    lowest = np.angle([at.steady[0, -1] for at in motions.orbits.forced])
    return np.asarray(np.unwrap(lowest) / motions.family.orders[0])


def joined(points: Sequence[SpecialOrbit], frame: Floats) -> list[OneImpactCurve]:
    """Join special orbits at successive frequencies to curves, by their phases in a frame (m,) that turns with them."""
    curves: list[dict[int, SpecialOrbit]] = []
    ends: list[int] = []
    by_row: list[list[SpecialOrbit]] = [[] for _ in frame]
    for orbit in points:
        by_row[orbit.row].append(orbit)
    for i, here in enumerate(by_row):
        apart = sorted(
            (angle_between(orbit.phase + frame[i], curves[k][i - 1].phase + frame[i - 1]), k, j)
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
    return [_curve(curve, len(frame)) for curve in curves]


def _curve(points: dict[int, SpecialOrbit], size: int) -> OneImpactCurve:
    places = list(points)

    def filled(name: str) -> Floats:
        whole = np.full(size, np.nan)
        whole[places] = [getattr(orbit, name) for orbit in points.values()]
        return whole

    admissible, undecided = np.zeros(size, dtype=np.bool_), np.zeros(size, dtype=np.bool_)
    admissible[places] = [orbit.admissible is True for orbit in points.values()]
    undecided[places] = [orbit.admissible is None for orbit in points.values()]
    stop = np.zeros(size, dtype=np.int64)
    stop[places] = [orbit.stop for orbit in points.values()]
    return OneImpactCurve(filled("gap"), filled("speed"), admissible, undecided, stop, filled("phase"))


def angle_between(first: float, second: float) -> float:
    """Return the angle between two phases."""
    return abs(math.remainder(first - second, 2.0 * math.pi))
