"""Compiled kernels: arrays in, values and a status out; they never raise.

The disk cache of numba looks at the file that a function stands in, not at the files of the functions that were
compiled into it: an edit of one kernel would leave its callers stale. So the cache folder carries a fingerprint of all
sources of the core. It lies below NUMBA_CACHE_DIR where that is set, else beside the sources.
"""

import hashlib
from pathlib import Path

import numba

_CORE = Path(__file__).parents[1]


def source_fingerprint() -> str:
    """Return a short hash of every source file of the core."""
    digest = hashlib.sha256()
    for path in sorted(_CORE.rglob("*.py")):
        digest.update(path.relative_to(_CORE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


_below = numba.config.CACHE_DIR or _CORE / "__pycache__"  # type: ignore[attr-defined]  # set when numba is imported
numba.config.CACHE_DIR = str(Path(_below) / f"kernels-{source_fingerprint()}")  # type: ignore[attr-defined]
