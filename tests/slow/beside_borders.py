"""Verified points beside borders of maps, run on: `python beside_borders.py BORDERS [IN_FIFTY_DIGITS] [PROCESSES]`.

Beside a border an orbit may be stable, and a trajectory near it may still leave. Borders of columns of five systems'
maps are bisected; beside each, points at distances of 1e-8 to 1e-4 are computed. Those that are verified are run on for
6000 periods, and some of them in 50 digits (`verified_points`). The verified points of small maps about borders are run
on too. Between equal stops a motion and its mirror image are one answer.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Mapping
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from grazemap_core import codes
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import AtRest, RunSettings
from grazemap_core.maps.runner import Runner
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import REASONS
from tests.slow.verified_points import DEFAULT, EQUAL, OTHER, Point, clearance_of, impacts_in_fifty_digits, verdict

Floats = np.ndarray[Any, np.dtype[np.float64]]
Integers = np.ndarray[Any, np.dtype[np.int64]]

PERIODS = 1000
RUN_ON = 6000
ZOOMS, ZOOM = 2, 40  # maps of each system about a border, of so many points squared
COLUMN = 96  # points of a column in which borders are sought
COLUMNS = 60  # of a system at most
BORDERS_OF_COLUMN = 6  # at most
SECTIONS = 16  # of a bisection
NARROWEST = 1e-9
SIDE = 14  # points on either side of a border


class System(NamedTuple):
    """An oscillator, and a window of its map that has borders.

    `clearance` is that of both stops; or of the right one, where `left` is that of the left one, infinite if absent.
    """

    oscillator: Oscillator
    omega: tuple[float, float]
    clearance: tuple[float, float]
    left: float | None = None

    def clearances(self, values: Floats) -> Floats:
        """Return clearances as maps take them."""
        return values if self.left is None else np.stack([values, np.full(len(values), self.left)], axis=1)

    def runners(self) -> tuple[Runner, Runner]:
        """Return what names motions, and what runs them on."""
        lasting = RunSettings(RUN_ON, 32, early=False, linearised=False)
        return Runner(self.oscillator, RunSettings(PERIODS, 32, linearised=False)), Runner(self.oscillator, lasting)


SYSTEMS = {
    "of the paper": System(DEFAULT, (0.26, 0.30), (1.3, 2.0)),
    "one mass": System(Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8), (0.6, 1.6), (0.2, 1.5)),
    "two masses": System(Oscillator.create([0.9, 2.4], [5.2, 11.0], 0.01, [0.0, 25.0], 0.7), (1.6, 2.4), (1.0, 5.0)),
    "light damping": System(Oscillator.create([1.0], [1.0], 0.01, [1.0], 0.9), (0.6, 1.6), (0.2, 1.5)),
    "low restitution": System(Oscillator.create([1.0, 3.0], [1.0, 2.0], 0.05, [1.0, 0.0], 0.4), (0.3, 1.2), (0.3, 1.5)),
}


class Column(NamedTuple):
    """One frequency of a system's map."""

    system: System
    runner: Runner
    omega: float

    def run(self, clearances: Floats) -> tuple[Integers, Floats]:
        """Codes and figures of the points, from rest."""
        forced = self.runner.at(self.omega)
        results = self.runner.run(forced, self.system.clearances(clearances), AtRest())
        return results[0][:, 0], results[1][:, 0]

    def labels(self, results: Integers) -> list[tuple[int, ...] | None]:
        """Period and impacts on either stop, the fewer first between equal ones; None where unresolved."""
        ordered = sorted if self.system.left is None else list
        names = [lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT]
        return [
            (int(row[names[0]]), *ordered(row[names[1:]].tolist()))
            if row[lane_state.REASON] == codes.RESOLVED
            else None
            for row in results
        ]

    def point(self, clearance: float, result: Integers, figures: Floats) -> Point:
        """Return a point with what was found there."""
        names = lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT
        period, right, left = (max(int(result[name]), 0) for name in names)
        return Point(
            self.system.oscillator,
            self.omega,
            clearance_of(self.system.clearances(np.array([clearance]))[0]),
            period,
            right,
            left,
            bool(result[lane_state.SYMMETRIC]),
            int(result[lane_state.SETTLED_AFTER]),
            float(figures[lane_state.LEAST_VELOCITY]),
            float(figures[lane_state.MULTIPLIER]),
        )


def _border(column: Column, low: float, high: float) -> tuple[float, float]:
    """Narrow a border between two clearances with different labels."""
    while high - low > NARROWEST:
        grid = np.linspace(low, high, SECTIONS + 1)
        names = column.labels(column.run(grid)[0])
        changes = [i for i in range(SECTIONS) if names[i] != names[i + 1]]
        low, high = grid[changes[0]], grid[changes[0] + 1]
    return low, high


def _is_verified(results: Integers) -> Any:
    """Which of the points are verified."""
    resolved = results[:, lane_state.REASON] == codes.RESOLVED
    return resolved & (results[:, lane_state.UNVERIFIED] == codes.RESOLVED)


def _intervals(column: Column) -> list[tuple[float, float]]:
    """Neighbours of a column's grid that have different labels."""
    grid = np.linspace(*column.system.clearance, COLUMN)
    names = column.labels(column.run(grid)[0])
    changes = [i for i in range(COLUMN - 1) if None not in names[i : i + 2] and names[i] != names[i + 1]]
    return [(float(grid[i]), float(grid[i + 1])) for i in changes]


def _beside(column: Column, rng: np.random.Generator) -> tuple[int, Floats]:
    """The number of borders of a column, and points beside them."""
    points: list[float] = []
    for interval in _intervals(column)[:BORDERS_OF_COLUMN]:
        low, high = _border(column, *interval)
        away = 10.0 ** rng.uniform(-8, -4, SIDE)
        points += [*(low - away), *(high + away)]
    return len(points) // (2 * SIDE), np.sort(np.array(points))


def points_of(name: str, system: System, borders: int, exact: int) -> tuple[Counter[str], list[Point]]:
    """Count what the points of a system are; return verified ones to be run in 50 digits, about `exact` in number."""
    rng = np.random.default_rng(len(name))
    runner, lasting = system.runners()
    counts: Counter[str] = Counter()
    sample: list[Point] = []
    while counts["borders"] < borders and counts["columns"] < COLUMNS:
        counts["columns"] += 1
        omega = float(rng.uniform(*system.omega))
        column = Column(system, runner, omega)
        borders_here, clearances = _beside(column, rng)
        counts["borders"] += borders_here
        if borders_here == 0:
            continue
        results, figures = column.run(clearances)
        resolved, verified = results[:, lane_state.REASON] == codes.RESOLVED, _is_verified(results)
        counts["points"] += len(clearances)
        counts["verified"] += int(verified.sum())
        for reason in results[resolved & ~verified, lane_state.UNVERIFIED]:
            counts[REASONS[int(reason)].partition(":")[0]] += 1
        chosen = np.flatnonzero(verified)
        then = column.labels(column._replace(runner=lasting).run(clearances[chosen])[0]) if len(chosen) else []
        for i, later in zip(chosen, then, strict=True):
            counts["run on"] += later is not None
            if later is not None and later != column.labels(results[i : i + 1])[0]:
                counts[OTHER] += 1
                print(f"{OTHER}: {column.point(clearances[i], results[i], figures[i])}, later {later}", flush=True)
        few = rng.permutation(chosen)[: -(-exact * borders_here // borders)]
        sample += [column.point(clearances[i], results[i], figures[i]) for i in few]
    return counts, sample


def zoomed(name: str, system: System, zooms: int) -> Counter[str]:
    """Count what the points of small maps are, each about a border, and how many verified ones go elsewhere later."""
    rng = np.random.default_rng(100 + len(name))
    runner, lasting = system.runners()
    counts: Counter[str] = Counter()
    while counts["zooms"] < zooms:
        omega = float(rng.uniform(*system.omega))
        column = Column(system, runner, omega)
        intervals = _intervals(column)
        if not intervals:
            continue
        middle, width = _border(column, *rng.choice(intervals))[0], 10.0 ** rng.uniform(-6, -4)
        clearances = middle * (1.0 + width * np.linspace(-0.5, 0.5, ZOOM))
        for frequency in omega * (1.0 + width * np.linspace(-0.5, 0.5, ZOOM)):
            column = Column(system, runner, float(frequency))
            results, _ = column.run(clearances)
            verified = _is_verified(results)
            later = column.labels(column._replace(runner=lasting).run(clearances)[0])
            counts["points"] += ZOOM
            counts["verified"] += int(verified.sum())
            for label, then, sure in zip(column.labels(results), later, verified, strict=True):
                counts[OTHER] += bool(sure and then is not None and then != label)
        counts["zooms"] += 1
    return counts


def in_fifty_digits(point: Point) -> str:
    """The verdict of a run in 50 digits; a motion without impacts needs none."""
    return verdict(point, impacts_in_fifty_digits(point)) if point.right + point.left else EQUAL


def main(
    borders: int, exact: int, processes: int, systems: Mapping[str, System] = SYSTEMS, zooms: int = ZOOMS
) -> Counter[str]:
    """Print the counts of every system, and return their sums; OTHER is the number of wrong verified labels."""
    total: Counter[str] = Counter()
    with get_context("spawn").Pool(processes) as pool:
        shares = -(-borders // len(systems)), -(-exact // len(systems))
        tasks = [(*named, *shares) for named in systems.items()]
        for name, (counts, sample) in zip(systems, pool.starmap(points_of, tasks, chunksize=1), strict=True):
            verdicts = Counter(pool.map(in_fifty_digits, sample, chunksize=1))
            total += counts + Counter({"in 50 digits": len(sample), OTHER: verdicts[OTHER]})
            print(f"{name}: {dict(counts)}; in 50 digits: {dict(verdicts)}", flush=True)
        counts_of_zooms = pool.starmap(zoomed, [(*named, zooms) for named in systems.items() if zooms], chunksize=1)
        for name, counts in zip(systems if zooms else (), counts_of_zooms, strict=True):
            total += counts
            print(f"{name}, {ZOOM} x {ZOOM} points about borders: {dict(counts)}", flush=True)
    print(f"{total[OTHER]} verified labels are wrong")
    return total


if __name__ == "__main__":
    arguments = [int(value) for value in sys.argv[1:]]
    sys.exit(1 if main(*arguments, *(0, 2)[len(arguments) - 1 :])[OTHER] else 0)
