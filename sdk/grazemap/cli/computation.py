"""The computation of a command: the request from flags or --json, and the result, printed, saved or drawn."""

from __future__ import annotations

import argparse
import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grazemap import constants
from grazemap.cli import files
from grazemap.cli.command_request import CommandRequest
from grazemap.cli.exit_codes import DONE, NOT_FOUND, InvalidCommand, fail
from grazemap.cli.flags import flags_of
from grazemap.wire import ProcessRequest

if TYPE_CHECKING:
    from grazemap.results import Result


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
        if path.suffix in constants.TABLE_FILES:
            files.check_tables(options.process)
    command_request = request_of(options)
    with command_request.naming_flags():
        request = command_request.validated()
        for name, path, _ in targets:
            files.check_rows(name, path, request)
        result = _result(request, options).in_units(*command_request.shown_units)
    for name, path, _ in targets:
        files.write(name, path, result, options.style)
    if not targets:
        from grazemap.cli.result_commands import describe

        describe(result)
    return code_of(result)


def code_of(result: Result) -> int:
    """Return the exit code of a command that has computed a result; report a periodic orbit that was not found."""
    from grazemap.results import OrbitBranch, PeriodicOrbit

    if (isinstance(result, PeriodicOrbit) and not result.converged) or (
        isinstance(result, OrbitBranch) and result.parameter.size == 0
    ):
        return fail(f"no periodic orbit was found: {result.reason}", NOT_FOUND)
    return DONE


def request_of(options: argparse.Namespace) -> CommandRequest:
    """Return the request of a command, from its flags and --json."""
    fields = _request(options.json) if options.json is not None else {}
    values = vars(options)
    # the texts of the flags that are used, by the places of their fields in the request: ("oscillator", "masses")
    texts = {flag.place: values[flag.pointer] for flag in flags_of(options.process) if flag.pointer in values}
    # `parsed` has put the errors of the flags into the options
    return CommandRequest(options.process, fields, texts, options.errors)


def _result(request: ProcessRequest, options: argparse.Namespace) -> Result:
    """Return the result of a request, from a service or without it."""
    # a wrong request is reported without these
    if options.direct or options.checkpoint is not None:
        if options.url is not None:
            raise InvalidCommand("--url is the address of a service, and --direct and --checkpoint use none")
        from grazemap.client.direct import direct

        with direct() as client:
            computed: Result = client.compute(
                options.process, request, progress=not options.quiet, checkpoint=options.checkpoint
            )
        return computed
    from grazemap.cli.clients import service_or_stack

    with closing(service_or_stack(options.url, options.quiet)) as client:
        return client.submit(options.process, request).wait(progress=not options.quiet).result()


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
