"""Distances of points from a curve over a map, in steps of the map."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.records import NamedTuple


class BorderLine(NamedTuple):
    """A polyline on a map."""

    rows: Floats
    """(m,) Positions between the rows."""
    columns: Floats
    """(m,) Positions between the columns."""


def positions(values: Floats, points: Floats) -> Floats:
    """Return the positions of points in a grid of increasing values, in steps; extrapolated beyond its ends."""
    inside = np.interp(points, values, np.arange(len(values), dtype=np.float64))
    before = (points - values[0]) / (values[1] - values[0])
    after = len(values) - 1 + (points - values[-1]) / (values[-1] - values[-2])
    return np.select([points < values[0], points > values[-1]], [before, after], inside)


def nearest(line: BorderLine, drawn: Booleans, places: Floats) -> Floats:
    """Return the distances (p,) of points (p, 2) from a line, without the segments of which neither end is drawn.

    Infinite if no segment is drawn.
    """
    points = np.stack([line.rows, line.columns], axis=1)
    if len(points) == 1:
        points, drawn = np.repeat(points, 2, axis=0), np.repeat(drawn, 2)
    best = np.full(len(places), np.inf)
    for k in np.flatnonzero(drawn[:-1] | drawn[1:]):
        start, side = points[k], points[k + 1] - points[k]
        length = float(side @ side)
        share = np.clip((places - start) @ side / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(places))
        best = np.minimum(best, np.linalg.norm(places - start - share[:, None] * side, axis=1))
    return best
