"""The folder of compiled kernels: made private, marked as used, and cleared of kernels that were not used for long."""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

import structlog

from grazemap_worker.environment import CHOOSE_CACHE_DIR

_USED = "used"
UNUSED_SECONDS = 90 * 86400.0
"""A folder of kernels is removed when no worker was started with it for this time, and none with it still runs."""


class CacheFolderError(RuntimeError):
    """The folder for compiled kernels belongs to another user or cannot be made private."""


def private_folder(root: Path) -> Path:
    """Return the folder for compiled kernels below a cache folder; make it, and make it private.

    Raises
    ------
    CacheFolderError
        The folder cannot be made, or is a link, or belongs to another user, who could place code in it.
    """
    folder = root / "kernels"
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        status = folder.lstat()
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.getuid():
            raise CacheFolderError(f"{folder} must be a folder of this user; {CHOOSE_CACHE_DIR}")
        folder.chmod(0o700)
    except OSError as error:
        raise CacheFolderError(f"no folder for compiled kernels: {error}; {CHOOSE_CACHE_DIR}") from error
    return folder / "numba"


@contextmanager
def one_compiles(folder: Path) -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether this process may compile: that no other one may, until its block ends.

    On a file system without locks every process may.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "compiling").open("ab") as file:
        yield lambda: _locked(file, fcntl.LOCK_EX)


def mark_used(folder: Path) -> IO[bytes]:
    """Mark a folder of kernels as used until the returned file is closed, and remove unused folders beside it.

    A folder is unused when no process marks it now, and none has done so for `UNUSED_SECONDS`. No process waits for a
    mark. Kernels of a folder that was removed are compiled again.
    """
    folder.mkdir(parents=True, exist_ok=True)
    mark = (folder / _USED).open("ab")
    os.utime(mark.fileno())
    if not _locked(mark, fcntl.LOCK_SH):
        structlog.get_logger("grazemap_worker").info("kernels are removed by another process", folder=str(folder))
    for used_file in folder.parent.glob(f"kernels-*/{_USED}"):
        with suppress(FileNotFoundError):  # another process removes the same folder
            if used_file.parent == folder or time.time() - used_file.stat().st_mtime < UNUSED_SECONDS:
                continue
            with used_file.open("ab") as file:
                if _locked(file, fcntl.LOCK_EX, otherwise=False):
                    shutil.rmtree(used_file.parent, ignore_errors=True)
                    structlog.get_logger("grazemap_worker").info("unused kernels removed", folder=str(used_file.parent))
    return mark


def _locked(file: IO[bytes], kind: int, otherwise: bool = True) -> bool:
    """Lock a file without waiting; return whether that succeeded, or `otherwise` on a file system without locks."""
    try:
        fcntl.flock(file, kind | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return otherwise
    return True
