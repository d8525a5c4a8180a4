"""Compilation of every kernel, so that processes that are forked afterwards inherit the machine code.

With numba's disk cache several processes can compile different parts at the same time:

    python -m grazemap_core.warmup maps
    python -m grazemap_core.warmup trajectories grazing orbits
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.curve import grazing_curve
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.one_impact_branches import one_impact_branch
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.simulation.trajectories import trajectory

OMEGA = np.array([0.28, 0.29])


def _grazing(oscillator: Oscillator) -> None:
    grazing_curve(oscillator, OMEGA, max_order=2)
    codimension_two_points(oscillator, 0.25, 0.35, max_order=2, max_multiple=1)
    one_impact_branch(oscillator, 0.28)


def _trajectories(oscillator: Oscillator) -> None:
    trajectory(oscillator, 0.29, 1.6, periods=2, samples_per_period=4).at(OMEGA)


def _orbits(oscillator: Oscillator) -> None:
    guess = sequence_of_stops(oscillator, 0.27, 1.85, 1, [1])
    assert guess is not None  # it is None for one impact per period
    orbit = periodic_orbit(oscillator, 0.27, 1.85, guess)
    orbit_branch(oscillator, orbit, 1.84, 1.86, max_points=2)


def _maps(oscillator: Oscillator) -> None:
    unfolding_map_tile(oscillator, OMEGA, np.array([1.6]), max_periods=4, max_period=2)


PARTS: dict[str, Callable[[Oscillator], None]] = {
    "grazing": _grazing,
    "trajectories": _trajectories,
    "orbits": _orbits,
    "maps": _maps,
}
"""The public computations, each on a small case, by the name of the part."""


def warm_up(*parts: str) -> float:
    """Run the given parts, or all of them, for both kinds of damping, and return the time taken in seconds."""
    began = time.perf_counter()
    for damping in (0.05, [0.05, 0.05, 0.05]):
        oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], damping, [1.0, 0.0, 0.0], 0.8)
        for part in parts or PARTS:
            PARTS[part](oscillator)
    return time.perf_counter() - began


if __name__ == "__main__":
    warm_up(*sys.argv[1:])
