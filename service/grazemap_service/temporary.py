"""Temporary folders that are removed after use, even if their process was killed.

A temporary folder contains a lock file, which its process keeps locked. `remove_abandoned`, at a later start, removes
folders whose lock file is not locked. It never removes a folder without a lock file, whatever the name of the folder.
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
# A younger folder is not removed, because its process may be about to lock it.
YOUNG_SECONDS = 60.0


class TemporaryFolder:
    """A private folder. `close` removes it; if the process is killed first, `remove_abandoned` does at a later start.

    Parameters
    ----------
    purpose : str
        Part of the name of the folder.
    max_path_bytes : int, optional
        Maximum bytes of the path. If the path in the usual place is longer, the folder is created in /tmp.
    """

    def __init__(self, purpose: str = "", max_path_bytes: int | None = None) -> None:
        name = f"{PREFIX}{purpose}-" if purpose else PREFIX
        path = tempfile.mkdtemp(prefix=name)
        if max_path_bytes is not None and len(os.fsencode(path)) > max_path_bytes:
            os.rmdir(path)
            path = tempfile.mkdtemp(prefix=name, dir="/tmp")
        self.path = Path(path)
        self._lock = (self.path / LOCK).open("w")
        fcntl.flock(self._lock, fcntl.LOCK_EX)

    def fileno(self) -> int:
        """Return the descriptor of the lock; the folder is in use as long as a child that inherits it lives."""
        return self._lock.fileno()

    def close(self) -> None:
        """Remove the folder."""
        with contextlib.suppress(OSError):
            _remove(self.path)
        self._lock.close()


def _remove(folder: Path) -> None:
    """Remove a folder, its lock file last: if anything else stays, a later start removes it."""
    for entry in folder.iterdir():
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        elif entry.name != LOCK:
            with contextlib.suppress(OSError):
                entry.unlink()
    if all(entry.name == LOCK for entry in folder.iterdir()):
        shutil.rmtree(folder)


def remove_abandoned() -> None:
    """Remove this user's temporary folders that are not in use."""
    for base in {tempfile.gettempdir(), "/tmp"}:
        for folder in Path(base).glob(f"{PREFIX}*"):
            with contextlib.suppress(OSError):  # in use, without a lock file, or being removed by another process
                _remove_if_abandoned(folder)


def _remove_if_abandoned(folder: Path) -> None:
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
        return
    if time.time() - status.st_mtime < YOUNG_SECONDS:
        return
    descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_NOFOLLOW)
    with os.fdopen(descriptor) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        _remove(folder)
