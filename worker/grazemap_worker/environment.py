"""Environment variables of a process that computes, set before numpy and numba are imported.

Parallelism comes from processes with one thread each: threads of OpenMP do not survive a fork, and the bytes of a
result must not depend on the number of cores.
"""

from __future__ import annotations

import os

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_thread() -> None:
    """Limit the libraries of numpy and numba to one thread each; call this before they are imported."""
    for name in _ONE_THREAD:
        os.environ[name] = "1"
