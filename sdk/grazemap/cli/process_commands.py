"""The parsers of the commands that compute."""

from __future__ import annotations

import argparse
import shlex
from functools import cache
from pathlib import Path
from typing import Any

from grazemap.cli.flags import add_flags, example
from grazemap.wire import PROCESSES

# In front of the example of each process.
_SI_EXAMPLE = (
    "in SI: --units SI --masses 0.5,2 --stiffnesses 2000,8000 --damping 1.5,6 --forcing 5,0 --restitution 0.8,\n"
    "       with frequencies such as 10Hz and lengths such as 3mm"
)


@cache
def options_of_parser(process: str) -> dict[str, Any]:
    """Return the options with which the parser of a process is made."""
    operation = PROCESSES[process].operation
    return {
        "parents": [_arguments(process)],
        "usage": "%(prog)s [FLAGS]",
        "formatter_class": argparse.RawDescriptionHelpFormatter,
        "description": operation.description,
        "epilog": f"{_SI_EXAMPLE}\nexample: grazemap {shlex.join(example(process))}".replace("%", "%%"),
    }


def _compute(options: argparse.Namespace) -> int:
    from grazemap.cli.computation import compute  # with the client, the results and the plots

    return compute(options)


def _arguments(process: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(add_help=False)
    parser.set_defaults(command=_compute, computes=True, process=process)
    add_flags(parser, process)
    group = parser.add_argument_group("source, result and service")
    group.add_argument(
        "--json",
        type=Path,
        metavar="FILE",
        help="the request as JSON, whose fields flags override; - reads standard input",
    )
    group.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="file of the result: .npz, .json, .png, .svg or .pdf"
    )
    group.add_argument("--plot", type=Path, metavar="FILE", help="picture of the result: .png, .svg or .pdf")
    group.add_argument(
        "--url",
        help="address of a service (default: GRAZEMAP_URL, else a service on this machine, else a temporary stack)",
    )
    group.add_argument("--quiet", action="store_true", help="no progress bar, and no lines on what the job waits for")
    return parser
