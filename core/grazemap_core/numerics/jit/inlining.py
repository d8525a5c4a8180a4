"""Compilation of kernels into the kernels that call them.

Numba generates machine code, with a wrapper for Python, for every function that a compiled function calls, and
compiles it again in every caller. For kernels that call kernels, ten deep, this was two thirds of the compile time.
Here a kernel that another one calls (a *part*) is compiled to LLVM's intermediate code only, and optimised together
with the kernel that Python calls (a *whole*), whose machine code is cached. Parts that are compiled with `fastmath` are
optimised before they are merged into a caller; otherwise their loops would not be vectorised. Therefore a loop over all
lanes must be in a `fused_kernel` that is not inlined. In both no index counts from the end of an array
(`part_compiler`): `a[i]` needs i >= 0.

This uses an undocumented interface of numba (`part_compiler`). With a version of numba that was not tested, or that
lacks the interface, kernels are functions of `njit` that call one another (`compiled`), and a warning states the cost.
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
"""Whether the environment variable NUMBA_DISABLE_JIT turns compilation off."""

COST = "kernels are compiled without parts, which takes about 1.8 times as long; maps are about 10 % slower"

_njit: Any = njit  # numba's type stubs omit private options and the options of wrappers


TESTED = ("0.68",)
"""Versions of numba with whose private interface parts are tested."""


class InliningWarning(RuntimeWarning):
    """Kernels are compiled without parts."""


def _compilers() -> tuple[Any, Any]:
    """Return the compilers of parts and of wholes, or None, with a warning if numba's private interface may differ."""
    if not numba.__version__.startswith(tuple(f"{version}." for version in TESTED)):
        reason = f"numba {numba.__version__} is not a tested version ({', '.join(TESTED)})"
    else:
        try:
            from grazemap_core.numerics.jit.part_compiler import KernelCompiler, PartCompiler
        except (ImportError, AttributeError) as error:
            reason = f"numba {numba.__version__} lacks what is known of it ({error})"
        else:
            return PartCompiler, KernelCompiler
    warnings.warn(f"{reason}: {COST}", InliningWarning, stacklevel=2)
    return None, None


PART_COMPILER, KERNEL_COMPILER = (None, None) if INTERPRETED else _compilers()
"""The compilers of parts and of wholes; None where kernels are compiled by numba's public interface alone."""


class Kernel:
    """A compiled function: a part when a kernel calls it, a whole when Python calls it."""

    def __init__(self, function: Callable[..., object], options: dict[str, Any], interpreted: bool = False) -> None:
        """Take the options of `njit`, and whether there is no whole: Python evaluates what it calls.

        Compilation starts with the first call.
        """
        self.py_func = function
        self.targetoptions = options
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.part = _njit(pipeline_class=PART_COMPILER, **wrappers, **options)(function)
        self.whole: Any = function
        if not interpreted:
            self.whole = _njit(cache=True, pipeline_class=KERNEL_COMPILER, **options)(function)

    def __call__(self, *args: Any) -> Any:
        """Call the compiled or cached whole, or the function itself where there is none."""
        return self.whole(*args)


@typeof_impl.register(Kernel)
def _type_of_kernel(kernel: Kernel, _: Any) -> Any:
    return types.Dispatcher(kernel.part)
