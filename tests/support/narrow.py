"""The instructions that every processor of the level x86-64-v3 has, for numba, numpy and BLAS, whatever this one has.

`make test`, and every TARGET as `make TARGET NARROW=1`, exports these settings. `python tests/support/narrow.py`
prints them, a line for each, on a processor of the level. Digests of results (`tests.support.digests`) are recorded
with them: what is computed with them is the same to the last bit on every processor of that level. numba generates
code for the level instead of for this processor; numpy takes its loops for the level; the OpenBLAS of numpy and that
of scipy take the kernels of Haswell, in one thread. Sine, exponential and the like are the C library's, which has one
variant of each for all processors with FMA and AVX2, and none that is wider.
"""

from __future__ import annotations

import runpy
from pathlib import Path

# The file alone: to import the package would import numba, which these settings are for.
_COMPILED_AHEAD = runpy.run_path(str(Path(__file__).parents[2] / "core/grazemap_core/compiled_ahead.py"))

SETTINGS: dict[str, str] = {
    **_COMPILED_AHEAD["PROCESSOR"],
    "NPY_ENABLE_CPU_FEATURES": "X86_V3",
    "OPENBLAS_CORETYPE": "Haswell",
    "OPENBLAS_NUM_THREADS": "1",
}

if __name__ == "__main__" and _COMPILED_AHEAD["has_level_3"]():  # another processor has its own instructions
    for name, value in SETTINGS.items():
        print(f"{name}={value}")
