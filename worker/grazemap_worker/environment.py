"""The surroundings of a process that computes: its threads, its cores, and its folder for compiled kernels.

Parallelism comes from processes with one thread each: threads of OpenMP do not survive a fork, and the bytes of a
result must not depend on the number of cores.
"""

from __future__ import annotations

import os
from pathlib import Path

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The variables that limit the libraries of numpy and numba to as many threads as they say."""


def one_thread() -> None:
    """Limit the libraries of numpy and numba to one thread each; call this before they are imported."""
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def default_cache_dir() -> Path:
    """Return the default folder for compiled kernels: in XDG_CACHE_HOME, else in ~/.cache."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "grazemap"
