"""The command line: run a stack, show the state of one, run a process, draw a result.

Exit codes: 0 success; 1 failure of the service, the job or a file; 2 invalid command or request;
3 success, but no periodic orbit was found; 130 Ctrl-C.
"""

from __future__ import annotations

import io
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from grazemap.cli import commands
from grazemap.cli.exit_codes import DONE, FAILED, INTERRUPTED, INVALID, InvalidCommand, fail
from grazemap.errors import ConnectionFailed, GrazemapError, ParameterError, RequestWarning


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # not every console can show the infinity of a label
    options = commands.parsed(sys.argv[1:] if arguments is None else arguments)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("always", RequestWarning)
            warnings.showwarning = _print_warning
            code: int = options.command(options)
            sys.stdout.flush()
    except BrokenPipeError:  # the reader of the output, such as `head`, has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except (InvalidCommand, ParameterError) as error:
        return fail(error, INVALID)
    except ConnectionFailed as error:
        return fail(f"{error}\nStart one with `grazemap up`, or give its address with --url.", FAILED)
    except (GrazemapError, OSError) as error:
        return fail(error, FAILED)
    except KeyboardInterrupt as interrupt:
        for note in getattr(interrupt, "__notes__", ()):
            print(f"grazemap: {note}", file=sys.stderr)
        return INTERRUPTED
    return code


def _print_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"grazemap: note: {message}", file=sys.stderr)
