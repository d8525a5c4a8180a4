"""The numerics: libraries, sources and processor on which the bytes of a result depend besides the request."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version

from grazemap.version import __version__

# Settings of numba, and of numpy and its linear algebra, that change the instructions on the same processor.
_NUMBA_SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "USING_SVML")
_NUMPY_SETTINGS = ("NPY_DISABLE_CPU_FEATURES", "NPY_ENABLE_CPU_FEATURES", "OPENBLAS_CORETYPE")


@dataclass(frozen=True)
class Numerics:
    """Libraries and processor that results are computed with."""

    numba: str
    """Version of numba."""
    llvmlite: str
    """Version of llvmlite."""
    numpy: str
    """Version of numpy."""
    scipy: str
    """Version of scipy."""
    cpu: str
    """The processor that code is generated for, by LLVM's name; "interpreted" when nothing is compiled."""
    cpu_features: str
    """The extensions of the instruction set that the code may use, separated by commas; empty if it uses only the
    instructions that every processor of this name has."""
    fingerprint: str
    """Start of a hash of everything on which the bytes of a result depend besides the request."""

    def as_meta(self) -> dict[str, str]:
        """Return the numerics as they stand in the metadata of a result."""
        return asdict(self)


@cache
def numerics() -> Numerics:
    """Return the numerics of this process; imports numba.

    The fingerprint is the start of a sha256 over these: the versions, the core's sources, whether kernels are compiled
    with parts, the name and the features of the processor, and the settings that change instructions. Two machines with
    the same fingerprint run the same instructions.
    """
    # imported before numba, whose settings it may change
    from grazemap_core.compiled_ahead import source_fingerprint
    from grazemap_core.numerics.jit.compiled import PART_COMPILER
    from numba.core import config  # isort: skip
    from numba.core.registry import cpu_target  # isort: skip

    versions = {name: version(name) for name in ("numba", "llvmlite", "numpy", "scipy")}
    core = {
        "core_version": __version__,
        "core_sources": source_fingerprint(),
        "with_parts": PART_COMPILER is not None,
    }
    # the processor that numba compiles for, with its settings (NUMBA_CPU_NAME, NUMBA_ENABLE_AVX ...) applied
    triple, cpu, features = cpu_target.target_context.codegen().magic_tuple()
    if config.DISABLE_JIT:  # type: ignore[attr-defined]  # set when numba is imported
        cpu, features = "interpreted", ""
    settings = {name: str(getattr(config, name)) for name in _NUMBA_SETTINGS}
    settings |= {name: os.environ.get(name, "") for name in _NUMPY_SETTINGS}
    target = {"triple": triple, "cpu": cpu, "features": features}
    text = json.dumps({**versions, **core, **target, **settings}, sort_keys=True)
    return Numerics(
        **versions,
        cpu=cpu,
        cpu_features=", ".join(sorted(name[1:] for name in features.split(",") if name.startswith("+"))),
        fingerprint=hashlib.sha256(text.encode()).hexdigest()[:16],
    )
