"""The commands `plot`, `show` and `schema`, which need no service."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from inspect import signature
from pathlib import Path
from typing import Any

from grazemap import constants
from grazemap.cli import files
from grazemap.cli.exit_codes import DONE, InvalidCommand, printing
from grazemap.results import (
    BifurcationCurves,
    BifurcationDiagram,
    CodimensionTwoPoints,
    GrazingCurve,
    Result,
    StopGrazingCurves,
    UnfoldingMap,
)
from grazemap.results.diagrams import QUANTITIES
from grazemap.results.observables import variables_of
from grazemap.results.tables import shown_columns, tables, text
from grazemap.wire import PROCESSES

# Rows of each table that are printed, and the width of its lines.
_ROWS, _WIDTH = 8, 160
# What can be drawn over a map, and the keyword of its `plot`.
_OVERLAYS: dict[type[Result], str] = {
    GrazingCurve: "curve",
    StopGrazingCurves: "curve",
    CodimensionTwoPoints: "points",
    BifurcationCurves: "curves",
}


def add_arguments(command: argparse.ArgumentParser, name: str) -> None:
    """Add the arguments of one of the three commands to its parser."""
    if name == "schema":
        command.add_argument("process", choices=sorted(PROCESSES), metavar="PROCESS", help=", ".join(PROCESSES))
        command.set_defaults(command=_schema)
        return
    command.add_argument("result", type=Path, metavar="FILE", help="a .npz or .json file")
    command.set_defaults(command=_show if name == "show" else _plot)
    command.add_argument(
        "--engineering-units", action="store_true", help="Hz and mm in place of rad/s and m; for a result in SI"
    )
    if name == "show":
        endings = ", ".join(constants.TABLE_FILES)
        command.add_argument("-o", "--output", type=Path, metavar="FILE", help=f"write a table to a file: {endings}")
        command.add_argument("--table", metavar="NAME", help="the table, as `grazemap show` names it")
        return
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: the result's name with .png")
    command.add_argument(
        "--over",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a grazing curve, its points or bifurcation curves, drawn over a map; may be given again",
    )
    files.add_style(command)
    command.add_argument(
        "--quantity", metavar="NAME", help="an observable, or an output such as spring_rms; of maps, diagrams, branches"
    )


def describe(result: Result) -> None:
    """Print what a result is: its request, its notes, its tables."""
    with printing():
        print(repr(result)[1:-1])
        print(f"core      {result.meta.get('core_version', 'unknown')}")
        print(f"request   {json.dumps(result.meta['request'])}")
        for note in result.notes:
            print(f"note      {note.detail}")
        for name in tables(result):
            print(f"table     {name}")
            print(*text(shown_columns(result, name), _ROWS, _WIDTH), sep="\n")


def _plot(options: argparse.Namespace) -> int:
    output = options.output or options.result.with_suffix(".png")
    if output.suffix not in files.PICTURES:
        raise InvalidCommand(f"the picture must end in one of {', '.join(files.PICTURES)}")
    result = _read(options)
    files.check_drawn(result.process)
    keywords = _overlays(result, options.over) | _quantity(result, options.quantity)
    files.write("the picture", output, result, options.style, **keywords)
    return DONE


def _read(options: argparse.Namespace) -> Result:
    """Return the result of a command. Raises InvalidCommand for engineering units that it does not have."""
    result = files.read(options.result)
    if options.engineering_units and result.units != "SI":
        raise InvalidCommand("--engineering-units is for results in SI, and this one is nondimensional")
    return result.in_units(*constants.ENGINEERING_UNITS) if options.engineering_units else result


def _quantity(result: Any, name: str | None) -> dict[str, Any]:
    """Return the quantity to draw, as a keyword of `plot`."""
    if name is None:
        return {}
    has_quantities = "quantity" in signature(result.plot).parameters
    observed = [variable.name for variable, _ in variables_of(result)] if has_quantities else []
    own = QUANTITIES if isinstance(result, BifurcationDiagram) else ()
    if name not in (*own, *observed):
        allowed = ", ".join((*own, *observed)) or "none"
        raise InvalidCommand(f"--quantity names what this result does not have (allowed: {allowed})")
    return {"quantity": name}


def _overlays(result: Result, paths: Sequence[Path]) -> dict[str, Any]:
    """Return the results in files as keywords of the `plot` of a map."""
    if paths and not isinstance(result, UnfoldingMap):
        raise InvalidCommand(f"--over draws over an unfolding map, and {result.process} is none")
    drawn: dict[str, Any] = {}
    for path in paths:
        overlay = files.read(path)
        keyword = _OVERLAYS.get(type(overlay))
        if keyword is None:
            allowed = ", ".join(dict.fromkeys(kind.process for kind in _OVERLAYS))
            raise InvalidCommand(f"--over {path} has {overlay.process} (allowed: {allowed})")
        drawn[keyword] = [*drawn.get(keyword, ()), overlay] if keyword == "curves" else overlay
    return drawn


def _show(options: argparse.Namespace) -> int:
    if options.output is not None:
        files.check_output("the table (-o)", options.output, constants.TABLE_FILES)
    result = _read(options)
    if options.output is None:
        describe(result)
        return DONE
    try:
        with files.naming_errors("the table", options.output):
            result.save(options.output, options.table)
    except ValueError as error:
        raise InvalidCommand(f"--table: {error}") from error
    with printing():
        print(options.output)
    return DONE


def _schema(options: argparse.Namespace) -> int:
    with printing():
        print(json.dumps(PROCESSES[options.process].model_json_schema(), indent=2))
    return DONE
