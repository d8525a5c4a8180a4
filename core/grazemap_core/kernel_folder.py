"""The cache folder of compiled kernels, set before any kernel is defined.

Numba invalidates a cached function when the file that defines it changes, but not when the file of a function compiled
into it changes. Therefore the name of the folder contains a fingerprint of all source files of the core. The folder
lies below NUMBA_CACHE_DIR if that is set, otherwise in the `__pycache__` of the core.
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
    """Set numba's cache folder for all functions that are decorated afterwards."""
    below = numba.config.CACHE_DIR or _CORE / "__pycache__"  # type: ignore[attr-defined]  # set when numba is imported
    numba.config.CACHE_DIR = str(Path(below) / f"kernels-{source_fingerprint()}")  # type: ignore[attr-defined]
