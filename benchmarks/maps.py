"""Maps of the plane on all cores, and the cost of single points.

A map is cut into blocks of columns that processes of the machine's number of cores take in turn, as the worker's tiles
are; the clock of the kernel runs inside each process, so starting processes and carrying results about is not in it.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections import defaultdict
from collections.abc import Callable
from multiprocessing.synchronize import Barrier
from typing import NamedTuple

import numpy as np

from benchmarks import this_core
from benchmarks.operation_count import Scheme
from benchmarks.result import MapRun, PixelCost
from benchmarks.work import MAP_CLEARANCE, MAP_OMEGA, Floats, Integers, chain

FIXED = "fixed length, classified"
PREVIEW = "preview"
VERIFIED = "verified, with multipliers and exponents"
COLUMNS = 4
"""Columns of a block."""
_TILES = {
    FIXED: this_core.map_of_fixed_length,
    PREVIEW: this_core.map_as_preview,
    VERIFIED: this_core.map_as_served,
}
MODES = tuple(_TILES)
COMPILED_WITHIN = 300.0
"""Seconds after which a process that is not ready has failed: the pool starts another one for ever."""


class Block(NamedTuple):
    """What is asked of a process: columns of a map."""

    mode: str
    omegas: Floats
    clearances: Floats
    periods: int


class Answer(NamedTuple):
    """What a process found in a block, and how long the core took."""

    process: int
    seconds: float
    found: this_core.Classified


def grid(side: int) -> tuple[Floats, Floats]:
    """Return the frequencies and clearances of a map."""
    return np.linspace(*MAP_OMEGA, side), np.linspace(*MAP_CLEARANCE, side)


def scheme_at(omega: float, masses: int = 3) -> Scheme:
    """Return the operation count of a default chain at one frequency."""
    return Scheme(masses, this_core.DEGREE, this_core.cells_per_period(chain(masses), omega))


def run_maps(side: int, periods: int, operation_rate: float, progress: Callable[[str], None]) -> list[MapRun]:
    """Compute one map in every mode, in the order of MODES, all compared with the verified one."""
    verified_run, verified = run_map(VERIFIED, side, periods, operation_rate, progress)
    runs = {mode: run_map(mode, side, periods, operation_rate, progress, verified)[0] for mode in MODES[:-1]}
    return [*runs.values(), verified_run]


def run_map(
    mode: str,
    side: int,
    periods: int,
    operation_rate: float,
    progress: Callable[[str], None],
    verified: Integers | None = None,
) -> tuple[MapRun, Integers]:
    """Compute one map.

    Parameters
    ----------
    mode : FIXED, PREVIEW or VERIFIED
    operation_rate : float
        Operations per CPU second on the reference work, to compare with.
    verified : (side, side)
        Motions to compare with; with None they are the map's own.

    Returns
    -------
    run : MapRun
    motion : (side, side)
        As in `this_core.Classified`.
    """
    omegas, clearances = grid(side)
    blocks = [Block(mode, omegas[i : i + COLUMNS], clearances, periods) for i in range(0, side, COLUMNS)]
    processes = len(os.sched_getaffinity(0))
    context = multiprocessing.get_context("spawn")
    ready = context.Barrier(processes + 1)
    seconds: dict[int, float] = defaultdict(float)
    answers: dict[int, this_core.Classified] = {}
    with context.Pool(processes, _warm_up, (ready,)) as pool:
        ready.wait(COMPILED_WITHIN)
        began = reported = time.perf_counter()
        for number, (index, answer) in enumerate(pool.imap_unordered(_numbered, enumerate(blocks)), 1):
            seconds[answer.process] += answer.seconds
            answers[index] = answer.found
            if time.perf_counter() - reported > 5.0:
                reported = time.perf_counter()
                progress(f"map {side} x {side}, {mode}: {number / len(blocks):.0%}")
        wall = time.perf_counter() - began
    motion, halves, impacts = (
        np.concatenate(parts, axis=1) for parts in zip(*(answers[i] for i in range(len(blocks))), strict=True)
    )
    kernel_seconds = sum(seconds.values())
    operations = sum(
        0.5 * float(halves[:, i].sum()) * scheme.cells * scheme.per_cell + int(impacts[:, i].sum()) * scheme.per_impact
        for i, scheme in enumerate(scheme_at(float(omega)) for omega in omegas)
    )
    progress(f"map {side} x {side}, {mode}: {wall:.1f} s on {processes} cores")
    other = motion if verified is None else verified
    both = (motion != this_core.UNNAMED) & (other != this_core.UNNAMED)
    run = MapRun(
        mode=mode,
        side=side,
        periods=periods,
        processes=processes,
        wall_seconds=wall,
        kernel_seconds=kernel_seconds,
        longest_process=max(seconds.values()),
        pixels=side * side,
        named=int(np.count_nonzero(motion != this_core.UNNAMED)),
        forcing_periods=0.5 * float(halves.sum()),
        impacts=int(impacts.sum()),
        operations=operations,
        share_of_single_point=operations / kernel_seconds / operation_rate,
        named_as_verified=int(np.count_nonzero(both)),
        named_otherwise=int(np.count_nonzero(both & (motion != other))),
    )
    return run, motion


def pixel_cost(sampled: int, periods: int, progress: Callable[[str], None]) -> PixelCost:
    """Time pixels of a coarse grid one by one, fixed length: `sampled` per side, the fastest of three runs each."""
    oscillator = chain(3)
    omegas, clearances = grid(sampled)
    per_operation, per_step = np.empty((sampled, sampled)), np.empty((sampled, sampled))
    for i, omega in enumerate(omegas):
        scheme = scheme_at(float(omega))
        for j, clearance in enumerate(clearances):
            lanes = np.full(this_core.PIXEL_LANES, clearance)
            fastest = np.inf
            for _ in range(3):
                began = time.process_time()
                pixel = this_core.map_of_fixed_length(oscillator, omegas[i : i + 1], lanes, periods)
                fastest = min(fastest, time.process_time() - began)
            impacts = int(pixel.impacts.sum())
            cells = len(lanes) * periods * scheme.cells
            per_operation[j, i] = fastest / (cells * scheme.per_cell + impacts * scheme.per_impact)
            per_step[j, i] = fastest / (cells + impacts)
    relative = per_operation / np.median(per_operation)
    worst = np.unravel_index(int(np.argmax(relative)), relative.shape)
    progress(f"{sampled * sampled} single pixels timed, the dearest {relative.max():.2f} times the median")
    return PixelCost(
        sampled=sampled * sampled,
        percentiles={f"{q:g}": float(np.percentile(relative, q)) for q in (1, 25, 50, 75, 99)},
        largest=float(relative.max()),
        largest_at=(float(omegas[worst[1]]), float(clearances[worst[0]])),
        largest_per_cell_and_impact=float(per_step.max() / np.median(per_step)),
    )


def compile_kernels() -> None:
    """Load what the maps need, or compile it."""
    omegas, clearances = grid(2)
    for mode in _TILES:
        _compute(Block(mode, omegas[:1], clearances, 2))


def _warm_up(ready: Barrier) -> None:
    """Get a new process ready, then wait for the others."""
    compile_kernels()
    ready.wait(COMPILED_WITHIN)


def _numbered(task: tuple[int, Block]) -> tuple[int, Answer]:
    """Compute a block and say which one it was."""
    return task[0], _compute(task[1])


def _compute(block: Block) -> Answer:
    """Compute a block, the core's seconds counted."""
    tile = _TILES[block.mode]
    began = time.process_time()
    classified = tile(chain(3), block.omegas, block.clearances, block.periods)
    seconds = time.process_time() - began
    return Answer(os.getpid(), seconds, classified)
