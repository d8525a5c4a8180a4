"""Compiling the kernels once, before the first fork, with a disk cache that may be broken.

The cache holds code that is executed, and reading an incomplete file raises an error or crashes. So the folder is
private, and one process at a time warms up and leaves a mark in it meanwhile. After an error, or two warm-ups in a row
that did not end, the cache is removed and compiled again.
"""

from __future__ import annotations

import fcntl
import multiprocessing
import os
import shutil
import stat
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import TextIO

import structlog

from grazemap_worker.parent_death import die_with_parent
from grazemap_worker.progress import Progress
from grazemap_worker.settings import available_cores

# One character for every warm-up in a row that did not end. A single one may have been stopped by a user.
_MARK = "warming-up"
_MOST_UNFINISHED = 2
_LOOK_SECONDS = 0.5

SECONDS = {"grazing": 8.0, "trajectories": 11.5, "orbits": 7.5, "maps": 36.0}
"""The parts of the core's warm-up, and the seconds that one core of a server took to compile each."""
_LONGEST = ["maps"]
LOADING_SECONDS = 3.0
"""The seconds in which one core of a server loaded all kernels from the cache, imports included."""


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


class WarmUp:
    """The progress of a warm-up, shared with the process that helps to compile."""

    def __init__(self) -> None:
        self._expected = 0.0
        self._began = time.monotonic()
        self._awaited: Path | None = None

    def lock(self, lock: TextIO) -> None:
        """Take a lock, and write this process's id into its file for those who wait for it."""
        if not _locked(lock):
            self._awaited = Path(lock.name)
            while not _locked(lock):  # looked at again and again, so that this process is seen to go on
                time.sleep(_LOOK_SECONDS)
            self._awaited = None
            self._began = time.monotonic()
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()

    def begin(self, parts: Sequence[str]) -> None:
        """Begin to compile; `parts` are those that one process compiles one after another, and that take longest."""
        # made only here, as shared values start a process that tracks them
        context = multiprocessing.get_context("spawn")
        self._finished = context.Value("i", 0)
        self._slower = context.Value("d", 1.0)
        self._began = time.monotonic()
        self._expected = sum(SECONDS[part] for part in parts)

    def finish(self, parts: Sequence[str]) -> None:
        """Count a part as compiled; `parts` are all that its process has compiled since the beginning."""
        self._finished.value += 1
        self._slower.value = (time.monotonic() - self._began) / sum(SECONDS[part] for part in parts)

    def text(self) -> str:
        """Return what is being done, for people who wait."""
        if awaited := self._awaited:
            holder = awaited.read_text("ascii") or "unknown"  # for an instant after it was taken
            return f"waiting for another stack, process {holder}, that compiles the kernels"
        if not self._expected:
            took = time.monotonic() - self._began
            left = LOADING_SECONDS - took
            return f"loading the kernels, {f'about {left:.0f} s' if left >= 1.0 else f'for {took:.0f} s so far'}"
        left = self._expected * self._slower.value - (time.monotonic() - self._began)
        step = min(self._finished.value + 1, len(SECONDS))
        return f"compiling kernels, step {step} of {len(SECONDS)}, about {max(1.0, left):.0f} s"


def compile_kernels(folder: Path, progress: WarmUp) -> None:
    """Compile or load every kernel of the core; where none is cached yet, two processes share the work."""
    from grazemap_core.warmup import warm_up as run

    if not any((folder / "numba").rglob("*.nbi")):
        if available_cores() > 1:
            progress.begin(_LONGEST)
            helper = [part for part in SECONDS if part not in _LONGEST]
            context = multiprocessing.get_context("spawn")
            other = context.Process(target=_help, args=(helper, progress, os.getpid()), daemon=True)
            other.start()
            _compile(_LONGEST, progress)
            _join(other)
        else:
            progress.begin(list(SECONDS))
            _compile(list(SECONDS), progress)
    run()


def _help(parts: Sequence[str], progress: WarmUp, parent: int) -> None:
    """Compile some parts in a process that ends with its parent."""
    die_with_parent(parent)
    _compile(parts, progress)


def _join(other: BaseProcess) -> None:
    """Wait for the end of a process that compiles; kill it if it hangs, as what it leaves is compiled here."""
    progress = Progress(other.pid or 0)
    while other.exitcode is None:
        other.join(_LOOK_SECONDS)
        if progress.hangs(computing=True):
            other.kill()


def _locked(lock: TextIO) -> bool:
    """Take a lock unless another process has it; return whether it is taken."""
    with suppress(BlockingIOError):
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return True
    return False


def _compile(parts: Sequence[str], progress: WarmUp) -> None:
    """Compile some parts."""
    from grazemap_core.warmup import warm_up as run

    for count, part in enumerate(parts, 1):
        run(part)
        progress.finish(parts[:count])


def warm_up(folder: Path, compile_kernels: Callable[[], object], progress: WarmUp) -> None:
    """Run `compile_kernels` under the folder's lock; wipe the cache and run it again when the cache is broken.

    Raises
    ------
    Exception
        Raised by `compile_kernels` with an empty cache too, so it is an error of the kernels.
    """
    log = structlog.get_logger("grazemap_worker")
    mark, cached = folder / _MARK, folder / "numba"
    # not "w", which would remove the id of the process that holds it
    with (folder / "lock").open("a", encoding="ascii") as lock:
        progress.lock(lock)
        unfinished = mark.stat().st_size if mark.exists() else 0
        if unfinished >= _MOST_UNFINISHED:
            log.warning("kernel cache wiped", reason=f"{unfinished} warm-ups in a row did not end")
            shutil.rmtree(cached, ignore_errors=True)
        with mark.open("a", encoding="ascii") as stream:
            stream.write("x")
        try:
            compile_kernels()
        except Exception:
            if not any(cached.rglob("*.nbi")):
                raise
            log.warning("kernel cache wiped", reason="a kernel could not be loaded", exc_info=True)
            shutil.rmtree(cached, ignore_errors=True)
            compile_kernels()
        finally:
            mark.unlink()
