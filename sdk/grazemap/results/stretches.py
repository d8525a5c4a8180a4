"""Stretches of a branch: the parts with stable, unstable or inadmissible orbits, and the points at which they end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap.described import described
from grazemap.wire import Oscillator

if TYPE_CHECKING:
    from grazemap.results.orbits import OrbitBranch, SpecialPoint

_STABLE, _UNSTABLE, _INADMISSIBLE = "stable", "unstable", "not admissible"
_LESS_REGULAR = (_STABLE, _UNSTABLE, _INADMISSIBLE)

Floats = NDArray[np.float64]


@described
@dataclass(frozen=True)
class Stretch:
    """Part of a branch whose orbits are of one kind, and within which the parameter does not turn.

    If the parameter turns at an SB, the branch goes back as its own mirror image; if at a PD, as the same motions some
    forcing periods later. Then the stretches repeat in reverse.
    """

    kind: str
    """"stable", "unstable" or "not admissible"."""
    begins: float
    """Value of the parameter that varies where it begins, in the order of the branch."""
    ends: float
    """Value where it ends."""
    at_begin: str
    """Type of the special point where it begins, "" if none was found; at an end of the branch, why it ends there."""
    at_end: str
    """The same where it ends."""


@described
@dataclass(frozen=True)
class Knots:
    """The orbits of a branch and its special points, in order."""

    path: Floats
    """(n, 1 + 2 k) Parameter, speeds and phases of the impacts."""
    types: list[str]
    """(n,) Type of a special point, "" for an orbit."""
    kinds: list[str]
    """(n - 1,) "stable", "unstable" or "not admissible": the orbits between a knot and the next."""

    def turns(self) -> list[int]:
        """Return the special points at which the parameter turns, as indices of knots."""
        rises = np.diff(self.path[:, 0])
        return [i for i in range(1, len(rises)) if self.types[i] and rises[i - 1] * rises[i] < 0.0]


def knots_of(branch: OrbitBranch) -> Knots:
    """Return the knots of a branch.

    Between two orbits the kind changes at special points. If there is no special point between orbits of different
    kinds, the less regular kind is taken. A closed branch ends with its first orbit.
    """
    speeds = branch.velocities * branch.stops
    kinds = np.where(branch.admissible, np.where(branch.stable, _STABLE, _UNSTABLE), _INADMISSIBLE)
    points_by_segment: dict[int, list[SpecialPoint]] = {}
    for point in branch.special_points:
        points_by_segment.setdefault(point.segment, []).append(point)
    path: list[Floats] = []
    types: list[str] = []
    between: list[str] = []
    for i in range(len(speeds)):
        path.append(np.concatenate([branch.parameter[i : i + 1], speeds[i], branch.phases[i]]))
        types.append("")
        if i + 1 < len(speeds):
            points = points_by_segment.get(i, [])
            path += [_knot(branch, point, branch.phases[i]) for point in points]
            types += [point.type for point in points]
            between += kinds_between(str(kinds[i]), str(kinds[i + 1]), points)
    whole = np.array(path)
    if branch.closed:
        again = first_again(whole, branch.phases.shape[1], _oscillator(branch))
        whole = np.concatenate([whole, again])
        types += [""] * len(again)
        between += kinds_between(str(kinds[-1]), str(kinds[0]), []) * len(again)
    return Knots(whole, types, between)


def first_again(path: Floats, impacts: int, oscillator: Oscillator) -> Floats:
    """Return the point with which a closed curve ends: its first one, or none where the last one lies beyond that.

    Parameters
    ----------
    path : (n, d)
        The points, with the phases of the impacts in the last columns. Those of the last point may differ by whole
        periods from those of the first.
    impacts : int
        The number of phases.
    oscillator : Oscillator
        The oscillator with these orbits.

    Returns
    -------
    (1, d) or (0, d)
    """
    first, turn = path[:1].copy(), oscillator.forcing_period(1.0)
    first[:, -impacts:] -= np.round((first - path[-1:])[:, -impacts:] / turn) * turn
    extent = np.ptp(path, axis=0)
    last, ahead = np.diff(np.concatenate([path[-2:], first]), axis=0) / np.where(extent > 0.0, extent, 1.0)
    return first if last @ ahead > 0.0 else first[:0]


def stretches_of(branch: OrbitBranch) -> list[Stretch]:
    """Return the stretches of a branch, in its order: they end where the kind changes or the parameter turns."""
    if len(branch.parameter) < 2:
        return []
    knots = knots_of(branch)
    changes = (i for i in range(1, len(knots.kinds)) if knots.kinds[i] != knots.kinds[i - 1])
    borders = sorted({*changes, *knots.turns()})
    first, last = [0, *borders], [*borders, len(knots.kinds)]
    types = [branch.ends[0], *knots.types[1:-1], branch.ends[-1]]
    parameter = knots.path[:, 0].tolist()
    return [
        Stretch(knots.kinds[i], parameter[i], parameter[j], types[i], types[j])
        for i, j in zip(first, last, strict=True)
    ]


def kinds_between(start: str, end: str, points: Sequence[SpecialPoint]) -> list[str]:
    """Return the kinds of the pieces of a segment: of the orbits before, between and after its special points."""
    if not points:
        return [max(start, end, key=_LESS_REGULAR.index)]
    kinds = [start]
    for point in points[:-1]:
        if point.type == "GR" or kinds[-1] == _INADMISSIBLE:  # the stability of inadmissible orbits is not looked at
            kinds.append(end if kinds[-1] == _INADMISSIBLE else _INADMISSIBLE)
        else:
            kinds.append(_UNSTABLE if kinds[-1] == _STABLE else _STABLE)
    return [*kinds, end]


def _knot(branch: OrbitBranch, point: SpecialPoint, near: Floats) -> Floats:
    """Return parameter, speeds and phases of a special point; the phases are moved by whole periods close to `near`."""
    phases, whole = point.phases[: len(near)], _oscillator(branch).forcing_period(1.0) * branch.period
    turned = phases - np.round((phases - near) / whole) * whole
    return np.concatenate([[point.parameter], point.velocities[: len(near)] * branch.stops, turned])


def _oscillator(branch: OrbitBranch) -> Oscillator:
    return Oscillator.model_validate(branch.meta["request"]["oscillator"])
