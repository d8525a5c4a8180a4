"""The machine and the versions of a run: ratios are valid on another machine, rates are not."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numba
from llvmlite import binding as llvm
from numba.core.registry import cpu_target

from benchmarks.result import Machine

PACKAGES = ("grazemap", "numba", "llvmlite", "numpy", "scipy", "heyoka")


def describe() -> Machine:
    """Return the machine and the versions of everything that is timed."""
    target = numba.config.CPU_NAME or llvm.get_host_cpu_name()  # type: ignore[attr-defined]  # set on import
    named = cpu_target.target_context.codegen().magic_tuple()[2].split(",")
    return Machine(
        processor=_processor(),
        target=str(target),
        features=sorted(name[1:] for name in named if name.startswith("+")),
        cores=len(os.sched_getaffinity(0)),
        system=f"{platform.system()} {platform.machine()}",
        load=os.getloadavg()[0],
        versions={"python": platform.python_version(), **{name: _version(name) for name in PACKAGES}},
    )


def _processor() -> str:
    """Return the processor as it names itself."""
    for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
        if line.startswith("model name"):
            return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _version(package: str) -> str:
    """Return the version of a package, or that it is missing."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
