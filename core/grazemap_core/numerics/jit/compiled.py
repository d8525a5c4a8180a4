"""Decorators that compile kernels.

A kernel takes arrays and numbers, and returns numbers or fills arrays; it does not allocate and does not raise. Kernels
are compiled without numba's runtime, which counts the references to every array that is passed on or looked up in a
tuple, with atomic instructions; this took a quarter of the time of a map. Without the runtime an allocation does not
compile, nor does the assignment of an array to a slice, which may have to copy the source; use `copy_vector` and
`copy_matrix`. Functions that allocate are compiled with `njit`.

A kernel is compiled into the kernels that call it (`inlining`); it is compiled as a function of its own, and cached,
when Python calls it. With a version of numba whose private interface is not known, a kernel is a function of `njit`,
with numba's runtime.

The code of an `inlined` function is merged into each of its callers. A `fused` function may contract a product and a
sum into one operation. Vectorised loops need this; it is not allowed where results must keep every rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit, typeof
from numpy.typing import NDArray

from grazemap_core.numerics.jit.inlining import INTERPRETED, PART_COMPILER, Kernel
from grazemap_core.numerics.jit.kernel_pointers import PointerKernel

Function = TypeVar("Function", bound=Callable[..., object])

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_FUSED: dict[str, Any] = {"fastmath": {"contract"}}


def _compile(function: Function, interpreted: bool = False, **options: Any) -> Function:
    options |= _OPTIONS
    if INTERPRETED:
        return function
    kernel: Any
    if PART_COMPILER is None:
        kernel = njit(cache=True, **options)(function)
    else:
        kernel = Kernel(function, {**options, "_nrt": False}, interpreted)
    compiled: Function = kernel
    return compiled


def kernel(function: Function) -> Function:
    """Compile a kernel; its machine code is cached."""
    return _compile(function)


def pointer_kernel(function: Callable[..., int]) -> PointerKernel:
    """Compile a kernel that other kernels call by its address; its machine code is cached."""
    return PointerKernel(function, dict(_OPTIONS))


def fused_kernel(function: Function) -> Function:
    """Compile a kernel that may contract operations; its machine code is cached."""
    return _compile(function, **_FUSED)


def inlined(function: Function) -> Function:
    """Compile a function that is merged into the kernels that call it."""
    return _compile(function, forceinline=True)


def inlined_formula(function: Function) -> Function:
    """Compile a function that is merged into the kernels that call it; called by Python, it runs uncompiled.

    For a choice or a sum of a few numbers, the call of compiled code alone would take longer than the work.
    """
    return _compile(function, interpreted=True, forceinline=True)


def fused_inlined(function: Function) -> Function:
    """Compile a function that may contract operations and is merged into the kernels that call it."""
    return _compile(function, forceinline=True, **_FUSED)


def any_order_kernel(function: Function) -> Function:
    """Compile a kernel whose sums may be taken in any order: for bounds with a margin, not for results."""
    return _compile(function, fastmath={"contract", "reassoc"})


def compile_for(function: Callable[..., object], *args: Any) -> None:
    """Compile a kernel for arguments of these types, or load it from the cache, without calling it."""
    if not INTERPRETED:
        whole: Any = function.whole if isinstance(function, Kernel) else function
        whole.compile(tuple(typeof(argument) for argument in args))


@inlined
def plain(value: int) -> int:
    """Return an integer constant typed as a variable, because numba compiles a callee anew for every literal."""
    return int(np.int64(value))


@inlined
def copy_vector(target: NDArray, source: NDArray) -> None:  # type: ignore[type-arg]
    """Fill target with the first numbers of source, which is at least as long."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@inlined
def copy_matrix(target: NDArray, source: NDArray) -> None:  # type: ignore[type-arg]
    """Copy source (m, n) to target (m, n)."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]
