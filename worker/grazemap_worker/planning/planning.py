"""The planning of a process: its tiles, its estimate, and the quantities that a server limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from grazemap.wire import CoordinateRange, Grid, grid_points
from grazemap_worker.planning.plan import Plan

BYTES_PER_NUMBER = 8
_COMPILING_SECONDS = {"curves": 5.0, "trajectories": 9.0, "orbits": 8.0, "maps": 40.0, "diagrams": 45.0}
_COMPILING_SECONDS |= {"observables": 25.0, "map_observables": 65.0}
_APART_SECONDS = 20.0


def compiling_seconds(kernels: str) -> float:
    """Return the time in which one core of a server compiles kernels, roughly."""
    name, apart = kernels.partition("-")[0], kernels.startswith("apart_")
    return _COMPILING_SECONDS[name.removeprefix("apart_")] + (_APART_SECONDS if apart else 0.0)


class Limits(NamedTuple):
    """The maximum quantities of a request, from the server's settings."""

    points: int
    pixels: int
    adaptive_pixels: int
    tile_periods: int
    result_bytes: int


class Count(NamedTuple):
    """A quantity that is known without a plan, and its limit; `pointer` is that of the field that decides it."""

    pointer: str
    quantity: str
    number: int
    limit: int


class Step(NamedTuple):
    """A step after the tiles of a job; if it is `timed`, the time limit of one tile applies to it."""

    pointer: str
    seconds: float
    timed: bool


@dataclass(frozen=True)
class Planning:
    """How a process is planned; each function takes the validated request.

    Attributes
    ----------
    plan : callable (request) -> Plan
    counts : callable (request, limits) -> list of Count
        Cheap: the service calls it before the plan is made, so that a range of 10**18 points costs nothing.
    longest_period : callable (request) -> float or None
        The cost of the longest forcing period that is simulated, as `costs.period_cost`; None: none is. Like the counts
        it is checked before the plan is made, whose numbers could overflow.
    after : callable (request) -> list of Step
    kernels : str
        The step of `grazemap_core.warmup` that compiles its kernels, without a number of masses.
    apart : callable (request) -> bool
        Whether it has trajectories from rest that share no tables, for which more is compiled.
    of_masses : bool
        Whether they are compiled for each number of masses.
    """

    plan: Callable[[Any], Plan]
    counts: Callable[[Any, Limits], list[Count]] = lambda request, limits: []
    longest_period: Callable[[Any], float | None] = lambda request: None
    after: Callable[[Any], list[Step]] = lambda request: []
    kernels: str = "curves"
    apart: Callable[[Any], bool] = lambda request: False
    of_masses: bool = False


def of_grid(across: tuple[str, Grid | CoordinateRange], down: tuple[str, Grid | CoordinateRange], limit: int) -> Count:
    """Return the number of points of a grid, from the names and the values of its sides; the longer side decides."""
    columns, rows = grid_points(across[1]), grid_points(down[1])
    return Count(of_points(*(across if columns > rows else down)), "points", columns * rows, limit)


def of_points(name: str, grid: Grid | CoordinateRange) -> str:
    """Return the pointer to the field that gives the number of points of a grid."""
    return f"/{name}" if isinstance(grid, list) else f"/{name}/points"
