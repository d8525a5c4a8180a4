"""The exit codes of commands, and their error messages on stderr."""

from __future__ import annotations

import sys

DONE, FAILED, INVALID, NOT_FOUND, INTERRUPTED = 0, 1, 2, 3, 130


class InvalidCommand(Exception):
    """The arguments of a command are not valid."""


def fail(error: Exception | str, code: int) -> int:
    """Print an error on stderr and return the exit code."""
    print(f"grazemap: {error}", file=sys.stderr)
    return code
