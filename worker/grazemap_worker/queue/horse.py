"""A process of its own for tiles, which is watched: its memory, its processor time, and whether it goes on.

The operating system ends it when its worker ends.
"""

from __future__ import annotations

import mmap
import os
import resource
import select
import signal
import struct
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from grazemap_worker.liveness import HUNG_SECONDS, Liveness
from grazemap_worker.parent_death import die_with_parent
from grazemap_worker.store.records import FailureKind

# Below other processes, so that small questions are answered while maps are computed.
NICENESS = 10
_LOOK_SECONDS = 0.5
# Share of the memory limit from which on a process that was aborted counts as out of memory.
_NEAR_LIMIT = 0.7
# Bytes of the unit of a peak of memory: kilobytes, but on macOS.
_PEAK_UNIT = 1 if sys.platform == "darwin" else 1024
# Status of a process that its worker killed, and of one that could not store what it computed as the store is full.
_KILLED = -signal.SIGKILL
STORE_FULL = 3


def _nothing(_now: object) -> None:
    """Say that there is nothing to do."""


@dataclass(frozen=True)
class Ended:
    """How a process ended."""

    status: int
    """Its exit status."""
    kind: FailureKind | None = None
    """Why its job fails, if it was killed."""
    limit: str = ""
    """Which limit it exceeded; empty for none."""


class Now(NamedTuple):
    """What a process does."""

    job_id: str
    """The job that it does it for."""
    computing: bool
    """Whether it computes; otherwise it stores."""
    began: float
    """The processor time of the process when it began to compute."""
    seconds: float
    """The processor time that it may use from then on."""
    of_job: bool
    """Whether that is all that is left to the job."""


class Slate:
    """Memory in which a process writes what it does now, and its worker reads it."""

    _FORM = struct.Struct("64s?dd?")

    def __init__(self, now: Now) -> None:
        self._memory = mmap.mmap(-1, self._FORM.size)
        self.write(now)

    def write(self, now: Now) -> None:
        """Replace what is written."""
        self._FORM.pack_into(self._memory, 0, now.job_id.encode(), *now[1:])

    def read(self) -> Now:
        """Return what was written last; parts of it may be older while the process writes."""
        job_id, *others = self._FORM.unpack_from(self._memory)
        return Now(job_id.rstrip(b"\0").decode(), *others)


class Horse:
    """A forked process that runs a function and ends.

    Parameters
    ----------
    run : callable
        It writes to the slate what it does, and returns the exit status.
    memory_bytes : int
        What it may allocate beyond what it starts with.
    slate : Slate
        With what it does first.
    """

    def __init__(self, run: Callable[[], int], memory_bytes: int, slate: Slate) -> None:
        self._memory_bytes, self._slate = memory_bytes, slate
        parent = os.getpid()
        self._pid = os.fork()
        if self._pid == 0:
            status = 1
            try:
                die_with_parent(parent)
                os.setpgid(0, 0)
                for number in (signal.SIGTERM, signal.SIGINT):
                    signal.signal(number, signal.SIG_DFL)
                os.nice(NICENESS)
                limit_memory(memory_bytes)
                status = run()
            finally:
                os._exit(status)  # never return into the worker's code
        # in both processes, whichever comes first; its own children are stopped with it
        with suppress(OSError):
            os.setpgid(self._pid, self._pid)

    def watch(
        self, wanted: Callable[[str], bool], beside: Callable[[Now], Callable[[], None] | None] = _nothing
    ) -> Ended:
        """Wait for its end, and kill it when it exceeds a limit, hangs, or computes for a job that is not wanted.

        `wanted` is asked with the job, or with an empty text while the process stores. `beside` is asked what this
        worker is to do first, with what the process computes; the process is stopped meanwhile.

        An exception, such as a request to stop, kills it too.
        """
        descriptor = os.pidfd_open(self._pid) if hasattr(os, "pidfd_open") else None
        liveness, killed = Liveness(self._pid, with_children=True), Ended(0)
        ended = False
        try:
            while True:
                if descriptor is None:
                    time.sleep(0.01)
                else:
                    select.select([descriptor], [], [], _LOOK_SECONDS)
                pid, status, usage = os.wait4(self._pid, os.WNOHANG)
                if pid:
                    ended = True
                    return self._ended(status, usage, killed)
                if killed.status:
                    continue
                now = self._slate.read()
                hangs = liveness.hangs(computing=now.computing)
                if liveness.cpu_seconds > now.began + now.seconds:
                    verdict = Ended(_KILLED, "timeout", f"its limit is {now.seconds:.0f} s of processor time")
                elif hangs:
                    verdict = Ended(_KILLED, "hung", f"each time none for {HUNG_SECONDS:.0f} s")
                elif not wanted(now.job_id if now.computing else ""):
                    verdict = Ended(_KILLED)
                else:
                    if now.computing and (first := beside(now)) is not None:
                        self._stop_for(first)
                    continue
                if self._slate.read() == now:  # otherwise it has gone on since
                    os.kill(self._pid, signal.SIGKILL)
                    killed = verdict
        finally:
            if descriptor is not None:
                os.close(descriptor)
            if not ended:
                os.kill(self._pid, signal.SIGKILL)
                os.waitpid(self._pid, 0)

    def _stop_for(self, first: Callable[[], None]) -> None:
        os.killpg(self._pid, signal.SIGSTOP)
        try:
            first()
        finally:
            os.killpg(self._pid, signal.SIGCONT)

    def _ended(self, status: int, usage: resource.struct_rusage, killed: Ended) -> Ended:
        if killed.status:
            return killed
        code = os.waitstatus_to_exitcode(status)
        # LLVM and others abort where they get no memory
        if code in (-signal.SIGABRT, -signal.SIGSEGV, -signal.SIGBUS) and (
            usage.ru_maxrss * _PEAK_UNIT > _NEAR_LIMIT * self._memory_bytes
        ):
            return Ended(code, "memory", memory_text(self._memory_bytes))
        return Ended(code, "lost" if code < 0 or code == 1 else None)


def limit_memory(more_bytes: int) -> None:
    """Limit what this process may allocate beyond what it has now (RLIMIT_DATA; Linux)."""
    try:
        lines = Path("/proc/self/status").read_text("ascii").splitlines()
    except OSError:
        return
    now = next(int(line.split()[1]) for line in lines if line.startswith("VmData:")) * 1024
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    limit = now + more_bytes if hard == resource.RLIM_INFINITY else min(now + more_bytes, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))


def memory_text(limit: int) -> str:
    """Return the limit of memory for people."""
    return f"its limit is {limit >> 20} MiB"
