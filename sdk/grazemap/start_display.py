"""Displays of what a stack reports while it starts: on a terminal, in a log, or below a notebook's cell."""

from __future__ import annotations

import json
import sys
import time
from html import escape
from typing import IO, Any, Protocol, TextIO

from grazemap import streams
from grazemap.notebook import NotebookDisplay, runs_in_notebook

# Maximum width of a line. A longer one would be broken by the terminal, and only its end would be overwritten.
_COLUMNS = 79
QUICK_SECONDS = 3.0
"""Seconds; a start that takes no longer is not logged."""


class StartDisplay(Protocol):
    """Shows what a stack reports while it starts."""

    def show(self, text: str) -> None:
        """Show what the start waits for."""

    def close(self, ready: bool) -> None:
        """End the display; `ready` says whether the stack has started."""


def start_display(quiet: bool = False) -> StartDisplay:
    """Return the display for the output of this process; with `quiet` nothing is logged."""
    if runs_in_notebook():
        return StartNotebook()
    return StartLine(sys.stderr) if sys.stderr.isatty() else StartLog(sys.stderr, quiet)


def ready_line(stream: IO[bytes], shown: StartDisplay | None = None) -> bytes:
    """Read the output of a stack until it is ready. Return the line with its address, or b"" where the output ends."""
    for line in stream:
        try:
            message: Any = json.loads(line)
            text = message["starting"]
        except (ValueError, LookupError, TypeError):
            return line
        if shown is not None:
            shown.show(str(text))
    return b""


def _step_and_details(text: str) -> tuple[str, str]:
    """Return the step of a start, and its details after a comma, such as the seconds that are left."""
    step, _, details = text.partition(",")
    return step, details


class StartLine:
    """One line on a terminal, which is overwritten; on other streams a line for each step."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._open = False
        self._steps: set[str] = set()

    def show(self, text: str) -> None:
        """Write a text over the previous one; on other streams than a terminal only that of a new step."""
        step, _ = _step_and_details(text)
        if step in self._steps and not self._terminal:
            return
        self._steps.add(step)
        line = f"grazemap: {text}"
        streams.write(self._stream, f"\r{line[:_COLUMNS]:<{_COLUMNS}}" if self._terminal else f"{line}\n")
        self._open = self._terminal

    def close(self, ready: bool) -> None:
        """Remove the line from the terminal."""
        if self._open:
            streams.write(self._stream, f"\r{'':<{_COLUMNS}}\r")
            self._open = False


class StartLog:
    """A line for each step of a start that is not quick, and one at its end."""

    def __init__(self, stream: TextIO, quiet: bool = False) -> None:
        self._stream, self._quiet = stream, quiet
        self._began = time.monotonic()
        self._step = ""

    def show(self, text: str) -> None:
        """Write the text of a new step, unless it has no details."""
        step, details = _step_and_details(text)
        if self._quiet or not details or step == self._step or time.monotonic() - self._began < QUICK_SECONDS:
            return
        self._step = step
        self._write(text)

    def close(self, ready: bool) -> None:
        """Write how long the start took, if anything was written of it."""
        if ready and self._step:
            self._write(f"ready after {time.monotonic() - self._began:.0f} s")

    def _write(self, text: str) -> None:
        streams.write(self._stream, f"grazemap: {text}\n")


class StartNotebook(NotebookDisplay):
    """A line below a notebook's cell."""

    def show(self, text: str) -> None:
        """Show a text in place of the previous one."""
        self.update(escape(f"grazemap: {text}"))

    def close(self, ready: bool) -> None:
        """Remove the line."""
        self.update("")
