"""Whether a process goes on: it is not stopped, uses processor time while it computes, and gives signs of life.

What watches a process looks at one `Liveness` of it: the stack at its children, the supervisor at workers and at what
compiles, a worker at the process of its tile. A sign of life is a message, an answer, or a note in shared memory.
"""

from __future__ import annotations

import math
import os
import time
from pathlib import Path
from typing import NamedTuple

# Seconds without progress (processor time, or the state "stopped") after which a process counts as hung.
HUNG_SECONDS = 10.0
# What a pause between two looks counts at most: the process that looks may itself have been stopped, or the machine.
_MOST_PAUSE_SECONDS = 3.0
_TICK = 1.0 / os.sysconf("SC_CLK_TCK")


class Seen(NamedTuple):
    """What the operating system says of a process."""

    state: str
    """The letter of its state."""
    cpu_seconds: float
    """Its processor time."""


def seen(pid: int) -> Seen | None:
    """Return what a process does, or None when it is gone or the system does not say (Linux only)."""
    try:
        # the name, in brackets, may have spaces
        fields = Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()
    except OSError:
        return None
    return Seen(fields[0].decode(), (int(fields[11]) + int(fields[12])) * _TICK)


def children_seconds(pid: int) -> float:
    """Return the processor time of the children of a process that have not ended (Linux only; elsewhere 0)."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split()
    except OSError:
        return 0.0
    return sum(child.cpu_seconds for child in map(seen, map(int, children)) if child is not None)


class Stopwatch:
    """Seconds of this process's own looking, without the pauses in which it did not look."""

    def __init__(self) -> None:
        self._looked = time.monotonic()
        self._seconds = 0.0

    def look(self, *, reset: bool) -> float:
        """Return the seconds since the last reset; with `reset`, they begin anew."""
        now = time.monotonic()
        self._seconds = 0.0 if reset else self._seconds + min(now - self._looked, _MOST_PAUSE_SECONDS)
        self._looked = now
        return self._seconds


class Liveness:
    """Notices that a process hangs: it is stopped, uses no processor time while it should, or is silent for too long.

    Parameters
    ----------
    pid : int
        The process.
    silent_seconds : float
        How long it may give no sign of life after one.
    first_seconds : float
        How long it may give none at first.
    with_children : bool
        Whether the processor time of its children counts too.
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
        """Look at the process, at least every few seconds; return why it counts as hung, empty if it does not.

        `computing` says whether it should use processor time, `heard` whether it gave a sign since the last look.
        """
        if heard:
            self._silence_allowed = self._silent_seconds
        silence = self._silence.look(reset=heard)
        found = seen(self._pid)
        if found is not None:
            stopped = found.state in "Tt"
            seconds = found.cpu_seconds + (children_seconds(self._pid) if self._with_children else 0.0)
            progress = seconds != self.cpu_seconds or not (computing or stopped)
            self.cpu_seconds = seconds
            if self._idle.look(reset=progress) > HUNG_SECONDS:
                return "it is stopped" if stopped else "it makes no progress"
        return "it does not answer" if silence > self._silence_allowed else ""
