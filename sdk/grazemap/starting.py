"""What a stack says while it starts, shown to those who wait."""

from __future__ import annotations

import json
from typing import IO, Any, TextIO

# A longer line would continue on the next one, and only that would be overwritten.
_COLUMNS = 79


def ready_line(stream: IO[bytes], shown: StartLine | None = None) -> bytes:
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
    """One line of a terminal that is overwritten; elsewhere a line for each text, unless it is `quiet` there."""

    def __init__(self, stream: TextIO, quiet: bool = False) -> None:
        self._stream = stream
        self._terminal = stream.isatty()
        self._silent = quiet and not self._terminal
        self._open = False

    def show(self, text: str) -> None:
        """Show a text."""
        if self._silent:
            return
        line = f"grazemap: {text}"
        self._stream.write(f"\r{line[:_COLUMNS]:<{_COLUMNS}}" if self._terminal else f"{line}\n")
        self._stream.flush()
        self._open = self._terminal

    def close(self) -> None:
        """Remove the line from the terminal."""
        if self._open:
            self._stream.write(f"\r{'':<{_COLUMNS}}\r")
            self._stream.flush()
            self._open = False
