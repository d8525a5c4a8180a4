"""Maps asked for as clients ask: through the service, Redis and workers of a stack on this machine.

The seconds are those that the workers count for a job, of computing in their own processes; what forks, packs and
carries the tiles is in the wall time only. Every round asks another question, since one that was asked before is
answered at once.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

import grazemap
from benchmarks.maps import PREVIEW, VERIFIED
from benchmarks.result import ServedMap
from benchmarks.work import MAP_CLEARANCE, MAP_OMEGA

_MODES: dict[str, dict[str, Any]] = {VERIFIED: {}, PREVIEW: {"preview": True}}
_APART = 1e-9
"""Between the questions of two rounds: the same work to eight digits."""


def run_served(side: int, periods: int, rounds: int, progress: Callable[[str], None]) -> list[ServedMap]:
    """Ask for the map in every mode, in turn."""
    workers = len(os.sched_getaffinity(0))
    cpu: dict[str, list[float]] = {mode: [] for mode in _MODES}
    wall: dict[str, list[float]] = {mode: [] for mode in _MODES}
    tiles: dict[str, int] = {}
    with grazemap.local(workers=workers) as client:
        first = [
            client.submit("unfolding-maps", _question(columns, side, 2, 0) | extra)
            for extra in _MODES.values()
            for columns in range(8, 8 + 4 * workers)
        ]
        for job in first:  # enough of them for every worker to load the kernels
            job.wait()
        for number in range(rounds):
            for mode, extra in _MODES.items():
                began = time.perf_counter()
                job = client.submit("unfolding-maps", _question(side, side, periods, number) | extra).wait()
                wall[mode].append(time.perf_counter() - began)
                finished = job.refresh().job
                assert finished.cpu_seconds is not None
                cpu[mode].append(finished.cpu_seconds)
                tiles[mode] = finished.estimate.tiles
                progress(f"map {side} x {side} through the service, {mode}: {wall[mode][-1]:.1f} s")
    return [
        ServedMap(
            mode=mode,
            side=side,
            periods=periods,
            workers=workers,
            tiles=tiles[mode],
            cpu_seconds=cpu[mode],
            wall_seconds=wall[mode],
        )
        for mode in _MODES
    ]


def _question(columns: int, rows: int, periods: int, number: int) -> dict[str, Any]:
    """Return the question for a map of the window."""
    (left, right), (low, high) = MAP_OMEGA, MAP_CLEARANCE
    return {
        "omega": {"start": left, "stop": right, "points": columns},
        "clearance": {"start": low, "stop": high + _APART * number, "points": rows},
        "max_periods": periods,
    }
