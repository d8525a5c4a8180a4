"""The folder of compiled kernels, chosen before any kernel is defined.

Numba's disk cache looks at the file in which a function stands, not at the files of the functions that were compiled
into it: after an edit of one kernel its callers would stay stale. So the folder carries a fingerprint of all sources
of the core. It lies below NUMBA_CACHE_DIR where that is set, else beside the sources.
"""

import hashlib
from pathlib import Path

import numba

_CORE = Path(__file__).parent


def source_fingerprint() -> str:
    """Return a short hash of every source file of the core."""
    digest = hashlib.sha256()
    for path in sorted(_CORE.rglob("*.py")):
        digest.update(path.relative_to(_CORE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def choose_folder() -> None:
    """Set numba's cache folder; a function that is decorated later keeps its machine code there."""
    below = numba.config.CACHE_DIR or _CORE / "__pycache__"  # type: ignore[attr-defined]  # set when numba is imported
    numba.config.CACHE_DIR = str(Path(below) / f"kernels-{source_fingerprint()}")  # type: ignore[attr-defined]
