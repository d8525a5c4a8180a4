"""The exit codes of commands, and what they print on stderr and stdout."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from grazemap import streams

DONE, FAILED, INVALID, NOT_FOUND, INTERRUPTED = 0, 1, 2, 3, 130


class InvalidCommand(Exception):
    """The arguments of a command are not valid."""


def fail(error: Exception | str, code: int) -> int:
    """Print an error on stderr and return the exit code."""
    say(str(error))
    return code


def say(text: str) -> None:
    """Print a line on stderr. What is printed there never ends a command."""
    streams.write(sys.stderr, f"grazemap: {text}\n")


@contextmanager
def printing() -> Iterator[None]:
    """Leave this block, which prints on stdout and does nothing else, when the reader, such as `head`, has enough."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        streams.discard(sys.stdout)
