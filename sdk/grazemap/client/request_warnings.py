"""The notes on a request as warnings at the line of the caller."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from grazemap.errors import RequestWarning
from grazemap.wire import Note

# What is below the grazing curve are the motions with impacts, which most maps of a part are about. A request whose
# kernels are compiled first is meant, and only takes longer. What a period is, a result says.
_QUIET = frozenset({"below-grazing-curve", "compiles-first", "forcing-period"})
_PACKAGE = str(Path(__file__).parents[1])


def warn_of(notes: Sequence[Note]) -> None:
    """Issue a RequestWarning for each note but the quiet ones, at the line outside of this package that led here."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    for note in notes:
        if note.code in _QUIET:
            continue
        warnings.warn(RequestWarning(note.detail, note.code), stacklevel=level)
