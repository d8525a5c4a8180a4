"""The compute process: a process that a worker forks to compute tiles, with limits that the worker watches.

The limits are on its memory, its processor time, and the time without progress. The operating system ends the compute
process when its worker ends.
"""

from __future__ import annotations

import mmap
import os
import resource
import select
import signal
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import structlog

from grazemap_worker.liveness import HUNG_SECONDS, Liveness
from grazemap_worker.store.records import FailureKind
from grazemap_worker.system import PEAK_UNIT, die_with_parent, limit_memory, process_descriptor

# A lower priority than that of other processes, so that small jobs get processor time while maps are being computed.
NICENESS = 10
# Seconds between two looks at the process, and for more urgent work.
_LOOK_SECONDS = 0.25
# Seconds after which the end of the process is noticed on a system without descriptors of processes (pidfd_open).
_POLL_SECONDS = 0.01
# A process that aborted counts as out of memory if its peak of resident memory was over this share of its memory limit.
# The peak includes what the process inherited when it was forked.
_NEAR_LIMIT = 0.7
_KILLED = -signal.SIGKILL  # exit status of a process that its worker killed
STORE_FULL_STATUS = 3  # exit status of a process that found the store full


@dataclass(frozen=True)
class ProcessEnd:
    """How a compute process ended."""

    status: int
    """Its exit status."""
    kind: FailureKind | None = None
    """Why its attempt counts as failed; None if it does not."""
    limit: str = ""
    """A phrase about the limit that it exceeded, such as "each time for 10 s"; empty if it exceeded none.
    `failure_problem` makes a sentence of it: "The computation made no progress in 3 attempts, each time for 10 s; ..."
    """


class Activity(NamedTuple):
    """What a compute process does at a moment, and its limit of processor time."""

    job_id: str
    """The job of the tile."""
    computing: bool
    """Whether the process computes the tile; otherwise it stores it."""
    processor_time_at_begin: float
    """Processor time of the process, in seconds, when it began to compute the tile."""
    max_seconds: float
    """Maximum processor time for the tile."""
    limited_by_job: bool
    """Whether `max_seconds` is the time that the job has left, because that is less than the limit of a tile."""


class SharedState:
    """Memory that a compute process and its worker share: the process writes its activity, the worker reads it."""

    _FORM = struct.Struct("64s?dd?")

    def __init__(self, activity: Activity) -> None:
        self._memory = mmap.mmap(-1, self._FORM.size)
        self.write(activity)

    def write(self, activity: Activity) -> None:
        """Replace the activity."""
        self._FORM.pack_into(self._memory, 0, activity.job_id.encode(), *activity[1:])

    def read(self) -> Activity:
        """Return the activity. During a write, the fields may be partly those of the previous activity."""
        job_id, *numbers = self._FORM.unpack_from(self._memory)
        return Activity(job_id.rstrip(b"\0").decode(), *numbers)


class ComputeProcess:
    """A forked process that runs a function and ends.

    Parameters
    ----------
    run : callable
        Writes its activity to the shared state, and returns the exit status.
    memory_bytes : int
        Bytes that the process may allocate beyond those that it starts with.
    state : SharedState
        The shared state; it holds the first activity.
    """

    def __init__(self, run: Callable[[], int], memory_bytes: int, state: SharedState) -> None:
        self._memory_bytes, self._state = memory_bytes, state
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
            except Exception:
                structlog.get_logger("grazemap_worker").exception("a compute process failed")
            finally:
                os._exit(status)  # never return into the worker's code
        # The parent and the child both set the group, because either may run first. A pause signals the group, so it
        # reaches children of the process too.
        with suppress(OSError):
            os.setpgid(self._pid, self._pid)

    def watch(
        self,
        is_wanted: Callable[[str], bool],
        interruption: Callable[[Activity], Callable[[], None] | None] | None = None,
    ) -> ProcessEnd:
        """Wait for the end of the process; kill it when it exceeds a limit, hangs, or computes for an unwanted job.

        If this method is left by an exception, for example because the worker is asked to stop, the process is killed
        too.

        Parameters
        ----------
        is_wanted : callable
            Called with the id of the job; returns whether the job is wanted. While the process stores a tile, it is
            called with an empty id, and returns True: the process may finish storing.
        interruption : callable, optional
            Called with the activity while the process computes. Returns more urgent work for the worker, or None. The
            process is paused while the worker does it.
        """
        descriptor = process_descriptor(self._pid)
        liveness = Liveness(self._pid, with_children=True)
        killed: ProcessEnd | None = None
        ended, next_look = False, 0.0
        try:
            while True:
                if descriptor is None:
                    time.sleep(_POLL_SECONDS)
                else:
                    select.select([descriptor], [], [], _LOOK_SECONDS)
                pid, status, usage = os.wait4(self._pid, os.WNOHANG)
                if pid:
                    ended = True
                    return self._outcome(status, usage, killed)
                if killed is not None or (descriptor is None and time.monotonic() < next_look):
                    continue
                next_look = time.monotonic() + _LOOK_SECONDS
                activity = self._state.read()
                hangs = liveness.hangs(computing=activity.computing)  # also updates cpu_seconds
                if liveness.cpu_seconds > activity.processor_time_at_begin + activity.max_seconds:
                    limit = f"its limit is {activity.max_seconds:.0f} s of processor time"
                    outcome = ProcessEnd(_KILLED, "timeout", limit)
                elif hangs:
                    outcome = ProcessEnd(_KILLED, "hung", f"each time for {HUNG_SECONDS:.0f} s")
                elif not is_wanted(activity.job_id if activity.computing else ""):
                    outcome = ProcessEnd(_KILLED)
                else:
                    if activity.computing and interruption and (action := interruption(activity)) is not None:
                        self._pause_during(action)
                    continue
                if self._state.read() == activity:  # otherwise the process has begun something else
                    os.kill(self._pid, signal.SIGKILL)
                    killed = outcome
        finally:
            if descriptor is not None:
                os.close(descriptor)
            if not ended:
                os.kill(self._pid, signal.SIGKILL)
                os.waitpid(self._pid, 0)

    def _pause_during(self, action: Callable[[], None]) -> None:
        os.killpg(self._pid, signal.SIGSTOP)
        try:
            action()
        finally:
            os.killpg(self._pid, signal.SIGCONT)

    def _outcome(self, status: int, usage: resource.struct_rusage, killed: ProcessEnd | None) -> ProcessEnd:
        """Return how the process ended; `killed` says why its worker has killed it, if it has."""
        code = os.waitstatus_to_exitcode(status)
        if killed is not None and code == _KILLED:  # otherwise the process had ended before it was killed
            return killed
        # LLVM and other libraries abort when they get no memory
        if code in (-signal.SIGABRT, -signal.SIGSEGV, -signal.SIGBUS) and (
            usage.ru_maxrss * PEAK_UNIT > _NEAR_LIMIT * self._memory_bytes
        ):
            return ProcessEnd(code, "memory", memory_text(self._memory_bytes))
        return ProcessEnd(code, "lost" if code < 0 or code == 1 else None)


def memory_text(limit: int) -> str:
    """Return a phrase that states a limit of memory."""
    return f"its limit is {limit >> 20} MiB"
