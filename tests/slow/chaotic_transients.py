"""Chaotic points of four systems' maps, run on for 20,000 periods: `python chaotic_transients.py POINTS [PROCESSES]`.

The maps are computed with 2,000 periods. The chance to settle that each states is compared with the number of its other
chaotic points that settle, and the exponents of those that do not with the exponents of the long runs. The runs are
those of single trajectories, by other kernels than the map's: a motion has settled if small changes shrank over the
last thousand periods.
"""

from __future__ import annotations

import math
import sys
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from grazemap_core.maps.chaotic_transients import ChanceToSettle, chance_in_map
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.samples import sample
from grazemap_core.maps.tolerances import RUN_ON
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.simulation.motion import KINDS
from tests.oracles.exponents import lyapunov_exponents
from tests.slow.beside_borders import SYSTEMS

Floats = np.ndarray[Any, np.dtype[np.float64]]

NAMES = ("of the paper", "one mass", "light damping", "low restitution")
PERIODS = 2_000
LONG = RUN_ON * PERIODS
WINDOW = 1000  # periods over which growth says whether a motion has settled
COLUMNS, ROWS = 64, 96
MOST_DEVIATIONS = 0.01  # share of exponents that may be off by more than ERRORS of their errors
ERRORS = 3.0
MEDIAN = 0.05  # of the deviations from the exponents of the long runs, relative to these


class Found(NamedTuple):
    """What a system's map states, and what the long runs give."""

    chance: ChanceToSettle
    points: int  # that were run on
    settled: int
    exponents: Floats  # (k, 3): of the map, its error, of the long run; of points that are still chaotic


def _run_on(name: str, omega: float, clearance: float) -> tuple[bool, float]:
    """Whether a trajectory from rest settles within LONG periods; its exponent per period."""
    run = lyapunov_exponents(
        SYSTEMS[name].oscillator, omega, clearance, periods=LONG - WINDOW, transient_periods=WINDOW
    )
    growth = run.running * np.arange(1, LONG - WINDOW + 1)
    return bool(growth[-1] <= growth[-1 - WINDOW]), run.first * 2.0 * math.pi / omega


def points_of(name: str, count: int) -> Found:
    """Compute a map of a system, and run on `count` of its chaotic points that are not in the sample."""
    system, rng = SYSTEMS[name], np.random.default_rng(len(name))
    omega = np.sort(rng.uniform(*system.omega, COLUMNS))
    clearance = np.sort(rng.uniform(*system.clearance, ROWS))
    tile = unfolding_map_tile(Plane.of(system.oscillator, omega, clearance), MapSettings(PERIODS))
    chance = chance_in_map(
        tile["kind"], Plane.of(system.oscillator, omega, clearance), MapSettings(max_periods=PERIODS)
    )
    assert chance is not None
    rows, columns = np.nonzero(tile["kind"] == KINDS.index("chaotic"))
    others = np.setdiff1d(np.arange(len(rows)), sample(len(rows), chance.watched))
    exponents = []
    chosen = rng.permutation(others)[:count]
    for row, column in zip(rows[chosen], columns[chosen], strict=True):
        settled, exponent = _run_on(name, float(omega[column]), float(clearance[row]))
        if not settled:
            exponents.append((tile["lyapunov"][row, column], tile["lyapunov_error"][row, column], exponent))
    return Found(chance, len(chosen), len(chosen) - len(exponents), np.array(exponents))


def binomial_errors(chance: ChanceToSettle, settled: int, points: int) -> float:
    """The difference between two shares in binomial errors of both, at their common share; 0 for equal ones."""
    common = (chance.settled + settled) / (chance.sampled + points)
    error = math.sqrt(common * (1.0 - common) * (1.0 / chance.sampled + 1.0 / points))
    return abs(chance.chance - settled / points) / error if error > 0.0 else 0.0


def main(points: int, processes: int) -> int:
    """Print what every system's map states and what was found; return how many of the statements are wrong."""
    wrong, every = 0, []
    with get_context("spawn").Pool(processes) as pool:
        results = pool.starmap(points_of, [(name, -(-points // len(NAMES))) for name in NAMES], chunksize=1)
    for name, result in zip(NAMES, results, strict=True):
        chance, off = result.chance, binomial_errors(result.chance, result.settled, result.points)
        wrong += off > ERRORS
        every.append(result.exponents)
        print(
            f"{name}: {chance.settled} of {chance.sampled} settle within {chance.run_on} periods, chance "
            f"{chance.chance:.3f} ({chance.low:.3f} to {chance.high:.3f}); of {result.points} others {result.settled} "
            f"({off:.1f} binomial errors)"
        )
    of_map, error, long = np.concatenate(every).T
    off = np.abs(of_map - long)
    beyond, deviation, stated = np.mean(off > ERRORS * error), np.median(off / long), np.median(error / long)
    wrong += int(beyond > MOST_DEVIATIONS) + int(deviation > MEDIAN)
    print(
        f"exponents of {len(long)} points that are still chaotic: {beyond:.2%} off by more than {ERRORS:g} of their "
        f"errors, the largest by {np.max(off / error):.1f}; median deviation {deviation:.1%}, median error {stated:.1%}"
    )
    print(f"{wrong} statements are wrong")
    return wrong


if __name__ == "__main__":
    arguments = [int(value) for value in sys.argv[1:]]
    sys.exit(1 if main(arguments[0], *(arguments[1:] or [2])) else 0)
