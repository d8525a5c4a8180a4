"""How the cost grows: with the number of masses, and with the side of a map."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.contestants import time_in_turn
from benchmarks.core_peer import Core
from benchmarks.maps import FIXED, run_map, scheme_at
from benchmarks.result import MassPoint, SidePoint, Spread
from benchmarks.work import FREE, IMPACTING, SIZE_OMEGA, work_of_size

MASSES = (1, 2, 3, 5, 8)
SIDES = (64, 128, 256, 512, 1024)
SIDE_PERIODS = 20
"""Forcing periods of these maps: a tenth of the reference's, as only the growth with the side is looked at."""


def against_masses(lanes: int, periods: int, rounds: int, progress: Callable[[str], None]) -> list[MassPoint]:
    """Time chains of every size in turn, without impacts and with them.

    What an impact costs is the difference, round by round, shared among the impacts.
    """
    core = Core()
    works = {(n, at): work_of_size(n, at, lanes, periods) for n in MASSES for at in (FREE, IMPACTING)}
    clocked = time_in_turn({_key(*key): core.prepare(work) for key, work in works.items()}, rounds, progress)
    points = []
    for n in MASSES:
        free, impacting = (clocked[_key(n, at)].cpu for at in (FREE, IMPACTING))
        lane_periods = works[n, FREE].lane_periods
        impacts = int(np.sum(core.impacts(works[n, IMPACTING])))
        cells = scheme_at(SIZE_OMEGA, n).cells
        points.append(
            MassPoint(
                masses=n,
                cells=cells,
                impacts_per_period=impacts / lane_periods,
                free_impacts=int(np.sum(core.impacts(works[n, FREE]))),
                free_rate=Spread.of([lane_periods / s for s in free]),
                rate=Spread.of([lane_periods / s for s in impacting]),
                cell_seconds=Spread.of([s / lane_periods / cells for s in free]),
                impact_seconds=Spread.of([(s - t) / impacts for s, t in zip(impacting, free, strict=True)]),
            )
        )
    return points


def _key(masses: int, relative_clearance: float) -> str:
    """Return what the times of one work are kept under."""
    return f"{masses} masses, clearance {relative_clearance:g} A"


def against_sides(rate: float, budget: float, progress: Callable[[str], None]) -> list[SidePoint]:
    """Compute maps of growing side, as far as each takes less than `budget` CPU seconds at this rate."""
    points = []
    for side in SIDES:
        if side > SIDES[1] and side * side * SIDE_PERIODS / rate > budget:
            progress(f"maps of side {side} and more left out: one would take over {budget:.0f} CPU seconds")
            break
        run, _ = run_map(FIXED, side, SIDE_PERIODS, 1.0, progress)
        points.append(
            SidePoint(
                side=side,
                periods=SIDE_PERIODS,
                wall_seconds=run.wall_seconds,
                kernel_seconds=run.kernel_seconds,
            )
        )
    return points
