"""The folder of compiled kernels: private, marked as used, and without those that nobody has used for long."""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import time
from pathlib import Path
from typing import IO

import structlog

_USED = "used"
UNUSED_SECONDS = 90 * 86400.0
"""A folder that no worker has been started with for this time is removed, unless one still runs."""


class CacheFolderError(RuntimeError):
    """The folder for compiled kernels belongs to another user or cannot be made private."""


def use_folder(root: Path) -> Path:
    """Make the cache folder private and have numba use it; call this before numba is imported.

    Raises
    ------
    CacheFolderError
        The folder is a link, or another user's, and its code would be executed.
    """
    folder = root / "kernels"
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise CacheFolderError(f"{folder} must be a folder of this user")
    folder.chmod(0o700)
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "numba")
    return folder


def mark_used(folder: Path) -> IO[bytes]:
    """Mark a folder as used until the returned file is closed, and remove those beside it that are not.

    A folder is removed when no process has it marked, and none has marked it for `UNUSED_SECONDS`. Nobody waits for a
    mark, and kernels of a folder that was removed are compiled again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    mark = (folder / _USED).open("ab")
    os.utime(mark.fileno())
    if not _locked(mark, fcntl.LOCK_SH):
        structlog.get_logger("grazemap_worker").info("kernels are removed by another process", folder=str(folder))
    for other in folder.parent.glob(f"kernels-*/{_USED}"):
        if other.parent == folder or time.time() - other.stat().st_mtime < UNUSED_SECONDS:
            continue
        with other.open("ab") as file:
            if _locked(file, fcntl.LOCK_EX):
                shutil.rmtree(other.parent, ignore_errors=True)
                structlog.get_logger("grazemap_worker").info("unused kernels removed", folder=str(other.parent))
    return mark


def _locked(file: IO[bytes], kind: int) -> bool:
    """Lock a file, unless that would have to wait; return whether it is locked."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
