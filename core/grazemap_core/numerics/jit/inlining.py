"""Kernels as parts of other kernels: compiled into their callers, and to code of their own only when Python calls them.

Numba makes machine code of every function that a compiled one calls, with a wrapper for Python, and compiles all of it
anew in each caller. With kernels that call kernels, ten deep, that was two thirds of the time that a cold machine
compiles. Here a part is carried no further than LLVM's intermediate code, and is optimised with the kernel that Python
calls; that one holds all its parts, and its machine code is cached. Parts for vectors (`fastmath`) are optimised by
themselves first: merged into a caller before, they are not vectorised. So a loop over all lanes must be in a
`fused_kernel` that is not inlined.

This uses an interface of numba that is not documented (`part_compiler`). With a version of numba that was not tested,
or that lacks what is used, kernels are plain functions of `njit` that call one another (`compiled`), and a warning says
what that costs.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numba
from numba import njit, types
from numba.core import config
from numba.extending import typeof_impl

INTERPRETED = bool(vars(config)["DISABLE_JIT"])
"""Whether numba was told (NUMBA_DISABLE_JIT) to leave functions as they are."""

COST = "kernels are compiled without parts, which takes longer; with numba 0.68 they are not"

_njit: Any = njit  # numba's type stubs know neither private options nor those of wrappers


TESTED = ("0.68",)
"""Versions of numba with whose private interface parts are tested."""


class InliningWarning(RuntimeWarning):
    """Kernels are compiled without parts."""


def _part_compiler() -> Any:
    """Return the compiler of parts, or None, with a warning, where numba's private interface may be another."""
    if not numba.__version__.startswith(tuple(f"{version}." for version in TESTED)):
        reason = f"numba {numba.__version__} is not a tested version ({', '.join(TESTED)})"
    else:
        try:
            from grazemap_core.numerics.jit.part_compiler import PartCompiler
        except (ImportError, AttributeError) as error:
            reason = f"numba {numba.__version__} lacks what is known of it ({error})"
        else:
            return PartCompiler
    warnings.warn(f"{reason}: {COST}", InliningWarning, stacklevel=2)
    return None


PART_COMPILER: Any = None if INTERPRETED else _part_compiler()
"""Numba's compiler of parts; None where kernels are compiled by numba's public interface alone."""


class Kernel:
    """A compiled function: a part where a kernel calls it, a whole where Python does."""

    def __init__(self, function: Callable[..., object], options: dict[str, Any]) -> None:
        """Take numba's options of `njit`; nothing is compiled before a call."""
        self.py_func = function
        self.targetoptions = options
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.part = _njit(pipeline_class=PART_COMPILER, **wrappers, **options)(function)
        self.whole = _njit(cache=True, **options)(function)

    def __call__(self, *args: Any) -> Any:
        """Call the whole, compiled or from the cache."""
        return self.whole(*args)


@typeof_impl.register(Kernel)
def _type_of_kernel(kernel: Kernel, _: Any) -> Any:
    return types.Dispatcher(kernel.part)
