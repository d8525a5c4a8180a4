"""The grid of a map, and the name of the motion at every point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import INFINITE, RESOLVED
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.planes import Plane
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.motion import KINDS

GridPoint = tuple[int, int]
"""Row and column of a point of a map."""

NO_NAME: Final = -1
"""Index of the name where the motion is not periodic."""


class MotionName(NamedTuple):
    """The name of a periodic motion in a map."""

    period: int
    """Forcing periods, as `period` of a map."""
    right: int
    """Impacts on the right stop, as `impacts_right` of a map. Between symmetric stops a motion and its mirror image
    have one name, with more impacts on the right."""
    left: int
    """Impacts on the left stop, likewise."""
    symmetric: bool
    """The motion is its own mirror image; false where the stops are not symmetric."""
    sticking: bool
    """Whether the contact rests on a stop."""

    @property
    def impacts(self) -> int:
        """Number of impacts to solve for. A symmetric motion is solved for over half its period."""
        both = max(self.right, 0) + max(self.left, 0)
        return both // 2 if self.symmetric else both

    @property
    def without_impacts(self) -> bool:
        """Whether the motion is the steady one, which touches no stop."""
        return self.right == self.left == -1

    @property
    def solvable(self) -> bool:
        """Whether the motion is a finite sequence of impacts."""
        return not (self.without_impacts or self.sticking or INFINITE in (self.right, self.left))


class MotionGrid(NamedTuple):
    """The grid of a map and the name of the motion at every point."""

    plane: Plane
    """The plane of the map, with n vertical and m horizontal values."""
    names: tuple[MotionName, ...]
    """All names of motions in the map."""
    name_index: Integers
    """(n, m) Index in `names`; NO_NAME where the map has no periodic motion."""
    slowest_impact: Floats
    """(n, m) Speed of the slowest impact, which distinguishes orbits of one name; 0 where the map has NaN."""
    settled_after: Integers
    """(n, m) Forcing periods after which the motion was recognised, as in a map."""

    @classmethod
    def of(cls, plane: Plane, arrays: Mapping[str, NDArray[Any]]) -> MotionGrid:
        """Take a plane and the arrays of `unfolding.unfolding_map_tile`.

        Raises
        ------
        ParameterError
            An axis has fewer than two values, or values that do not increase. `Plane.check` refuses the plane. The
            arrays are not of the plane's shape.
        """
        for axis in plane.axes:
            if len(axis.values) < 2 or not np.all(np.diff(axis.values) > 0.0):
                raise ParameterError(axis.name, "must be an increasing list of at least two numbers")
        plane.check()
        if arrays["kind"].shape != plane.shape:
            raise ParameterError("arrays", "must have a row for every vertical and a column for every horizontal value")
        names, name_index = _names(arrays, plane.mirrors)
        slowest_impact = np.nan_to_num(arrays["least_impact_velocity"])
        settled_after = arrays["settled_after"].astype(np.int64)
        return cls(plane, names, name_index, slowest_impact, settled_after)

    def name_at(self, point: GridPoint) -> MotionName | None:
        """Return the name of a point's motion; None where it is not periodic."""
        index = int(self.name_index[point])
        return None if index == NO_NAME else self.names[index]

    def parameters_at(self, point: GridPoint) -> ParameterPoint:
        """Return the values of all parameters at a point."""
        return self.plane.values_at(*point)

    def oscillator_at(self, point: GridPoint) -> Oscillator:
        """Return the oscillator with its values at a point."""
        return self.parameters_at(point).applied(self.plane.oscillator)

    def name_from_codes(self, codes: Integers) -> MotionName | None:
        """Return the name of a motion from its row of `TrajectoryResults.codes`; None unless it is periodic."""
        if codes[lane_state.REASON] != RESOLVED:
            return None
        impacts = [int(codes[lane_state.IMPACTS_RIGHT]), int(codes[lane_state.IMPACTS_LEFT])]
        impacts = sorted(impacts, reverse=True) if self.plane.mirrors else impacts
        symmetric, sticking = self.plane.mirrors and bool(codes[lane_state.SYMMETRIC]), bool(codes[lane_state.STICKING])
        return MotionName(int(codes[lane_state.PERIOD]), impacts[0], impacts[1], symmetric, sticking)


def positions(values: Floats, points: Floats) -> Floats:
    """Return the positions of points in a grid of increasing values, in steps; extrapolated beyond its ends."""
    inside = np.interp(points, values, np.arange(len(values), dtype=np.float64))
    before = (points - values[0]) / (values[1] - values[0])
    after = len(values) - 1 + (points - values[-1]) / (values[-1] - values[-2])
    return np.select([points < values[0], points > values[-1]], [before, after], inside)


def _names(arrays: Mapping[str, NDArray[Any]], mirrored: bool) -> tuple[tuple[MotionName, ...], Integers]:
    """Return the names of a map, and for every point the index of its name."""
    right, left, symmetric = arrays["impacts_right"], arrays["impacts_left"], arrays["symmetric"]
    if mirrored:
        right, left = np.maximum(right, left), np.minimum(right, left)
    else:
        symmetric = np.zeros_like(symmetric)
    periodic = arrays["kind"] == KINDS.index("periodic")
    codes = np.stack([arrays["period"], right, left, symmetric, arrays["sticking"]], axis=-1).astype(np.int64)
    rows, places = np.unique(codes[periodic], axis=0, return_inverse=True)
    name_index = np.full(periodic.shape, NO_NAME, dtype=np.int64)
    name_index[periodic] = places.ravel()
    names = tuple(
        MotionName(period, first, second, bool(own), bool(rests)) for period, first, second, own, rests in rows.tolist()
    )
    return names, name_index
