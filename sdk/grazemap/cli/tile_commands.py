"""The commands `plan`, `tile` and `assemble`: a computation in parts, by processes that share a folder."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path

from grazemap.cli import files
from grazemap.cli.computation import code_of, request_of
from grazemap.cli.exit_codes import DONE, InvalidCommand, printing
from grazemap.client.events import Event
from grazemap.client.messages import result_of
from grazemap.client.progress import ProgressListener
from grazemap.server_command import worker_module
from grazemap.whole_files import whole_file

# The units in which the request was written, as JSON in the folder: they are no part of the request, nor of a tile.
_UNITS = "shown_units.json"
# What Slurm tells the tasks of an array: this task, the first and the last one, their number, and their distance.
_ARRAY = [f"SLURM_ARRAY_TASK_{name}" for name in ("ID", "MIN", "MAX", "COUNT", "STEP")]


def add_arguments(command: argparse.ArgumentParser, name: str) -> None:
    """Add the arguments of one of the two commands after `plan` to its parser."""
    command.add_argument("folder", type=Path, metavar="FOLDER", help="the folder that `grazemap plan` made")
    if name == "tile":
        command.set_defaults(command=_tile)
        command.add_argument(
            "index",
            type=int,
            nargs="?",
            metavar="INDEX",
            help="the tile, from 0; in an array of Slurm left out: each task computes its share of all tiles",
        )
        command.add_argument(
            "--of", type=int, metavar="COUNT", help="compute the tiles INDEX, INDEX + COUNT, and so on"
        )
        return
    command.set_defaults(command=_assemble)
    command.add_argument(
        "-o", "--output", type=Path, metavar="FILE", required=True, help=f"the result: {', '.join(files.OUTPUTS)}"
    )
    command.add_argument("--quiet", action="store_true", help="no progress bar")


def plan(options: argparse.Namespace) -> int:
    """Make the folder of a computation, say how many tiles it has and what to do next, and return the exit code."""
    command_request = request_of(options)
    with command_request.naming_flags():
        request = command_request.validated()
    with files.naming_errors("the folder", options.output):
        planned = worker_module("direct").planned(request, options.output)
        with whole_file(options.output / _UNITS) as path:
            path.write_text(json.dumps(command_request.shown_units), encoding="utf-8")
    count, seconds = planned.plan.tile_count if planned.has_tiles else 0, planned.plan.estimate.seconds
    with printing():
        print(f"{options.output}: {count} tiles, about {seconds:.3g} s of one core in all")
        if count:
            print(f"for each INDEX from 0 to {count - 1}, anywhere: grazemap tile {options.output} INDEX")
        print(f"then: grazemap assemble {options.output} -o FILE")
    return DONE


def _tile(options: argparse.Namespace) -> int:
    first, step = _share(options)
    for index, kept in worker_module("direct").compute_tiles(options.folder, first, step):
        with printing():
            print(f"tile {index}{': there already' if kept else ''}")
    return DONE


def _share(options: argparse.Namespace) -> tuple[int, int]:
    """Return the first tile of this process, and the step to its next one; 0: it has one tile."""
    index, count = options.index, options.of
    if index is not None and count is None:
        return index, 0
    if index is not None:
        if not 0 <= index < count:
            raise InvalidCommand(f"INDEX is not one of COUNT processes (allowed: 0 to {count - 1})")
        return index, count
    if count is not None:
        raise InvalidCommand("--of needs INDEX, which counts the processes from 0")
    try:
        task, first, last, tasks, step = (int(os.environ[name]) for name in _ARRAY)
    except (KeyError, ValueError):
        raise InvalidCommand(f"INDEX is missing, and {_ARRAY[0]} of an array of Slurm is not set") from None
    if last - first != (tasks - 1) * step:
        allowed = f"sbatch --array=0-{tasks - 1}, or INDEX"
        raise InvalidCommand(f"the array has gaps, so that the shares of its tasks are not known (allowed: {allowed})")
    return (task - first) // step, tasks


def _assemble(options: argparse.Namespace) -> int:
    files.check_output("the output (-o)", options.output, files.OUTPUTS)
    with ProgressListener("assemble", not options.quiet) as listener:
        request, outcome = worker_module("direct").assembled(
            options.folder, lambda name, data: listener(Event("", name, data))
        )
    result = result_of(request, outcome).in_units(*_shown_units(options.folder))
    files.write("the output (-o)", options.output, result)
    return code_of(result)


def _shown_units(folder: Path) -> list[str]:
    """Return the units in which the request of a folder was written."""
    path = folder / _UNITS
    with files.naming_errors("the units", path):
        try:
            units = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:  # the folder is a checkpoint
            return []
    if not isinstance(units, list) or not all(isinstance(unit, str) for unit in units):
        raise InvalidCommand(f"{path} is no list of units")
    return units
