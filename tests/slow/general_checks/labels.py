"""Verified labels of random systems' maps, run again in 50 digits."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from grazemap_core.contact.stops import both_clearances
from grazemap_core.model.equilibrium import contact_equilibrium
from tests.slow import verified_points
from tests.slow.verified_points import EQUAL, NO_VERDICT, OTHER, Point, clearance_of
from tests.support.lines import column as column_of
from tests.support.random_systems import System, random_system

from .table import Row, part

SYSTEMS, PIXELS = 20, 440
"""Some systems have fewer."""
COLUMNS, ROWS = 60, 8
"""Columns of a system that are searched for points at most, and points of a column."""
OF_COLUMN = 3

Floats = np.ndarray[Any, np.dtype[np.float64]]


def clearances_at(system: System, shares: Floats) -> Floats:
    """Return clearances (n, 2) whose gaps from the equilibrium are shares of the system's."""
    place = contact_equilibrium(system.oscillator)
    right, left = both_clearances(system.clearance)
    return np.stack([place + shares * (right - place), -place + shares * (left + place)], axis=1)


def verified_pixels(seed: int, pixels: int) -> list[Point]:
    """Return verified points with impacts of a random system's map, as many as that or all that are found."""
    system, rng = random_system(seed), np.random.default_rng(seed)
    points: list[Point] = []
    for _ in range(COLUMNS):
        omega = system.omega * float(rng.uniform(0.8, 1.25))
        clearances = clearances_at(system, rng.uniform(0.5, 1.3, ROWS))
        tile = column_of(system.oscillator, omega, clearances, verified_points.MAX_PERIODS)
        column = {name: values[:, 0] for name, values in tile.items()}
        hit = np.maximum(column["impacts_right"], column["impacts_left"]) > 0
        for i in np.flatnonzero(column["verified"] & hit)[:OF_COLUMN].tolist():
            pixel = {name: values[i].item() for name, values in column.items()}
            points.append(Point.of(system.oscillator, omega, clearance_of(clearances[i]), pixel))
        if len(points) >= pixels:
            break
    return points[:pixels]


def check(share: float, processes: int) -> list[Row]:
    """Compare labels."""
    systems = part(SYSTEMS, min(1.0, 4.0 * share))
    find = partial(verified_pixels, pixels=max(1, part(PIXELS, share) // systems))
    counts = verified_points.main(systems, processes, find)
    judged, unknown = counts[EQUAL] + counts[OTHER], f"{counts[NO_VERDICT]} without a verdict"
    return [Row(f"verified pixels of {systems} systems, 50 digits", judged, counts[OTHER], unknown)]
