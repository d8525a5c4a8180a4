"""Files that are there as a whole or not at all: written under another name, and then renamed."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """Yield another name in the folder of a file, with its ending, to be renamed in this block or removed after it."""
    beside = path.with_name(f".{uuid4().hex[:16]}.tmp{path.suffix}")
    try:
        yield beside
    finally:
        beside.unlink(missing_ok=True)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield the name under which to write a file, which is at its path after this block.

    What was there remains if the block fails. The permissions are those that a file has which is opened and written.
    What is not a file, such as a pipe, or cannot be replaced, is written itself.
    """
    target = Path(os.path.realpath(path))  # through a link, the file that it names
    there = target.exists()
    if (there and not (target.is_file() and os.access(target, os.W_OK))) or not os.access(target.parent, os.W_OK):
        yield path
        return
    with unfinished(target) as beside:
        yield beside
        if there:
            shutil.copymode(target, beside)
        os.replace(beside, target)
