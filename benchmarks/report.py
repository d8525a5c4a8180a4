"""The tables of a benchmark run, and the page docs/performance.md.

`python -m benchmarks.report docs/performance.json > docs/performance.md` writes the page (`make performance` does, with
the document of the last run); its picture goes into docs/pictures, or the folder given with --pictures. Every figure
comes from the document.
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.result import Bench, GrazingRow, Law, MapRun, ServedMap, Spread

PICTURE = "cost_against_size.svg"


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
    ]
    return "\n".join(f"## {title}\n\n{text}\n" for title, text in parts)


def page(bench: Bench, picture: str) -> str:
    """Return the page; `picture` is the path of the picture from the page."""
    machine = bench.machine
    ours = bench.throughput[0]
    versions = ", ".join(f"{name} {number}" for name, number in machine.versions.items())
    head = [
        "`make performance` writes this page from [the document](performance.json) of one run of `make bench`; do not"
        " edit it." + (" The run was a quick one: its figures are less precise." if bench.quick else ""),
        f"Made {bench.made[:10]} in {bench.seconds:.0f} s on {machine.cores} cores of: {machine.processor}, code for"
        f" {machine.target} ({_vectors(machine.features)}), {machine.system}, load {machine.load:.1f} before the run."
        f" Versions: {versions}. Kernel of this core: {bench.kernel}.",
        f"Only ratios from one run are valid on another machine. The tools take turns for {len(ours.cpu_seconds)}"
        " rounds. Figures are medians over the rounds with their quartiles in brackets, and a ratio is taken within"
        " each round. Seconds are CPU seconds of one core, which other programs on the machine affect least; wall"
        " seconds are in the document too.",
        f"The reference work is the default oscillator at omega = {bench.omega:g} and clearance {bench.clearance:g},"
        f" from rest, for {ours.periods} forcing periods. Where a tool runs many lanes at once, their clearances differ"
        ' slightly, so that lanes do not hit together. In rows marked "alike" every lane is the reference trajectory.'
        " A tool that runs one lane runs the reference trajectory.",
    ]
    body = tables(bench).replace("## Cost against size\n", f"## Cost against size\n\n![Cost against size]({picture})\n")
    return "\n\n".join(["# Performance", *map(_wrapped, head), body])


def draw(bench: Bench, path: Path) -> None:
    """Draw cost against the number of masses and against the side of a map."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({"svg.hashsalt": "grazemap", "svg.fonttype": "path", "font.size": 9}):
        figure = Figure(figsize=(9.0, 3.0), layout="constrained")
        cell, impact, sides = figure.subplots(1, 3)
        masses = [point.masses for point in bench.masses]
        ends = [0.0, max(masses) + 1.0]
        for axes, spreads, law, title in (
            (cell, [point.cell_seconds for point in bench.masses], bench.cell_law, "a cell"),
            (impact, [point.impact_seconds for point in bench.masses], bench.impact_law, "an impact"),
        ):
            middle = [1e9 * spread.median for spread in spreads]
            below = [1e9 * (spread.median - spread.low) for spread in spreads]
            above = [1e9 * (spread.high - spread.median) for spread in spreads]
            axes.errorbar(masses, middle, yerr=(below, above), fmt="o")
            axes.plot(ends, [1e9 * (law.constant + law.slope * n) for n in ends])
            axes.set(xlabel="masses N", ylabel="nanoseconds of a core", title=title, xlim=ends, ylim=(0.0, None))
        pixels = [point.side**2 for point in bench.sides]
        sides.loglog(pixels, [point.kernel_seconds for point in bench.sides], "o")
        line = [bench.side_law.constant + bench.side_law.slope * n for n in pixels]
        sides.loglog(pixels, line)
        sides.set(xlabel="points", ylabel="CPU seconds of the core", title=f"a map of {bench.sides[0].periods} periods")
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, format="svg", metadata={"Date": None})


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
        + _wrapped(
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
        _wrapped(
            f"The minimum number of double-precision operations of the lockstep scheme with N = {limit.masses} and"
            f" degree {limit.degree}, with a fused multiply-add as one operation. `benchmarks/operation_count.py`"
            " describes the scheme."
        )
        + "\n\n"
        + _table(("quantity", "value"), rows)
    )


def _stages(bench: Bench) -> str:
    """Write what the core spends its time on."""
    rows = [
        (stage.name, _spread(stage.nanoseconds, "{:.3g}"), _spread(stage.share, "{:.0%}")) for stage in bench.stages
    ]
    return (
        _wrapped(
            "The time of one forcing period of one lane of the reference work. The two vector parts are timed in loops"
            " of their own; the last row is the remainder."
        )
        + "\n\n"
        + _table(("part", "ns", "share"), rows)
    )


def _grazing(bench: Bench) -> str:
    """Write the first impacts found, per tool and overshoot."""
    overshoots = list(dict.fromkeys(row.overshoot for row in bench.grazing))
    tools: dict[str, list[GrazingRow]] = {}
    for row in bench.grazing:
        tools.setdefault(row.tool, []).append(row)
    rows = []
    for tool, found in tools.items():
        by_overshoot = {row.overshoot: row for row in found}
        cells = [_found(by_overshoot[overshoot]) for overshoot in overshoots]
        rows.append((tool, str(found[0].cases), *cells, str(sum(row.invented for row in found))))
    head = ("tool", "frequencies", *(f"{overshoot:g}" for overshoot in overshoots), "false contacts")
    return (
        _wrapped(
            "The number of first impacts found when the free motion would overshoot the stop by the given fraction of"
            " its amplitude, at random frequencies. The last column counts contacts reported where the motion stays"
            " inside by the same fraction."
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
        + _wrapped(
            f"{bench.maps[0].processes} processes. Core seconds are CPU seconds, of all processes and of the busiest"
            ' one. "Named" is the share of points with a named motion. "Otherwise" counts the points that a map names'
            ' differently, among those that the verified map names too. "Periods run" are means per point. "Share" is'
            " the throughput of the map over that of the reference work, both in operations of the count above per CPU"
            f" second, for the periods that were run. Of {cost.sampled} single points timed alone at fixed length, the"
            f" cost per operation relative to the median is {spread}; the maximum is {cost.largest:.2f}, at omega ="
            f" {cost.largest_at[0]:.4f}, clearance {cost.largest_at[1]:.4f}. With cells + impacts as the measure the"
            f" maximum is {cost.largest_per_cell_and_impact:.2f}."
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
        + _wrapped(
            f"Computed through HTTP by a stack with {bench.served[0].workers} workers, in turn, for"
            f" {len(bench.served[0].wall_seconds)} rounds. Core seconds are the `cpu_seconds` of the job. A preview is"
            f' the map "{bench.maps[1].mode}" of the table above.'
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


def _sizes(bench: Bench) -> str:
    """Write cost against masses and against the side of a map, with the fitted laws."""
    masses = [
        (
            str(point.masses),
            str(point.cells),
            f"{point.impacts_per_period:.3f}",
            _spread(point.rate, "{:.3g}"),
            _spread(point.free_rate, "{:.3g}"),
            f"{1e9 * point.cell_seconds.median:.3g}",
            f"{1e9 * point.impact_seconds.median:.3g}",
        )
        for point in bench.masses
    ]
    head = ("masses", "cells", "impacts", "periods/s/core", "without impacts", "ns per cell", "ns per impact")
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
        _wrapped(
            f"Chains of N masses at omega = {bench.size_omega:g}. Cells and impacts are per forcing period. The cost of"
            " an impact is in addition to that of its cell."
        )
        + f"\n\n{_table(head, masses)}\n\n"
        + _wrapped(f"A cell costs {_law(bench.cell_law)}. An impact costs {_law(bench.impact_law)}.")
        + "\n\n"
        + _table(("side", "periods", "wall s", "core s, all processes", "core ns per point and period"), sides)
        + "\n\n"
        + _wrapped(
            f"A map costs {law.constant:.2g} + {1e6 * law.slope:.3g} CPU seconds per million points, with a maximum"
            f" deviation of {law.largest_deviation:.0%} from this line. As a power law: points to the"
            f" {law.exponent:.3f}."
        )
    )


def _law(law: Law) -> str:
    """Write a law in N."""
    return (
        f"{1e9 * law.constant:.3g} + {1e9 * law.slope:.3g} N nanoseconds, with a maximum deviation of"
        f" {law.largest_deviation:.0%} from this line. As a power law: N to the {law.exponent:.2f}"
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


def _wrapped(text: str) -> str:
    """Return a paragraph in lines of at most 120 characters."""
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _vectors(features: list[str]) -> str:
    """Name the vector units among the processor's features."""
    named = [name for name in ("sse2", "avx", "avx2", "fma", "avx512f", "neon") if name in features]
    return ", ".join(named) or "no vector unit known"


def main() -> None:
    """Print the page of a document and draw its picture."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.report", description="The page of a benchmark run.")
    parser.add_argument("path", type=Path, help="JSON document that a run has written")
    parser.add_argument("--pictures", type=Path, default=Path("docs/pictures"), help="folder for the picture")
    given = parser.parse_args()
    bench = Bench.model_validate_json(given.path.read_text("utf-8"))
    draw(bench, given.pictures / PICTURE)
    sys.stdout.write(page(bench, f"{given.pictures.name}/{PICTURE}"))


if __name__ == "__main__":
    main()
