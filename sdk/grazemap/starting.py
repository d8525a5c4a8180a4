"""What a stack says while it starts, shown to those who wait."""

from __future__ import annotations

import json
import sys
import time
from html import escape
from typing import IO, Any, Protocol, TextIO

from grazemap.client.progress import NotebookDisplay, in_notebook

# A longer line would continue on the next one, and only that would be overwritten.
_COLUMNS = 79
QUICK_SECONDS = 3.0
"""A start that takes no longer is not in a log."""


class Shown(Protocol):
    """A place that shows what a stack says."""

    def show(self, text: str) -> None:
        """Show a text."""

    def close(self, ready: bool) -> None:
        """Leave the place as it should remain; `ready` says whether the stack has started."""


def shown_here(quiet: bool = False) -> Shown:
    """Return the place where this process shows the start of its own stack; a `quiet` one has no log."""
    if in_notebook():
        return StartNotebook()
    return StartLine(sys.stderr) if sys.stderr.isatty() else StartLog(sys.stderr, quiet)


def ready_line(stream: IO[bytes], shown: Shown | None = None) -> bytes:
    """Read what a stack prints until it is ready; return the line with its address, b"" at the end of the stream."""
    for line in stream:
        try:
            said: Any = json.loads(line)
            text = said["starting"]
        except (ValueError, LookupError, TypeError):
            return line
        if shown is not None:
            shown.show(str(text))
    return b""


class StartLine:
    """One line of a terminal that is overwritten; elsewhere a line for each text."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._open = False

    def show(self, text: str) -> None:
        """As `Shown.show`."""
        line = f"grazemap: {text}"
        self._stream.write(f"\r{line[:_COLUMNS]:<{_COLUMNS}}" if self._terminal else f"{line}\n")
        self._stream.flush()
        self._open = self._terminal

    def close(self, ready: bool) -> None:
        """Remove the line from the terminal."""
        if self._open:
            self._stream.write(f"\r{'':<{_COLUMNS}}\r")
            self._stream.flush()
            self._open = False


class StartLog:
    """A line for each step of a start that is not quick, and one at its end."""

    def __init__(self, stream: TextIO, quiet: bool = False) -> None:
        self._stream, self._quiet = stream, quiet
        self._began = time.monotonic()
        self._step = ""

    def show(self, text: str) -> None:
        """Write the text of a new step that says more after a comma, such as the seconds that are left."""
        step, _, more = text.partition(",")
        if self._quiet or not more or step == self._step or time.monotonic() - self._began < QUICK_SECONDS:
            return
        self._step = step
        self._write(text)

    def close(self, ready: bool) -> None:
        """Write how long the start took, if anything was written of it."""
        if ready and self._step:
            self._write(f"ready after {time.monotonic() - self._began:.0f} s")

    def _write(self, text: str) -> None:
        self._stream.write(f"grazemap: {text}\n")
        self._stream.flush()


class StartNotebook(NotebookDisplay):
    """A line below a notebook's cell."""

    def show(self, text: str) -> None:
        """As `Shown.show`."""
        self.update(escape(f"grazemap: {text}"))

    def close(self, ready: bool) -> None:
        """Remove the line."""
        self.update("")
