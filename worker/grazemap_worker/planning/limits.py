"""Quantities of a request that a server limits."""

from __future__ import annotations

from typing import NamedTuple

from grazemap.wire import Grid, grid_points

BYTES_PER_NUMBER = 8
# Maximum bytes of a result or a tile, as npz. Redis takes no value over 512 MB, and clients hold a result in memory.
MAX_RESULT_BYTES = 256 << 20


class RequestLimits(NamedTuple):
    """The limits of the quantities of a request: settings of the server, and `MAX_RESULT_BYTES`."""

    points: int
    """Maximum points of a curve or a diagram."""
    pixels: int
    """Maximum pixels of a map."""
    adaptive_pixels: int
    """Maximum pixels of an adaptive map."""
    tile_periods: int
    """Maximum forcing periods of one trajectory, or of all trajectories of a tile."""
    result_bytes: int
    """Maximum bytes of a result."""


class Count(NamedTuple):
    """A count that follows from the fields of a request, such as its number of points, with the limit of the server."""

    pointer: str
    """JSON pointer to the field that determines the count."""
    quantity: str
    """What is counted, for example "points"."""
    number: int
    """The count."""
    limit: int
    """Maximum of the count."""


class Step(NamedTuple):
    """A step after the tiles of a job."""

    pointer: str
    """JSON pointer to the field that determines how long the step takes."""
    seconds: float
    """The expected processor time."""
    timed: bool
    """Whether the time limit of one tile applies to it."""


def grid_count(across: tuple[str, Grid], up: tuple[str, Grid], limit: int) -> Count:
    """Return the count of the points of a grid; each side is (name of the field, values).

    The pointer of the count leads to the longer side.
    """
    columns, rows = grid_points(across[1]), grid_points(up[1])
    return Count(points_pointer(*(across if columns > rows else up)), "points", columns * rows, limit)


def points_pointer(name: str, grid: Grid) -> str:
    """Return the JSON pointer to the field that determines the number of points of a grid."""
    return f"/{name}" if isinstance(grid, list) else f"/{name}/points"
