"""What only Linux offers to processes, and what happens in its place on another system.

Elsewhere psutil tells what processes do, and a process looks now and then whether its parent has ended; the memory of a
tile is not limited (`not_kept`). GRAZEMAP_SYSTEM=portable has Linux treated as another system, for tests.
"""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

LINUX = sys.platform == "linux" and os.environ.get("GRAZEMAP_SYSTEM") != "portable"
if not LINUX:
    import psutil
_PROC = Path("/proc")
_CONTROL_GROUPS = Path("/sys/fs/cgroup")
# The parent of this process, as `die_with_parent` knows it.
_parent = os.getppid()
_TICK = 1.0 / os.sysconf("SC_CLK_TCK")
_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
_MADV_DONTNEED = 4
# A process that uses a smaller share of its time rests. Memory is released after so many seconds of rest, if the
# process has used more processor time than this since the last release.
_BUSY_SHARE, _REST_SECONDS, _WORK_SECONDS = 0.05, 15.0, 0.5
_LIBC = ctypes.CDLL(None, use_errno=True)
# Looked up before any fork: between fork and exec nothing may be imported.
_PRCTL = _LIBC.prctl if LINUX else None
# Factor from ru_maxrss to bytes: ru_maxrss is in kilobytes, on macOS in bytes.
PEAK_UNIT = 1 if sys.platform == "darwin" else 1024


def not_kept() -> list[str]:
    """Return a phrase for each limit that cannot be kept on this system."""
    if LINUX:
        return []
    return [
        "processes outlive a killed parent for some seconds, and a Redis for good",
        "the memory of a tile is not limited",
    ]


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if LINUX else os.cpu_count() or 1


def die_with_parent(parent: int, signal_number: int = signal.SIGKILL) -> None:
    """Ask the kernel to send this process a signal when its parent ends; end at once when it has ended already.

    The signal comes when the *thread* ends that has made this process: children are made by threads that live long.

    Parameters
    ----------
    parent : int
        Process id of the parent, taken before the fork, so that a parent that died in between is noticed.
    signal_number : int
        What is sent.

    Raises
    ------
    OSError
        The kernel refused. On other systems than Linux nothing is done but for `orphaned`.
    """
    global _parent
    _parent = parent
    if _PRCTL is None:
        return
    if _PRCTL(_PR_SET_PDEATHSIG, int(signal_number), 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG)")
    if os.getppid() != parent:
        os.kill(os.getpid(), signal_number)


def orphaned() -> bool:
    """Return whether the parent of this process has ended and the kernel does not end this process then."""
    return not LINUX and os.getppid() != _parent


def tied(signal_number: int = signal.SIGKILL) -> Callable[[], None]:
    """Return a `preexec_fn` for subprocess.Popen that ties the child to this process."""
    parent = os.getpid()
    return lambda: die_with_parent(parent, signal_number)


def adopt_orphans() -> None:
    """Make this process the parent of its children's orphans, so that it can wait for them and none remains a zombie.

    Linux only; on other systems init adopts the orphans.

    Raises
    ------
    OSError
        The kernel refused.
    """
    if _PRCTL is not None and _PRCTL(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")


class ProcessStat(NamedTuple):
    """The state and the processor time of a process, from the operating system."""

    state: str
    """The letter of its state, as in /proc; elsewhere T if it is stopped, and else S."""
    cpu_seconds: float
    """Its processor time."""


def process_stat(pid: int) -> ProcessStat | None:
    """Return state and processor time of a process; None if it does not exist."""
    if not LINUX:
        with suppress(psutil.Error):
            process = psutil.Process(pid)
            return ProcessStat("T" if process.status() == psutil.STATUS_STOPPED else "S", sum(process.cpu_times()[:2]))
        return None
    try:
        # the name, in brackets, may have spaces
        fields = (_PROC / str(pid) / "stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return ProcessStat(fields[0].decode(), (int(fields[11]) + int(fields[12])) * _TICK)


def children_seconds(pid: int) -> float:
    """Return the processor time of the living children of a process's main thread."""
    children: list[int] = []
    if not LINUX:
        with suppress(psutil.Error):
            children = [child.pid for child in psutil.Process(pid).children()]
    else:
        with suppress(OSError):
            text = (_PROC / str(pid) / "task" / str(pid) / "children").read_text("ascii")
            children = list(map(int, text.split()))
    return sum(child.cpu_seconds for child in map(process_stat, children) if child is not None)


def release_memory() -> None:
    """Give back what this process does not need for now: garbage, free memory, and clean pages of files (Linux).

    A page of a library comes back from the system's cache of files when it is used again.
    """
    gc.collect()
    if not LINUX:
        return
    _LIBC.malloc_trim(0)
    with suppress(OSError):
        for begin, end in _clean_mappings((_PROC / "self" / "smaps").read_text("utf-8", "replace")):
            _LIBC.madvise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _MADV_DONTNEED)


class IdleMemory:
    """Releases the memory of this process once it has rested for a while after some work."""

    def __init__(self) -> None:
        self._looked = self._rests_from = time.monotonic()
        self._spent = self._released = 0.0

    def look(self) -> None:
        """Release the memory if it is time; to be called every few seconds."""
        spent, now = time.process_time(), time.monotonic()
        if spent - self._spent > _BUSY_SHARE * (now - self._looked):
            self._rests_from = now
        self._spent, self._looked = spent, now
        if now - self._rests_from > _REST_SECONDS and spent - self._released > _WORK_SECONDS:
            release_memory()
            self._released = time.process_time()


def _clean_mappings(smaps: str) -> Iterator[tuple[int, int]]:
    """Yield begin and end of the private mappings of files whose pages are those of the file, and cannot be written."""
    place, clean = None, False
    for line in smaps.splitlines():
        fields = line.split()
        if not fields[0].endswith(":"):
            begin, _, end = fields[0].partition("-")
            clean = len(fields) > 5 and fields[5].startswith("/") and fields[1][1] == "-" and fields[1][3] == "p"
            place = int(begin, 16), int(end, 16)
        elif fields[0] == "Anonymous:" and clean and place is not None and fields[1] == "0":
            yield place


def process_descriptor(pid: int) -> int | None:
    """Return a descriptor that can be read once a process has ended, to be closed; None where there is none."""
    return os.pidfd_open(pid) if LINUX and hasattr(os, "pidfd_open") else None


def thread_seconds(thread: int) -> float:
    """Return the processor time of a thread, or of this process where threads have no clock."""
    clock = time.pthread_getcpuclockid(thread) if LINUX else time.CLOCK_PROCESS_CPUTIME_ID
    return time.clock_gettime(clock)


def limit_memory(more_bytes: int) -> None:
    """Limit the bytes that this process may allocate in addition to those that it has now (RLIMIT_DATA; Linux)."""
    if not LINUX:
        return
    try:
        lines = (_PROC / "self" / "status").read_text("ascii").splitlines()
    except OSError:
        return
    used = next(int(line.split()[1]) for line in lines if line.startswith("VmData:")) * 1024
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limit = used + more_bytes if hard == resource.RLIM_INFINITY else min(used + more_bytes, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


def machine_memory(proc: Path = _PROC, control_groups: Path = _CONTROL_GROUPS) -> int | None:
    """Return the bytes of memory that the processes of this control group may use together; None: not known."""
    if not LINUX:
        return int(psutil.virtual_memory().total)
    limits = [*_installed_bytes(proc / "meminfo"), *_group_limits(proc / "self" / "cgroup", control_groups)]
    return min(limits, default=None)


def _installed_bytes(meminfo: Path) -> Iterator[int]:
    for line in _lines(meminfo):
        name, _, value = line.partition(":")
        if name == "MemTotal":
            yield int(value.split()[0]) * 1024


def _group_limits(cgroup: Path, mounted: Path) -> Iterator[int]:
    """Yield the limits of a process's control groups and of the groups that contain them."""
    for line in _lines(cgroup):
        _, controllers, path = line.split(":", 2)
        if controllers == "":  # version 2
            folder, name = mounted, "memory.max"
        elif "memory" in controllers.split(","):
            folder, name = mounted / "memory", "memory.limit_in_bytes"
        else:
            continue
        # in a container the path may be that of the host, and only the root of it is mounted
        group = folder / path.lstrip("/")
        for ancestor in (group, *group.parents):
            for text in _lines(ancestor / name):
                if text.strip().isdigit():  # or "max"
                    yield int(text)
            if ancestor == folder:
                break


def _lines(path: Path) -> list[str]:
    with suppress(OSError, UnicodeDecodeError):
        return path.read_text("ascii").splitlines()
    return []
