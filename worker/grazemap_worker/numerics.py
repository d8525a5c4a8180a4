"""The numerics fingerprint: what, besides the request, the bytes of a result depend on."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version

from grazemap_worker.store import core_version


@dataclass(frozen=True)
class Numerics:
    """Libraries and processor that results are computed with."""

    numba: str
    llvmlite: str
    numpy: str
    scipy: str
    cpu: str
    fingerprint: str

    def as_meta(self) -> dict[str, str]:
        """Return what a result's meta says about them."""
        return asdict(self)


@cache
def numerics() -> Numerics:
    """Return the numerics of this process; imports numba.

    The fingerprint is the start of a sha256 over the versions, the core's own and its sources included, the name of
    the processor that code is generated for and all its features: two machines that share it run the same
    instructions.
    """
    from llvmlite import binding

    from grazemap_core.kernels import source_fingerprint

    versions = {name: version(name) for name in ("numba", "llvmlite", "numpy", "scipy")}
    cpu = os.environ.get("NUMBA_CPU_NAME") or binding.get_host_cpu_name()
    features = os.environ.get("NUMBA_CPU_FEATURES") or binding.get_host_cpu_features().flatten()
    core = {"core_version": core_version(), "core_sources": source_fingerprint()}
    text = json.dumps({**versions, **core, "cpu": cpu, "features": features}, sort_keys=True)
    return Numerics(**versions, cpu=cpu, fingerprint=hashlib.sha256(text.encode()).hexdigest()[:16])
