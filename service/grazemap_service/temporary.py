"""Temporary folders that are removed after use, even if their process was killed.

Each holds a file that its process keeps locked; the next start removes the folders whose lock is free. Other
folders are never touched, whatever their name.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import stat
import tempfile
import time
from pathlib import Path

PREFIX = "grazemap-"
LOCK = "in-use"
# A younger folder may have been made by a process that is about to lock it.
YOUNG_SECONDS = 60.0


class TemporaryFolder:
    """A private folder, removed by `close`, or by `remove_abandoned` once this process and its children have ended.

    Parameters
    ----------
    purpose : str
        A part of its name.
    longest : int, optional
        Maximum bytes of the path; a folder with a longer one is made in /tmp instead.
    """

    def __init__(self, purpose: str = "", longest: int | None = None) -> None:
        name = f"{PREFIX}{purpose}-" if purpose else PREFIX
        path = tempfile.mkdtemp(prefix=name)
        if longest is not None and len(os.fsencode(path)) > longest:
            os.rmdir(path)
            path = tempfile.mkdtemp(prefix=name, dir="/tmp")
        self.path = Path(path)
        self._lock = (self.path / LOCK).open("w")
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def fileno(self) -> int:
        """Return the descriptor of the lock; a child that inherits it keeps the folder alive."""
        return self._lock.fileno()

    def close(self) -> None:
        """Remove the folder."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._lock.close()


def remove_abandoned() -> None:
    """Remove this user's temporary folders that are not in use."""
    for base in {tempfile.gettempdir(), "/tmp"}:
        for folder in Path(base).glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):  # another process removes it, or it is another user's
                _remove_if_abandoned(folder)


def _remove_if_abandoned(folder: Path) -> None:
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or time.time() - found.st_mtime < YOUNG_SECONDS:
        return
    descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_NOFOLLOW)
    with os.fdopen(descriptor) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder)
