"""One whole run: every measurement in its order, and the document that comes of it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from benchmarks import maps, near_grazing, peak, served, size_law, stages, this_core
from benchmarks.contestants import Clocked, Contestant, time_in_turn
from benchmarks.core_peer import Core
from benchmarks.exact import errors_of, exact_impact_times
from benchmarks.heyoka_peer import Heyoka, fastest_batch
from benchmarks.law import fit
from benchmarks.machine import describe
from benchmarks.result import Advantage, Bench, CoreAlone, Limit, Spread, Throughput
from benchmarks.scipy_peer import Scipy
from benchmarks.work import CLEARANCE, OMEGA, PERIODS, SIZE_OMEGA, Work, reference_work
from grazemap_core.compiled_ahead import PROCESSOR, has_level_3

EXACT_IMPACTS = 20
PEAK = "peak"


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    rounds: int
    core_lanes: int
    heyoka_lanes: int
    scipy_periods: int
    core_cases: int
    heyoka_cases: int
    scipy_cases: int
    map_side: int
    map_budget: float
    served_rounds: int
    pixels: int
    side_budget: float


FULL = Extent(
    rounds=9, core_lanes=512, heyoka_lanes=128, scipy_periods=PERIODS, core_cases=10_000, heyoka_cases=10_000,
    scipy_cases=100, map_side=512, map_budget=300.0, served_rounds=3, pixels=24, side_budget=50.0,
)  # fmt: skip
QUICK = Extent(
    rounds=3, core_lanes=256, heyoka_lanes=128, scipy_periods=25, core_cases=300, heyoka_cases=300,
    scipy_cases=10, map_side=512, map_budget=5.0, served_rounds=1, pixels=6, side_budget=1.0,
)  # fmt: skip
"""A budget is in CPU seconds: a map that would take longer at the measured rate is made smaller, and says so."""


@dataclass(frozen=True)
class Entry:
    """A tool with the share of the reference work that it is given: fewer lanes and periods for slower ones."""

    tool: Contestant
    work: Work
    alike: bool

    @property
    def key(self) -> str:
        """What its times are kept under."""
        return f"{self.tool.name}{', all lanes alike' if self.alike else ''}"


def run(quick: bool, progress: Callable[[str], None]) -> Bench:
    """Measure everything."""
    began = time.perf_counter()
    extent = QUICK if quick else FULL
    machine = describe()
    core, scipy = Core(), Scipy()
    progress("kernels are compiled or loaded")
    core.prepare(reference_work(1))
    maps.compile_kernels()
    batch = fastest_batch()
    heyoka, heyoka_loose = Heyoka(batch=batch), Heyoka(scipy.rtol, batch)

    entries = [
        Entry(core, reference_work(extent.core_lanes), False),
        Entry(heyoka, reference_work(extent.heyoka_lanes), False),
        Entry(scipy, reference_work(1, extent.scipy_periods), False),
        Entry(heyoka_loose, reference_work(extent.heyoka_lanes), False),
        Entry(core, reference_work(extent.core_lanes, alike=True), True),
        Entry(heyoka, reference_work(extent.heyoka_lanes, alike=True), True),
    ]
    multiply_add, count = peak.prepared(100_000)
    clocked = time_in_turn(
        {**{entry.key: entry.tool.prepare(entry.work) for entry in entries}, PEAK: multiply_add},
        extent.rounds,
        progress,
    )
    progress(f"the first {EXACT_IMPACTS} impacts in 40-digit arithmetic")
    exact = exact_impact_times(entries[0].work, EXACT_IMPACTS)
    throughput = [_throughput(entry, clocked[entry.key], exact) for entry in entries]
    ours = throughput[0]
    limit = _limit(ours.rate, ours.impacts_per_period, Spread.of([count / s for s in clocked[PEAK].cpu]))
    progress(f"{ours.rate.median:.3g} periods/s, {limit.share.median:.1%} of the operation count's limit")

    profile = stages.stages(extent.core_lanes, PERIODS, ours.impacts_per_period, extent.rounds, progress)
    grazing = near_grazing.count(
        [
            (core, extent.core_cases),
            (heyoka, extent.heyoka_cases),
            (heyoka_loose, extent.heyoka_cases),
            (scipy, extent.scipy_cases),
        ],
        progress,
    )
    side = extent.map_side
    while side > 32 and side * side * PERIODS / ours.rate.median > extent.map_budget:
        side //= 2
    if side < extent.map_side:
        progress(f"the map is {side} x {side}: a larger one would take over {extent.map_budget:.0f} CPU seconds")
    operation_rate = ours.rate.median * limit.operations_per_period
    map_runs = maps.run_maps(side, PERIODS, operation_rate, progress)
    served_runs = served.run_served(side, PERIODS, extent.served_rounds, progress)
    pixel_cost = maps.pixel_cost(extent.pixels, PERIODS, progress)
    masses = size_law.against_masses(extent.core_lanes // 4, PERIODS, extent.rounds, progress)
    narrow = _narrow(quick, progress)
    sides = size_law.against_sides(ours.rate.median, extent.side_budget, progress)
    return Bench(
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        quick=quick,
        seconds=time.perf_counter() - began,
        machine=machine,
        kernel=this_core.KERNEL,
        core=core.name,
        omega=OMEGA,
        clearance=CLEARANCE,
        size_omega=SIZE_OMEGA,
        throughput=throughput,
        advantages=_advantages(throughput, core.name),
        limit=limit,
        stages=profile,
        grazing=grazing,
        maps=map_runs,
        served=served_runs,
        pixel_cost=pixel_cost,
        masses=masses,
        cell_law=fit([p.masses for p in masses], [p.cell_seconds.median for p in masses]),
        impact_law=fit([p.masses for p in masses], [p.impact_seconds.median for p in masses]),
        narrow=narrow,
        sides=sides,
        side_law=fit([point.side**2 for point in sides], [point.kernel_seconds for point in sides]),
    )


def core_alone(quick: bool, progress: Callable[[str], None]) -> CoreAlone:
    """Measure what depends on the instructions: the reference work and the cost of cells and impacts."""
    extent = QUICK if quick else FULL
    core, work = Core(), reference_work(extent.core_lanes)
    multiply_add, count = peak.prepared(100_000)
    clocked = time_in_turn({core.name: core.prepare(work), PEAK: multiply_add}, extent.rounds, progress)
    impacts = float(np.sum(core.impacts(work))) / work.lane_periods
    rate = Spread.of([work.lane_periods / s for s in clocked[core.name].cpu])
    return CoreAlone(
        target=describe().target,
        limit=_limit(rate, impacts, Spread.of([count / s for s in clocked[PEAK].cpu])),
        stages=stages.stages(extent.core_lanes, PERIODS, impacts, extent.rounds, progress),
        masses=size_law.against_masses(extent.core_lanes // 4, PERIODS, extent.rounds, progress),
    )


def _narrow(quick: bool, progress: Callable[[str], None]) -> CoreAlone | None:
    """Measure the core in a process whose kernels are compiled for x86-64-v3, if this processor has that level."""
    if not has_level_3():
        return None
    progress("the core with the instructions of x86-64-v3")
    command = [sys.executable, "-m", "benchmarks.narrow", *(["--quick"] if quick else [])]
    done = subprocess.run(command, env=os.environ | PROCESSOR, stdout=subprocess.PIPE, check=True)
    return CoreAlone.model_validate_json(done.stdout)


def _throughput(entry: Entry, clocked: Clocked, exact: list[str]) -> Throughput:
    """Put together what was measured of one tool."""
    impacts = entry.tool.impacts(entry.work)
    errors = errors_of(entry.tool.impact_times(entry.work, len(exact)), exact)
    return Throughput(
        tool=entry.tool.name,
        lanes=len(entry.work.clearances),
        alike=entry.alike,
        periods=entry.work.periods,
        cpu_seconds=clocked.cpu,
        wall_seconds=clocked.wall,
        rate=Spread.of([entry.work.lane_periods / s for s in clocked.cpu]),
        impacts_per_period=float(np.sum(impacts)) / entry.work.lane_periods,
        impacts_of_lane_0=int(impacts[0]),
        largest_error=float(errors.max()),
        impacts_compared=len(errors),
    )


def _advantages(throughput: list[Throughput], core: str) -> list[Advantage]:
    """Divide this core's rate by every other tool's, round by round and like with like."""
    ours = {entry.alike: entry.rate.values for entry in throughput if entry.tool == core}
    return [
        Advantage(
            tool=other.tool,
            alike=other.alike,
            ratio=Spread.of([a / b for a, b in zip(ours[other.alike], other.rate.values, strict=True)]),
        )
        for other in throughput
        if other.tool != core
    ]


def _limit(rate: Spread, impacts_per_period: float, measured: Spread) -> Limit:
    """Compare the core's rate with the operation count at the measured peak, round by round."""
    scheme = maps.scheme_at(OMEGA)
    operations = scheme.per_period(impacts_per_period)
    limits = [peak_rate / operations for peak_rate in measured.values]
    return Limit(
        peak=measured,
        masses=scheme.masses,
        degree=scheme.degree,
        cells=scheme.cells,
        impacts=impacts_per_period,
        operations_per_cell=scheme.per_cell,
        operations_per_impact=scheme.per_impact,
        operations_per_period=operations,
        rate=Spread.of(limits),
        share=Spread.of([reached / limit for reached, limit in zip(rate.values, limits, strict=True)]),
    )
