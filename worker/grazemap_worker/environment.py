"""The environment variables of a computing process, set before numpy and numba are imported.

Parallelism comes from processes: one thread each, because threads of OpenMP do not survive a fork and because the
bytes of a result must not depend on how many cores a machine has.
"""

from __future__ import annotations

import os

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_thread() -> None:
    """Give numpy's and numba's libraries one thread each; takes effect when they are not loaded yet."""
    for name in _ONE_THREAD:
        os.environ[name] = "1"
