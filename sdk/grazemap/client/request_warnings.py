"""Warnings for the notes on a request, at the line of the caller."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from grazemap.errors import RequestWarning
from grazemap.wire import Note

# Codes of notes without a warning. Maps below the grazing curve are common: the motions with impacts are there. A job
# that waits for the compilation of kernels only takes longer. The result says what a forcing period is.
_QUIET = frozenset({"below-grazing-curve", "compiles-first", "forcing-period"})
_PACKAGE = str(Path(__file__).parents[1])


def warn_about(notes: Sequence[Note]) -> None:
    """Issue a RequestWarning for each note that is not quiet, at the line that called this package."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    for note in notes:
        if note.code in _QUIET:
            continue
        warnings.warn(RequestWarning(note.detail, note.code), stacklevel=level)
