"""The quantities of a request that a server limits."""

from __future__ import annotations

from typing import NamedTuple

from grazemap.wire import CoordinateRange, Grid, grid_points

BYTES_PER_NUMBER = 8
# A result or a tile, as npz. Redis takes no value over 512 MB, and clients hold it in memory.
MOST_RESULT_BYTES = 256 << 20


class Limits(NamedTuple):
    """The maximum quantities of a request, from the server's settings."""

    points: int
    """Points of a curve or a diagram."""
    pixels: int
    """Pixels of a map."""
    adaptive_pixels: int
    """Pixels of an adaptive map."""
    tile_periods: int
    """Forcing periods of one tile."""
    result_bytes: int
    """Bytes of a result."""


class Count(NamedTuple):
    """A quantity that is known without a plan, and its limit."""

    pointer: str
    """Pointer of the field that decides it."""
    quantity: str
    """What it is."""
    number: int
    """How many there are."""
    limit: int
    """How many there may be."""


class Step(NamedTuple):
    """A step after the tiles of a job."""

    pointer: str
    """Pointer of the field that decides how long it takes."""
    seconds: float
    """The expected processor time."""
    timed: bool
    """Whether the time limit of one tile applies to it."""


def of_grid(across: tuple[str, Grid | CoordinateRange], down: tuple[str, Grid | CoordinateRange], limit: int) -> Count:
    """Return the number of points of a grid, from the names and the values of its sides; the longer side decides."""
    columns, rows = grid_points(across[1]), grid_points(down[1])
    return Count(of_points(*(across if columns > rows else down)), "points", columns * rows, limit)


def of_points(name: str, grid: Grid | CoordinateRange) -> str:
    """Return the pointer to the field that gives the number of points of a grid."""
    return f"/{name}" if isinstance(grid, list) else f"/{name}/points"
