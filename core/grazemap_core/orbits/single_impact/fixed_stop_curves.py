"""Curves of motions that strike a fixed stop, in the plane of the frequency and the clearance of the other stop.

Where a motion strikes the fixed stop alone, the other one does not change it: its bifurcations, and the graze of the
fixed stop, are lines of constant frequency. They are those of a motion as long as the other stop is beyond its reach.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.grazing_curve import VariedStop, steady_motion, stop_grazes
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.single_impact.curves import OneImpactCurve, explicit_curves, joined, turning_frame
from grazemap_core.orbits.single_impact.harmonics import Places, bracketed_zero
from grazemap_core.orbits.single_impact.special_orbits import SpecialOrbit, StopMotions
from grazemap_core.orbits.tolerances import FREQUENCY_ACCURACY
from grazemap_core.records import dataclass


@dataclass(frozen=True)
class FrequencyLine:
    """A line of constant frequency."""

    type: str
    """One of "SN", "PD" or "GR"."""
    omega: float
    """The frequency."""
    speed: float
    """Speed of the impact on the fixed stop; 0 for its graze by the steady motion."""
    admissible: bool
    """There is certainly no further contact with the fixed stop."""
    stop: int
    """GR only, else 0: the fixed stop."""
    reach: float
    """Clearance of the other stop above which it is not touched."""
    stable_beside: bool
    """Whether the motion is stable on one side."""

    def moved(self, offset: float) -> FrequencyLine:
        """Return the line with `reach` changed from a gap to a clearance."""
        return replace(self, reach=self.reach + offset)


def lines(motions: StopMotions, gap: float) -> Iterator[FrequencyLine]:
    """Yield the lines of motions with one impact on a stop that is fixed at a gap; `reach` is a gap.

    `motions`, at increasing frequencies (m,), are those without the other stop. Two lines of one curve between two of
    the frequencies are missed.
    """
    omega = motions.orbits.omega.tolist()
    for kind in motions.types:
        for curve in explicit_curves(motions, kind):
            apart = curve.clearance - gap
            for i in np.flatnonzero(apart[1:] * apart[:-1] <= 0.0).tolist():
                ends = [(omega[k], float(curve.clearance[k])) for k in (i, i + 1)]
                solution = _between(motions, kind, gap, *ends)
                if solution is not None:
                    here, orbit = solution
                    at = Places.of(orbit.phase)
                    reach, stable = float(here.reach(at)[0]), bool(here.are_stable_beside(kind, at)[0])
                    place = float(here.orbits.omega[0])
                    yield FrequencyLine(kind, place, orbit.speed, bool(orbit.admissible), orbit.stop, reach, stable)


def _between(
    motions: StopMotions, kind: str, gap: float, start: tuple[float, float], end: tuple[float, float]
) -> tuple[StopMotions, SpecialOrbit] | None:
    """Return the special orbit of a curve that has a gap between two frequencies, after all orbits at its frequency.

    `start` and `end` are the two frequencies, and the gaps of the curve there. None where the curve ends between them.
    """
    (low, first), (high, last) = start, end

    def special(frequency: float) -> tuple[StopMotions, SpecialOrbit]:
        here, expected = motions.over(np.array([frequency])), first + (frequency - low) / (high - low) * (last - first)
        orbit = min(here.special(kind), key=lambda orbit: abs(orbit.gap - expected), default=None)
        if orbit is None:
            raise _CurveEnds
        return here, orbit

    try:
        place = bracketed_zero(lambda frequency: special(frequency)[1].gap - gap, low, high, FREQUENCY_ACCURACY)
        return None if place is None else special(place)
    except _CurveEnds:
        return None


class _CurveEnds(Exception):
    """There is no special orbit any more that could be followed."""


def contacts_with_varied(motions: StopMotions, gap: float) -> list[OneImpactCurve]:
    """Return the curves on which motions that strike a stop fixed at a gap touch the other one; with its gaps.

    `motions` are as for `lines`.
    """
    places = motions.orbits.phases(gap)
    each = zip(motions.orbits_at(places), motions.reach(places).tolist(), strict=True)
    orbits = [orbit._replace(gap=far, stop=-motions.stop) for orbit, far in each if np.isfinite(far)]
    return joined(orbits, turning_frame(motions))


def varied_graze(oscillator: Oscillator, omega: Floats, varied: VariedStop) -> OneImpactCurve | None:
    """Return the grazing curve of a stop, by its clearance; None where the equilibrium is beyond the fixed stop."""
    try:
        grazes = stop_grazes(oscillator, omega, varied, 1)
    except ParameterError as error:
        if error.name != "clearance":
            raise
        return None
    return OneImpactCurve.of_grazes(grazes.clearance, ~grazes.virtual, varied.stop)


def graze_lines(oscillator: Oscillator, omega: Floats, varied: VariedStop) -> Iterator[FrequencyLine]:
    """Yield the lines on which the steady motion touches the fixed stop; `reach` is a clearance."""
    assert varied.other is not None
    other, gap = VariedStop(-varied.stop), varied.other

    def apart(frequencies: Floats) -> Floats:
        return stop_grazes(oscillator, frequencies, other, 1).clearance - gap

    values = apart(omega)
    for i, (before, after) in enumerate(pairwise(values.tolist())):
        if before * after > 0.0:
            continue
        place = bracketed_zero(
            lambda frequency: float(apart(np.array([frequency]))[0]),
            float(omega[i]),
            float(omega[i + 1]),
            FREQUENCY_ACCURACY,
        )
        assert place is not None  # the signs at the ends differ
        reach = steady_motion(oscillator, np.array([place])).toward(varied.stop).amplitude[0]
        reach += varied.stop * contact_equilibrium(oscillator)
        yield FrequencyLine("GR", place, 0.0, True, -varied.stop, float(reach), stable_beside=True)
