"""Waiting for what processes do, and telling which of them live."""

from __future__ import annotations

import time
from collections.abc import Callable

import psutil


def until(condition: Callable[[], object], seconds: float = 60.0) -> float:
    """Wait for a condition; return the seconds it took, or fail.

    A busy machine takes many times as long as a free one, so give more than that needs.
    """
    started = time.monotonic()
    while not condition():
        assert time.monotonic() - started < seconds, "it did not happen in time"
        time.sleep(0.02)
    return time.monotonic() - started


def living(processes: list[psutil.Process]) -> list[psutil.Process]:
    """Return the processes that run; one that has ended counts as dead even if its parent has not waited for it."""
    running = []
    for process in processes:
        try:
            if process.status() not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
                running.append(process)
        except psutil.NoSuchProcess:
            continue
    return running
