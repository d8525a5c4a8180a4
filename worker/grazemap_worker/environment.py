"""The surroundings of a process that computes: its threads, and its folder for compiled kernels.

Parallelism comes from processes with one thread each: threads of OpenMP do not survive a fork, and the bytes of a
result must not depend on the number of cores.
"""

from __future__ import annotations

import os
from pathlib import Path

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
"""The variables that limit the libraries of numpy and numba to as many threads as they say."""

CHOOSE_CACHE_DIR = "set GRAZEMAP_CACHE_DIR to a folder in which this user can write"
"""What to do where the folder for compiled kernels cannot be used."""


def one_thread() -> None:
    """Limit the libraries of numpy and numba to one thread each; call this before they are imported."""
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))


def default_cache_dir() -> Path:
    """Return the default folder for compiled kernels: in XDG_CACHE_HOME, else in ~/.cache.

    Raises RuntimeError where the home of the user is not known.
    """
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()) / "grazemap"
    except RuntimeError:
        raise RuntimeError(f"the home of this user is not known; {CHOOSE_CACHE_DIR}") from None


def usable_cache_dir() -> Path | None:
    """Return the folder for compiled kernels: GRAZEMAP_CACHE_DIR, else the default one.

    None where the home of the user is not known, or cannot be written.
    """
    # the case of names does not matter, as in the settings
    chosen = next((value for name, value in os.environ.items() if name.upper() == "GRAZEMAP_CACHE_DIR"), "")
    if chosen:
        return Path(chosen)
    try:
        folder = default_cache_dir()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):
        return None
    return folder if os.access(folder, os.W_OK) else None
