"""The commands `plot`, `show` and `schema`, which need no service."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grazemap.cli import files
from grazemap.cli.outcome import DONE, InvalidCommand
from grazemap.plots import save_picture
from grazemap.results import (
    BifurcationCurves,
    BifurcationDiagram,
    CodimensionTwoPoints,
    GrazingCurve,
    OrbitBranch,
    Result,
    StopGrazingCurves,
    UnfoldingMap,
    load,
)
from grazemap.results.diagrams import QUANTITIES
from grazemap.results.observables import variables_of
from grazemap.results.tables import columns, tables, text
from grazemap.wire import PROCESSES

# Rows of each table that are printed, and the width of its lines.
_ROWS, _WIDTH = 8, 160
_WITH_QUANTITY = (UnfoldingMap, BifurcationDiagram, OrbitBranch)


def add_commands(commands: Any) -> None:
    """Add the commands to the parser's."""
    plot = commands.add_parser("plot", help="draw a saved result")
    plot.add_argument("result", type=Path, metavar="FILE", help="a .npz or .json file")
    plot.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: the result's name with .png")
    plot.add_argument(
        "--engineering-units", action="store_true", help="Hz and mm in place of rad/s and m; for a result in SI"
    )
    plot.add_argument(
        "--over",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a grazing curve, its points or bifurcation curves, drawn over a map; may be given again",
    )
    plot.add_argument(
        "--quantity", metavar="NAME", help="an observable, or an output such as spring_rms; of maps, diagrams, branches"
    )
    plot.set_defaults(command=_plot)

    show = commands.add_parser("show", help="say what a saved result is")
    show.add_argument("result", type=Path, metavar="FILE", help="a .npz or .json file")
    show.set_defaults(command=_show)

    schema = commands.add_parser("schema", help="print the JSON schema of a request")
    schema.add_argument("process", choices=sorted(PROCESSES), metavar="PROCESS", help=", ".join(PROCESSES))
    schema.set_defaults(command=_schema)


def describe(result: Result) -> None:
    """Print what a result is: its request, its notes, its tables."""
    print(repr(result)[1:-1])
    print(f"core      {result.meta.get('core_version', 'unknown')}")
    print(f"request   {json.dumps(result.meta['request'])}")
    for note in result.notes:
        print(f"note      {note.detail}")
    for name in tables(result):
        print(f"table     {name}")
        print(*text(columns(result, name), _ROWS, _WIDTH), sep="\n")


def _plot(options: argparse.Namespace) -> int:
    output = options.output or options.result.with_suffix(".png")
    if output.suffix not in files.PICTURES:
        raise InvalidCommand(f"the picture must end in one of {', '.join(files.PICTURES)}")
    with files.named("the result", options.result):
        result = load(options.result)
    files.check_drawn(result.process)
    if options.engineering_units and result.units != "SI":
        raise InvalidCommand("--engineering-units is for results in SI, and this one is nondimensional")
    over = _drawn_over(result, options.over) | _quantity(result, options.quantity)
    with files.named("the picture", output):
        save_picture(result, output, options.engineering_units, **over)
    print(output)
    return DONE


def _quantity(result: Result, name: str | None) -> dict[str, Any]:
    """Return the quantity that is drawn as an argument of `plot`."""
    if name is None:
        return {}
    found = [one.name for one, _ in variables_of(result)] if isinstance(result, _WITH_QUANTITY) else []
    own = QUANTITIES if isinstance(result, BifurcationDiagram) else ()
    if name not in (*own, *found):
        raise InvalidCommand(f"--quantity names what this result does not have (allowed: {', '.join(found) or 'none'})")
    return {"quantity": name}


def _drawn_over(result: Result, paths: Sequence[Path]) -> dict[str, Any]:
    """Return the results in files as arguments of a map's `plot`."""
    if paths and not isinstance(result, UnfoldingMap):
        raise InvalidCommand(f"--over draws over an unfolding map, and {result.process} is none")
    drawn: dict[str, Any] = {}
    for path in paths:
        with files.named("the result", path):
            one = load(path)
        if isinstance(one, BifurcationCurves):
            drawn["curves"] = [*drawn.get("curves", ()), one]
        elif isinstance(one, GrazingCurve | StopGrazingCurves):
            drawn["curve"] = one
        elif isinstance(one, CodimensionTwoPoints):
            drawn["points"] = one
        else:
            raise InvalidCommand(
                f"--over {path} has {one.process} (allowed: grazing-curves, codimension-two-points, bifurcation-curves)"
            )
    return drawn


def _show(options: argparse.Namespace) -> int:
    with files.named("the result", options.result):
        result = load(options.result)
    describe(result)
    return DONE


def _schema(options: argparse.Namespace) -> int:
    print(json.dumps(PROCESSES[options.process].model_json_schema(), indent=2))
    return DONE
