"""Whether a process goes on: it is not stopped, and uses processor time while it should."""

from __future__ import annotations

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


class Progress:
    """Notices that a process hangs: it is stopped, or uses no processor time while it should."""

    def __init__(self, pid: int, *, with_children: bool = False) -> None:
        self._pid, self._with_children = pid, with_children
        self._idle = Stopwatch()
        self.cpu_seconds = 0.0

    def hangs(self, *, computing: bool) -> bool:
        """Look at the process, at least every few seconds; return whether it made no progress for `HUNG_SECONDS`."""
        found = seen(self._pid)
        if found is None:
            return False
        stopped = found.state in "Tt"
        seconds = found.cpu_seconds + (children_seconds(self._pid) if self._with_children else 0.0)
        progress = seconds != self.cpu_seconds or not (computing or stopped)
        self.cpu_seconds = seconds
        return self._idle.look(reset=progress) > HUNG_SECONDS
