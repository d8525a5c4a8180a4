"""The command line: run a stack, show the state of one, run a process, draw a result.

Exit codes: 0 success; 1 failure of the service, the job or a file; 2 invalid command or request;
3 success, but no periodic orbit was found; 130 Ctrl-C.
"""

from __future__ import annotations

import argparse
import io
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from grazemap import streams
from grazemap.cli import commands
from grazemap.cli.exit_codes import FAILED, INTERRUPTED, INVALID, InvalidCommand, fail, say
from grazemap.errors import ConnectionFailed, GrazemapError, ParameterError, RequestWarning


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # not every console can show the infinity of a label
    try:
        options = commands.parsed(sys.argv[1:] if arguments is None else arguments)
        return _run(options)
    finally:
        # also the help, after which `parsed` has ended this process
        streams.flush(sys.stdout)
        streams.flush(sys.stderr)


def _run(options: argparse.Namespace) -> int:
    """Run the command of some options, report what it raises, and return its exit code."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", RequestWarning)
            warnings.showwarning = _print_warning
            code: int = options.command(options)
    except (InvalidCommand, ParameterError) as error:
        return fail(error, INVALID)
    except ConnectionFailed as error:
        return fail(f"{error}\nStart one with `grazemap up`, or give its address with --url.", FAILED)
    except (GrazemapError, OSError) as error:
        return fail(error, FAILED)
    except KeyboardInterrupt as interrupt:
        for note in getattr(interrupt, "__notes__", ()):
            say(note)
        return INTERRUPTED
    return code


def _print_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    say(f"note: {message}")
