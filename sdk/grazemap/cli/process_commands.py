"""The parsers of the commands that compute."""

from __future__ import annotations

import argparse
import shlex
from functools import cache
from pathlib import Path
from typing import Any

from grazemap.cli import files
from grazemap.cli.flags import add_flags, example
from grazemap.wire import PROCESSES

# In front of the example of each process.
_SI_EXAMPLE = (
    "in SI: --units SI --masses 0.5,2 --stiffnesses 2000,8000 --damping 1.5,6 --forcing 5,0 --restitution 0.8,\n"
    "       with frequencies such as 10Hz and lengths such as 3mm"
)


@cache
def options_of_parser(process: str, plans: bool = False) -> dict[str, Any]:
    """Return the options with which the parser of a process is made: one that computes it, or plans it."""
    operation = PROCESSES[process].operation
    return {
        "parents": [_arguments(process, plans)],
        "usage": "%(prog)s [FLAGS]",
        "formatter_class": argparse.RawDescriptionHelpFormatter,
        "description": operation.description,
        "epilog": f"{_SI_EXAMPLE}\nexample: grazemap {shlex.join(example(process))}".replace("%", "%%"),
    }


def _compute(options: argparse.Namespace) -> int:
    from grazemap.cli.computation import compute  # with the client, the results and the plots

    return compute(options)


def _plan(options: argparse.Namespace) -> int:
    from grazemap.cli.tile_commands import plan

    return plan(options)


def _arguments(process: str, plans: bool) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(add_help=False)
    parser.set_defaults(command=_plan if plans else _compute, computes=True, process=process)
    add_flags(parser, process)
    group = parser.add_argument_group("source and folder" if plans else "source, result and service")
    group.add_argument(
        "--json",
        type=Path,
        metavar="FILE",
        help="the request as JSON, whose fields flags override; - reads standard input",
    )
    if plans:
        group.add_argument(
            "-o", "--output", type=Path, metavar="FOLDER", required=True, help="folder for the request and its tiles"
        )
        return parser
    group.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help=f"file of the result: {', '.join(files.OUTPUTS)}"
    )
    group.add_argument("--plot", type=Path, metavar="FILE", help="picture of the result: .png, .svg or .pdf")
    files.add_style(group)
    group.add_argument(
        "--url",
        help="address of a service (default: GRAZEMAP_URL, else a service on this machine, else a temporary stack)",
    )
    group.add_argument(
        "--direct", action="store_true", help="compute with processes of this command, without a service"
    )
    group.add_argument(
        "--checkpoint",
        type=Path,
        metavar="FOLDER",
        help="keep finished tiles here, and go on from those that are here; without a service",
    )
    group.add_argument("--quiet", action="store_true", help="no progress bar, and no lines on what the job waits for")
    return parser
