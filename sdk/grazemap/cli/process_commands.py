"""The commands that compute: they take a request from flags or --json, and print, save or draw the result."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from contextlib import closing
from functools import cache
from pathlib import Path
from typing import Any

from grazemap.cli import files
from grazemap.cli.clients import service_or_stack
from grazemap.cli.command_request import CommandRequest
from grazemap.cli.exit_codes import DONE, NOT_FOUND, InvalidCommand, fail
from grazemap.cli.flags import add_flags, example, flags_of
from grazemap.cli.result_commands import describe
from grazemap.results import OrbitBranch, PeriodicOrbit
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


def compute(options: argparse.Namespace) -> int:
    """Compute the result of a process, write it where the options say, and return the exit code."""
    outputs = [
        ("the output (-o)", options.output, files.OUTPUTS),
        ("the picture (--plot)", options.plot, files.PICTURES),
    ]
    targets = [(name, path, suffixes) for name, path, suffixes in outputs if path is not None]
    for name, path, suffixes in targets:
        files.check_output(name, path, suffixes)
        if path.suffix in files.PICTURES:
            files.check_drawn(options.process)
    fields = _request(options.json) if options.json is not None else {}
    values = vars(options)
    # the texts of the flags that are used, by the places of their fields in the request: ("oscillator", "masses")
    texts = {flag.place: values[flag.pointer] for flag in flags_of(options.process) if flag.pointer in values}
    # `parsed` has put the errors of the flags into the options
    command_request = CommandRequest(options.process, fields, texts, options.errors)
    with command_request.naming_flags():
        request = command_request.validated()
        with closing(service_or_stack(options.url, options.quiet)) as client:
            result = client.submit(options.process, request).wait(progress=not options.quiet).result()
    for name, path, _ in targets:
        files.write(name, path, result, command_request.engineering)
    if not targets:
        describe(result)
    if (isinstance(result, PeriodicOrbit) and not result.converged) or (
        isinstance(result, OrbitBranch) and result.parameter.size == 0
    ):
        return fail(f"no periodic orbit was found: {result.reason}", NOT_FOUND)
    return DONE


def _arguments(process: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(add_help=False)
    parser.set_defaults(command=compute, computes=True, process=process)
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


def _request(source: Path) -> dict[str, Any]:
    try:
        with files.naming_errors("the request (--json)", source):
            text = sys.stdin.read() if str(source) == "-" else source.read_text(encoding="utf-8")
        request = json.loads(text)
    except RecursionError:
        raise InvalidCommand("the request is not JSON that can be read: its values are nested too deeply") from None
    except ValueError as error:
        raise InvalidCommand(f"the request is not JSON: {error}") from error
    if not isinstance(request, dict):
        raise InvalidCommand("the request is not a JSON object")
    return request
