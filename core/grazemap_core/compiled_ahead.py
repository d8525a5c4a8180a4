"""Kernels that were compiled ahead of time: those in the package `grazemap-kernels`, for processors of x86-64-v3.

The package holds a folder as `kernel_folder` makes it, and what it was made from. Where the sources and versions of
this process are the same and its processor is of that level, code is generated for x86-64-v3 instead of for this very
processor, as if NUMBA_CPU_NAME said so: results, and the fingerprint of their numerics, are those of x86-64-v3.
GRAZEMAP_KERNELS=native turns this off.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

PACKAGE = "grazemap_kernels"
MADE_FROM = "made_from.json"
PROCESSOR = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
"""What numba's settings are where code is generated for x86-64-v3."""

_CORE = Path(__file__).parent
# What the level v3 has beyond every x86-64 processor, as Linux names it.
_FLAGS = {
    *("cx16", "lahf_lm", "popcnt", "sse4_1", "sse4_2", "ssse3"),
    *("avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"),
}
_CHOICES = ("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX")


@cache
def source_fingerprint() -> str:
    """Return a short hash of every source file of the core."""
    digest = hashlib.sha256()
    for path in sorted(_CORE.rglob("*.py")):
        digest.update(path.relative_to(_CORE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def made_from() -> dict[str, object]:
    """Return what machine code depends on besides the processor and numba's settings."""
    return {
        "sources": source_fingerprint(),
        "python": sys.implementation.cache_tag,
        "versions": [version(name) for name in ("numba", "llvmlite", "numpy")],
    }


@cache
def package_folder() -> Path | None:
    """Return where the package's kernels are; None where there is none that fits this process."""
    spec = find_spec(PACKAGE)
    if spec is None or spec.origin is None:
        return None
    folder = Path(spec.origin).parent
    try:
        fits = json.loads((folder / MADE_FROM).read_bytes()) == made_from()
    except (OSError, ValueError):
        return None
    return folder if fits and has_level_3() else None


def choose_processor() -> None:
    """Have numba generate code for x86-64-v3 where the package fits; to be called before numba is imported.

    It does nothing where numba is imported, or where the environment chooses the processor.
    """
    chosen = any(name in os.environ for name in _CHOICES) or os.environ.get("GRAZEMAP_KERNELS") == "native"
    if not chosen and "numba" not in sys.modules and package_folder() is not None:
        os.environ.update(PROCESSOR)


def has_level_3() -> bool:
    """Return whether the processor has all that code for x86-64-v3 may use."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return False
    return any(line.startswith("flags") and set(line.split()) >= _FLAGS for line in lines)
