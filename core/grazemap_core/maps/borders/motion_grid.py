"""The part of a map on which its borders depend: its grid, and the names of the motions at its points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import INFINITE, RESOLVED
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels import lane_state
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS

Point = tuple[int, int]
"""Row (clearance) and column (omega) of a point of a map."""

NO_NAME = -1


class Name(NamedTuple):
    """The name of a periodic motion in a map; mirror images have the same name.

    Attributes
    ----------
    period : int
    more, fewer : int
        Impacts on the stop that is struck more often, and on the other one; codes as in a map.
    symmetric, sticking : bool
    """

    period: int
    more: int
    fewer: int
    symmetric: bool
    sticking: bool

    @property
    def impacts(self) -> int:
        """Number of impacts to solve for: for symmetric motions, those of half the period."""
        both = max(self.more, 0) + max(self.fewer, 0)
        return both // 2 if self.symmetric else both

    @property
    def free(self) -> bool:
        """Whether it is the steady motion, without impacts."""
        return self.more == -1

    @property
    def solvable(self) -> bool:
        """Whether it is a finite sequence of impacts."""
        return not (self.free or self.sticking or INFINITE in (self.more, self.fewer))


class Grid(NamedTuple):
    """The part of a map on which its borders depend.

    Attributes
    ----------
    oscillator : Oscillator
    omega, clearance : (m,), (n,)
    names : tuple of Name
    name : int (n, m)
        Index in `names`; NO_NAME where the map has no periodic motion.
    slowest : (n, m)
        Speed of the slowest impact, which distinguishes orbits of one name.
    settled_after : int (n, m)
    """

    oscillator: Oscillator
    omega: Floats
    clearance: Floats
    names: tuple[Name, ...]
    name: Integers
    slowest: Floats
    settled_after: Integers

    @classmethod
    def of(cls, oscillator: Oscillator, omega: Floats, clearance: Floats, arrays: Mapping[str, NDArray[Any]]) -> Grid:
        """Take the arrays of `unfolding.unfolding_map_tile`.

        Raises
        ------
        ParameterError
            The arrays are not of the grid's shape, or the grid has fewer than two values on a side.
        """
        for key, values in (("omega", omega), ("clearance", clearance)):
            if len(values) < 2 or not np.all(np.diff(values) > 0.0):
                raise ParameterError(key, "must be an increasing list of at least two numbers")
        right, left = arrays["impacts_right"], arrays["impacts_left"]
        if right.shape != (len(clearance), len(omega)):
            raise ParameterError("arrays", "must have a row for every clearance and a column for every omega")
        periodic = arrays["kind"] == KINDS.index("periodic")
        columns = [arrays["period"], np.maximum(right, left), np.minimum(right, left)]
        codes = np.stack([*columns, arrays["symmetric"], arrays["sticking"]], axis=-1).astype(np.int64)
        found, places = np.unique(codes[periodic], axis=0, return_inverse=True)
        name = np.full(periodic.shape, NO_NAME, dtype=np.int64)
        name[periodic] = places.ravel()
        names = tuple(
            Name(period, more, fewer, bool(symmetric), bool(sticking))
            for period, more, fewer, symmetric, sticking in found.tolist()
        )
        slowest = np.nan_to_num(arrays["least_impact_velocity"])
        return cls(oscillator, omega, clearance, names, name, slowest, arrays["settled_after"].astype(np.int64))

    def name_at(self, point: Point) -> Name | None:
        """Return the name of a point's motion; None where it is not periodic."""
        number = int(self.name[point])
        return None if number == NO_NAME else self.names[number]

    def place(self, point: Point) -> tuple[float, float]:
        """Return omega and clearance of a point."""
        return float(self.omega[point[1]]), float(self.clearance[point[0]])


def name_of(code: Integers) -> Name | None:
    """Return the name that codes of `kernels.lane_state` stand for; None unless the motion is periodic."""
    if code[lane_state.REASON] != RESOLVED:
        return None
    impacts = int(code[lane_state.IMPACTS_RIGHT]), int(code[lane_state.IMPACTS_LEFT])
    symmetric, sticking = bool(code[lane_state.SYMMETRIC]), bool(code[lane_state.STICKING])
    return Name(int(code[lane_state.PERIOD]), max(impacts), min(impacts), symmetric, sticking)
