"""The page docs/performance.md, from a benchmark run.

`python -m benchmarks.report docs/performance.json > docs/performance.md` writes the page (`make performance` does, with
the document of the last run); its picture goes into docs/pictures, or the folder given with --pictures. Every figure
comes from the document.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from benchmarks.result import Bench
from benchmarks.tables import tables, wrapped

PICTURE = "cost_against_size.svg"


def page(bench: Bench, picture: str) -> str:
    """Return the page; `picture` is the path of the picture from the page."""
    machine = bench.machine
    ours = bench.throughput[0]
    versions = ", ".join(f"{name} {number}" for name, number in machine.versions.items())
    head = [
        "`make performance` writes this page from [the document](performance.json) of one run of `make bench`; do not"
        " edit it." + (" The run was a quick one: its figures are less precise." if bench.quick else ""),
        f"Made {bench.made[:10]} in {bench.seconds:.0f} s on {machine.cores} cores of: {machine.processor}, compiled"
        f" for {machine.target} ({_vectors(machine.features)}), {machine.system}, load {machine.load:.1f} before the"
        f" run. Versions: {versions}. Kernel of this core: {bench.kernel}.",
        f"Only ratios from one run are valid on another machine. The tools take turns for {len(ours.cpu_seconds)}"
        " rounds. Figures are medians over the rounds with their quartiles in brackets, and a ratio is taken within"
        " each round. Seconds are CPU seconds of one core, as other programs on the machine affect these"
        " least. Wall seconds are in the document too.",
        f"The reference work is the default oscillator at omega = {bench.omega:g} and clearance {bench.clearance:g},"
        f" from rest, for {ours.periods} forcing periods. Where a tool runs many lanes at once, their clearances"
        ' differ slightly, so that their impacts are not simultaneous. In rows marked "alike" every lane is the'
        " reference trajectory. A tool that runs one lane runs the reference trajectory. What a tool makes ready before"
        " a run, code and tables, is not timed.",
    ]
    body = tables(bench).replace("## Cost against size\n", f"## Cost against size\n\n![Cost against size]({picture})\n")
    return "\n\n".join(["# Performance", *map(wrapped, head), body])


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


def _vectors(features: list[str]) -> str:
    """Name the vector units among the processor's features."""
    named = [name for name in ("sse2", "avx", "avx2", "fma", "avx512f", "neon") if name in features]
    return ", ".join(named) or "no vector unit known"


def main() -> None:
    """Print the page of a document and draw its picture."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.report", description="The page of a benchmark run.")
    parser.add_argument("path", type=Path, help="JSON document that a run has written")
    parser.add_argument("--pictures", type=Path, default=Path("docs/pictures"), help="folder for the picture")
    arguments = parser.parse_args()
    bench = Bench.model_validate_json(arguments.path.read_text("utf-8"))
    draw(bench, arguments.pictures / PICTURE)
    sys.stdout.write(page(bench, f"{arguments.pictures.name}/{PICTURE}"))


if __name__ == "__main__":
    main()
