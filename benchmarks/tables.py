"""The tables of a benchmark run, in Markdown; every figure comes from its document."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from benchmarks.result import Bench, CoreAlone, GrazingRow, Law, MapRun, MassPoint, ServedMap, Spread, Stage


def tables(bench: Bench) -> str:
    """Return every table of a run, as Markdown that reads well in a terminal too."""
    parts = [
        ("Throughput", _throughput(bench)),
        ("Ratios", _ratios(bench)),
        ("The operation count's limit", _limit(bench)),
        ("Where the time goes", _stages(bench)),
        ("Near-grazing first impacts", _grazing(bench)),
        ("Maps", _maps(bench)),
        ("Maps through the service", _served(bench)),
        ("Cost against size", _sizes(bench)),
        *([("Without AVX-512", _narrow(bench.narrow))] if bench.narrow else []),
    ]
    return "\n".join(f"## {title}\n\n{text}\n" for title, text in parts)


def _throughput(bench: Bench) -> str:
    """Write one row per tool."""
    rows = [
        (
            entry.tool + (", alike" if entry.alike else ""),
            str(entry.lanes),
            str(entry.periods),
            _spread(entry.rate, "{:.3g}"),
            f"{entry.impacts_per_period:.3f}",
            str(entry.impacts_of_lane_0),
            f"{entry.largest_error:.1e}",
        )
        for entry in bench.throughput
    ]
    compared = min(entry.impacts_compared for entry in bench.throughput)
    head = ("tool", "lanes", "periods", "periods/s/core", "impacts per period", "impacts of lane 0", "largest error")
    return (
        _table(head, rows)
        + "\n\n"
        + wrapped(
            f"The largest error is over the first {compared} impact times of lane 0, compared with 40-digit arithmetic"
            " from the same binary64 inputs."
        )
    )


def _ratios(bench: Bench) -> str:
    """Write the ratios of speed."""
    rows = [
        (advantage.tool + (", both alike" if advantage.alike else ""), _spread(advantage.ratio, "{:.3g}"))
        for advantage in bench.advantages
    ]
    return _table(("speed of this core over that of", "ratio"), rows)


def _limit(bench: Bench) -> str:
    """Write what the machine allows, and what is reached."""
    limit = bench.limit
    rows = [
        ("peak of one core, measured: multiply-adds/s", _spread(limit.peak, "{:.3g}")),
        ("operations per cell", str(limit.operations_per_cell)),
        ("operations per impact", str(limit.operations_per_impact)),
        (
            f"operations per period: {limit.cells} cells, {limit.impacts:.3f} impacts",
            f"{limit.operations_per_period:.0f}",
        ),
        ("limit: periods/s/core", _spread(limit.rate, "{:.3g}")),
        ("this core", _spread(bench.throughput[0].rate, "{:.3g}")),
        ("share of the limit", _spread(limit.share, "{:.1%}")),
    ]
    return (
        wrapped(
            f"The minimum number of double-precision operations of the lockstep scheme with N = {limit.masses} and"
            f" degree {limit.degree}, with a fused multiply-add as one operation. `benchmarks/operation_count.py`"
            " describes the scheme."
        )
        + "\n\n"
        + _table(("quantity", "value"), rows)
    )


def _stages(bench: Bench) -> str:
    """Write what the core spends its time on."""
    return (
        wrapped(
            "The table divides the time of one forcing period of one lane of the reference work. The cells and the"
            " impacts are timed in loops of their own; the last row is the remainder."
        )
        + "\n\n"
        + _parts(bench.stages)
    )


def _parts(stages: Iterable[Stage]) -> str:
    rows = [(stage.name, _spread(stage.nanoseconds, "{:.3g}"), _spread(stage.share, "{:.0%}")) for stage in stages]
    return _table(("part", "ns", "share"), rows)


def _grazing(bench: Bench) -> str:
    """Write the first impacts found, per tool and overshoot."""
    overshoots = list(dict.fromkeys(row.overshoot for row in bench.grazing))
    tools: dict[str, list[GrazingRow]] = {}
    for row in bench.grazing:
        tools.setdefault(row.tool, []).append(row)
    rows = []
    for tool, tool_rows in tools.items():
        by_overshoot = {row.overshoot: row for row in tool_rows}
        cells = [_found(by_overshoot[overshoot]) for overshoot in overshoots]
        rows.append((tool, str(tool_rows[0].cases), *cells, str(sum(row.invented for row in tool_rows))))
    head = ("tool", "frequencies", *(f"{overshoot:g}" for overshoot in overshoots), "false contacts")
    return (
        wrapped(
            "The table has the number of first impacts found when the free motion would overshoot the stop by the given"
            " fraction of its amplitude, at random frequencies. The last column has the number of contacts that are"
            " reported although the motion stays inside the stops by the same fraction."
        )
        + "\n\n"
        + _table(head, rows)
    )


def _maps(bench: Bench) -> str:
    """Write the maps and the cost of single pixels."""
    rows = [_map_row(run) for run in bench.maps]
    head = ("map", "periods", "wall s", "core s, all", "core s, longest", "named", "otherwise", "periods run", "share")
    cost = bench.pixel_cost
    spread = ", ".join(f"{value:.2f} at {name} %" for name, value in cost.percentiles.items())
    return (
        _table(head, rows)
        + "\n\n"
        + wrapped(
            f"The maps are computed by {bench.maps[0].processes} processes. Core seconds are CPU seconds, of all"
            ' processes and of the busiest one. "Named" is the share of points with a named motion. "Otherwise" counts'
            ' the points that a map names differently, among those that the verified map names too. "Periods run" are'
            ' means per point. "Share" is the throughput of the map divided by that of the reference work, both in'
            f" operations of the count above per CPU second, for the periods that were run. Of {cost.sampled} single"
            f" points timed alone at fixed length, the cost per operation relative to the median is {spread}; the"
            f" maximum is {cost.largest:.2f}, at omega = {cost.largest_at[0]:.4f}, clearance {cost.largest_at[1]:.4f}."
            " If the cost is taken per cell and impact instead, the maximum is"
            f" {cost.largest_per_cell_and_impact:.2f}."
        )
    )


def _map_row(run: MapRun) -> tuple[str, ...]:
    """Write one map."""
    return (
        f"{run.side} x {run.side}, {run.mode}",
        str(run.periods),
        f"{run.wall_seconds:.2f}",
        f"{run.kernel_seconds:.2f}",
        f"{run.longest_process:.2f}",
        f"{run.named / run.pixels:.1%}",
        f"{run.named_otherwise} of {run.named_as_verified}",
        f"{run.forcing_periods / run.pixels:.0f}",
        f"{run.share_of_single_point:.2f}",
    )


def _served(bench: Bench) -> str:
    """Write the maps that were asked of a stack."""
    head = ("map", "periods", "tiles", "wall s", "core s, all", "core s per worker")
    return (
        _table(head, [_served_row(asked) for asked in bench.served])
        + "\n\n"
        + wrapped(
            f"The maps are computed over HTTP by a stack with {bench.served[0].workers} workers, in turn, for"
            f" {len(bench.served[0].wall_seconds)} rounds. Core seconds are the `cpu_seconds` of the job."
        )
    )


def _served_row(asked: ServedMap) -> tuple[str, ...]:
    """Write one map of a stack."""
    cpu, wall = Spread.of(asked.cpu_seconds), Spread.of(asked.wall_seconds)
    return (
        f"{asked.side} x {asked.side}, {asked.mode}",
        str(asked.periods),
        str(asked.tiles),
        _spread(wall, "{:.2f}"),
        _spread(cpu, "{:.2f}"),
        f"{cpu.median / asked.workers:.2f}",
    )


def _narrow(alone: CoreAlone) -> str:
    """Write what the core reaches with other instructions."""
    limit = alone.limit
    return (
        wrapped(
            f"The core compiled for {alone.target} on the same processor: {_spread(limit.share, '{:.1%}')} of the"
            f" limit, whose peak is {_spread(limit.peak, '{:.3g}')} multiply-adds a second with these instructions."
        )
        + f"\n\n{_parts(alone.stages)}\n\n{_masses(alone.masses)}"
    )


def _masses(points: Iterable[MassPoint]) -> str:
    """Write the cost of a cell and of an impact against the number of masses."""
    head = ("masses", "cells", "impacts", "periods/s/core", "without impacts", "ns per cell", "ns per impact")
    rows = [
        (
            str(point.masses),
            str(point.cells),
            f"{point.impacts_per_period:.3f}",
            _spread(point.rate, "{:.3g}"),
            _spread(point.free_rate, "{:.3g}"),
            f"{1e9 * point.cell_seconds.median:.3g}",
            f"{1e9 * point.impact_seconds.median:.3g}",
        )
        for point in points
    ]
    return _table(head, rows)


def _sizes(bench: Bench) -> str:
    """Write cost against masses and against the side of a map, with the fitted laws."""
    sides = [
        (
            str(point.side),
            str(point.periods),
            f"{point.wall_seconds:.3g}",
            f"{point.kernel_seconds:.3g}",
            f"{1e9 * point.kernel_seconds / (point.side**2 * point.periods):.3g}",
        )
        for point in bench.sides
    ]
    law = bench.side_law
    return (
        wrapped(
            f"Chains of N masses at omega = {bench.size_omega:g}. Cells and impacts are per forcing period. The cost of"
            " an impact is in addition to that of its cell."
        )
        + f"\n\n{_masses(bench.masses)}\n\n"
        + wrapped(f"A cell costs {_law(bench.cell_law)}. An impact costs {_law(bench.impact_law)}.")
        + "\n\n"
        + _table(("side", "periods", "wall s", "core s, all processes", "core ns per point and period"), sides)
        + "\n\n"
        + wrapped(
            f"A map costs {law.constant:.2g} CPU seconds, and {1e6 * law.slope:.3g} more for every million points,"
            f" with a maximum deviation of {law.largest_deviation:.0%} from this line. A power law in the number of"
            f" points has the fitted exponent {law.exponent:.3f}."
        )
    )


def _law(law: Law) -> str:
    """Write a law in N."""
    return (
        f"{1e9 * law.constant:.3g} + {1e9 * law.slope:.3g} N nanoseconds, with a maximum deviation of"
        f" {law.largest_deviation:.0%} from this line. A power law in N has the fitted exponent {law.exponent:.2f}"
    )


def _found(row: GrazingRow) -> str:
    """Write how many were found, with the share when not all."""
    return "all" if row.found == row.cases else f"{row.found} ({100.0 * row.found / row.cases:.4g}%)"


def _spread(spread: Spread, form: str) -> str:
    """Write median and quartiles."""
    return f"{form.format(spread.median)} ({form.format(spread.low)} .. {form.format(spread.high)})"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown, its columns aligned."""
    lines = [list(head), *map(list, rows)]
    widths = [max(3, *(len(line[i]) for line in lines)) for i in range(len(head))]
    lines.insert(1, ["-" * width for width in widths])
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |" for line in lines
    )


def wrapped(text: str) -> str:
    """Return a paragraph in lines of at most 120 characters."""
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)
