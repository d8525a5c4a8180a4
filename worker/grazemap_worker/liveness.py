"""Detects processes that hang: that are stopped, compute without using processor time, or give no sign of life.

A watching process has one `Liveness` for each process that it watches. The stack (`grazemap up`) watches its children,
the supervisor watches workers and compiling processes, and a worker watches its compute process. A sign of life is a
message, an answer, or a value in shared memory.
"""

from __future__ import annotations

import math
import time

from grazemap_worker.system import children_seconds, process_stat

# Seconds without progress after which a process counts as hung. A process makes no progress while it is stopped, and
# while it computes and uses no processor time.
HUNG_SECONDS = 10.0
# At most this many seconds are counted between two looks. There may be more when the watching process, or the machine,
# was itself stopped.
_MAX_PAUSE_SECONDS = 3.0


class Stopwatch:
    """Measures time by regular looks; of a long pause between two looks, `_MAX_PAUSE_SECONDS` are counted."""

    def __init__(self) -> None:
        self._looked = time.monotonic()
        self._seconds = 0.0

    def look(self, *, reset: bool) -> float:
        """Return the seconds since the last reset; with `reset`, begin at 0 again."""
        now = time.monotonic()
        self._seconds = 0.0 if reset else self._seconds + min(now - self._looked, _MAX_PAUSE_SECONDS)
        self._looked = now
        return self._seconds


class Liveness:
    """Detects that a process hangs: it is stopped, uses no processor time while it should, or is silent for too long.

    Parameters
    ----------
    pid : int
        The process.
    silent_seconds : float
        Maximum time between two signs of life.
    first_seconds : float
        Maximum time until the first sign of life.
    with_children : bool
        Whether the processor time of its children counts too.

    Attributes
    ----------
    cpu_seconds : float
        Processor time of the process at the last look, with that of its children if this counts.
    """

    def __init__(
        self,
        pid: int,
        *,
        silent_seconds: float = math.inf,
        first_seconds: float = math.inf,
        with_children: bool = False,
    ) -> None:
        self._pid, self._with_children = pid, with_children
        self._silent_seconds, self._silence_allowed = silent_seconds, first_seconds
        self._idle, self._silence = Stopwatch(), Stopwatch()
        self.cpu_seconds = 0.0

    def hangs(self, *, computing: bool = False, heard: bool = False) -> str:
        """Look at the process; return why it counts as hung, or an empty text. Call this at least every few seconds.

        `computing` says whether the process should use processor time, `heard` whether it gave a sign of life since the
        last call.
        """
        if heard:
            self._silence_allowed = self._silent_seconds
        silence = self._silence.look(reset=heard)
        stat = process_stat(self._pid)
        if stat is not None:
            stopped = stat.state in "Tt"
            seconds = stat.cpu_seconds + (children_seconds(self._pid) if self._with_children else 0.0)
            progress = seconds != self.cpu_seconds or not (computing or stopped)
            self.cpu_seconds = seconds
            if self._idle.look(reset=progress) > HUNG_SECONDS:
                return "it is stopped" if stopped else "it makes no progress"
        return "it does not answer" if silence > self._silence_allowed else ""
