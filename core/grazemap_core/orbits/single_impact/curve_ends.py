"""Pieces of curves in a window, each followed from its samples to its ends between two of the frequencies."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.orbits.single_impact.curves import OneImpactCurve, angle_between
from grazemap_core.orbits.single_impact.harmonics import Places
from grazemap_core.records import NamedTuple, dataclass

SECTIONS = 32
"""Sections into which a round divides the interval in which a piece ends."""
ROUNDS = 6
"""Rounds: the frequency of an end is known to 2^-30 of the step between two samples."""


@dataclass(frozen=True)
class Interval:
    """The values of the parameter that varies, of a window."""

    low: float
    """Its start."""
    high: float
    """Its end."""

    def contains(self, values: Floats | float) -> Booleans:
        """Return whether values lie in it; NaN does not."""
        with np.errstate(invalid="ignore"):
            return np.asarray((self.low <= values) & (values <= self.high))


class CurvesAt(NamedTuple):
    """The curves of one type at increasing frequencies."""

    omega: Floats
    """(m,) The frequencies."""
    curves: list[OneImpactCurve]
    """The curves over the parameter that varies."""
    are_stable_beside: Callable[[Places], Booleans]
    """Returns whether motions at phases (p,) are stable on one side of a curve."""
    graze: Callable[[Places], Booleans]
    """Returns whether motions at phases (p,) strike the stop as slowly as a curve does where it leaves a graze."""


class CurvePoints(NamedTuple):
    """Points of a curve; the fields are those of `CurvePiece`."""

    omega: Floats
    """(p,) Frequencies."""
    value: Floats
    """(p,) Values of the parameter."""
    impact_velocity: Floats
    """(p,) Speeds before an impact."""
    stable_beside: Booleans
    """(p,) Whether the motion is stable on one side."""

    @classmethod
    def of(cls, at: CurvesAt, curve: OneImpactCurve, rows: Integers) -> CurvePoints:
        """Return the points of a curve at some of the frequencies."""
        stable = at.are_stable_beside(Places(curve.phase[rows], rows))
        return cls(at.omega[rows], curve.clearance[rows], curve.impact_velocity[rows], stable)

    @classmethod
    def joined(cls, parts: Sequence[CurvePoints]) -> CurvePoints:
        """Return the points of several parts, in their order."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


class End(NamedTuple):
    """The end of a piece: its last frequency, whose neighbour has no point of the piece."""

    at: CurvesAt
    """The curves at these two frequencies, and at others."""
    curve: OneImpactCurve
    """The curve of the piece."""
    row: int
    """Index of the last frequency of the piece."""
    step: int
    """Direction in which it ends: -1 or 1."""
    sample: float
    """Frequency of its last sample."""

    @property
    def beyond(self) -> int | None:
        """Index of the neighbour; None where there is none."""
        beyond = self.row + self.step
        return beyond if 0 <= beyond < len(self.at.omega) else None

    def between(self) -> Floats:
        """Return frequencies from the last one of the piece to its neighbour."""
        return np.linspace(self.at.omega[self.row], self.at.omega[self.row + self.step], SECTIONS + 1)

    def narrowed(self, at: CurvesAt, values: Interval) -> End:
        """Return the end among the curves at more frequencies, those of `between` with them.

        It stays where its own frequency, computed beside others, has no such orbit any more, by round-off.
        """
        phase = self.curve.phase[self.row]
        row, last = np.searchsorted(at.omega, self.at.omega[[self.row, self.row + self.step]]).tolist()
        # of the steady motion, which has no phase of an impact, there is one curve
        near = [0.0 if np.isnan(phase) else angle_between(curve.phase[row], phase) for curve in at.curves]
        if np.all(np.isnan(near)):
            return self
        curve = at.curves[int(np.nanargmin(near))]
        while row + self.step != last and self._continues(curve, row + self.step, values):
            row += self.step
        return self._replace(at=at, curve=curve, row=row)

    def _continues(self, curve: OneImpactCurve, row: int, values: Interval) -> bool:
        alike = (curve.admissible[row], curve.stop[row]) == (self.curve.admissible[self.row], self.curve.stop[self.row])
        return bool(alike and not curve.undecided[row] and values.contains(curve.clearance[row]))

    def points(self) -> CurvePoints:
        """Return the point at the end, if it is beyond the last sample."""
        rows = np.array([] if self.at.omega[self.row] == self.sample else [self.row], dtype=np.int64)
        return CurvePoints.of(self.at, self.curve, rows)

    def reason(self, values: Interval) -> str:
        """Return why the piece ends, as in `CurvePiece.ends`."""
        if self.beyond is None:
            return "window"
        if not self.curve.undecided[self.beyond] and np.isfinite(self.curve.clearance[self.beyond]):
            return "admissible" if values.contains(self.curve.clearance[self.beyond]) else "window"
        if self.at.graze(Places.of(self.curve.phase[self.row], self.row))[0]:
            return "grazing"
        return "undecided" if self.curve.undecided[self.beyond] else "none"


def narrowed(ends: list[End], again: Callable[[Floats], CurvesAt], values: Interval) -> list[End]:
    """Return ends narrowed between finer and finer frequencies.

    Parameters
    ----------
    ends : list of End
        The ends among the samples.
    again : callable
        Returns the curves at other frequencies (m,), increasing.
    values : Interval
        The values of the parameter, of the window.
    """
    ends = list(ends)
    inside = [i for i, end in enumerate(ends) if end.beyond is not None]
    for _ in range(ROUNDS if inside else 0):
        at = again(np.unique(np.concatenate([ends[i].between() for i in inside])))
        for i in inside:
            ends[i] = ends[i].narrowed(at, values)
    return ends
