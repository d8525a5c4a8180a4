"""Writing to streams whose reader may be gone, as at the other end of a pipe."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import TextIO


def write(stream: TextIO, text: str) -> None:
    """Write a message, which is lost where it cannot be written: no work ends for that."""
    with suppress(OSError):
        stream.write(text)
    flush(stream)


def flush(stream: TextIO) -> None:
    """Write what is in the buffer; without a reader it is lost, and so is what follows."""
    try:
        stream.flush()
    except BrokenPipeError:
        discard(stream)
    except OSError:  # the disk of a log may be full for now
        return


def discard(stream: TextIO) -> None:
    """Let a stream write to nowhere from now on. Otherwise Python fails at its end, for what is in the buffer."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, stream.fileno())
    os.close(null)
