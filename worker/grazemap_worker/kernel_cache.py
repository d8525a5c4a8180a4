"""Compiling the kernels once, before the first fork, with a disk cache that may be broken.

A process that is killed while numba writes its cache leaves files that raise, or crash, when they are read. So the
folder is private, one process at a time warms up, a mark lies in it meanwhile, and a cache that raises or was left
with its mark is wiped and compiled again.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

import structlog

_MARK = "warming-up"


class CacheFolderError(RuntimeError):
    """The folder for compiled kernels belongs to somebody else or cannot be made private."""


def use_folder(root: Path) -> Path:
    """Make the cache folder private and have numba use it; call this before numba is imported.

    Raises
    ------
    CacheFolderError
        The folder is a link, or another user's: what lies in it would be executed.
    """
    folder = root / "kernels"
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise CacheFolderError(f"{folder} must be a folder of this user")
    folder.chmod(0o700)
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "numba")
    return folder


def warm_up(folder: Path, compile_kernels: Callable[[], object]) -> None:
    """Run `compile_kernels` under the folder's lock; wipe the cache and run it again when the cache is broken.

    Raises
    ------
    Exception
        What `compile_kernels` raises with an empty cache too: then the kernels are at fault, not the cache.
    """
    log = structlog.get_logger("grazemap_worker")
    mark, cached = folder / _MARK, folder / "numba"
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if mark.exists():
            log.warning("kernel cache wiped", reason="an earlier warm-up did not end")
            shutil.rmtree(cached, ignore_errors=True)
        mark.touch()
        try:
            compile_kernels()
        except Exception:
            if not any(cached.rglob("*.nbi")):
                raise
            log.warning("kernel cache wiped", reason="a kernel could not be loaded", exc_info=True)
            shutil.rmtree(cached, ignore_errors=True)
            compile_kernels()
        mark.unlink()
