"""How kernels are compiled. A kernel takes arrays and numbers and returns numbers; it allocates nothing, never raises.

That is more than a habit: kernels are compiled without numba's runtime, which counts the references to every array
that is passed on or looked up in a tuple, with atomic instructions. Counting took a quarter of the time of a map.
Without the runtime an allocation does not compile, nor does the assignment of an array to a slice (which may have to
copy the source); `copy_vector` and `copy_matrix` serve for that. What does allocate is compiled with plain `njit`.

A kernel is compiled as a part of those that call it (`parts`), and as a whole, which is cached, when Python calls it.
Where numba's private interface is not known, a kernel is a plain function of `njit`, with numba's runtime.

A function that is `inlined` has no code of its own: each of its callers has. `fused` ones may contract a product and a
sum into one operation, which vectors want; where round-off is followed to the last digit that is not allowed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from grazemap_core.numerics.jit.inlining import INTERPRETED, PART_COMPILER, Kernel

Function = TypeVar("Function", bound=Callable[..., object])

_FUSED: dict[str, Any] = {"fastmath": {"contract"}}


def _compile(function: Function, **options: Any) -> Function:
    options |= {"nogil": True, "error_model": "numpy"}
    if INTERPRETED:
        return function
    kernel: Any
    if PART_COMPILER is None:
        kernel = njit(cache=True, **options)(function)
    else:
        kernel = Kernel(function, {**options, "_nrt": False})
    compiled: Function = kernel
    return compiled


def kernel(function: Function) -> Function:
    """Compile a kernel; its machine code is cached."""
    return _compile(function)


def fused_kernel(function: Function) -> Function:
    """Compile a kernel that may contract operations; its machine code is cached."""
    return _compile(function, **_FUSED)


def inlined(function: Function) -> Function:
    """Compile a part of kernels."""
    return _compile(function, forceinline=True)


def fused_inlined(function: Function) -> Function:
    """Compile a part of kernels that may contract operations."""
    return _compile(function, forceinline=True, **_FUSED)


@inlined
def plain(value: int) -> int:
    """Return a constant as any other integer: numba types constants by value, and compiles all below for each."""
    return int(np.int64(value))


@inlined
def copy_vector(target: NDArray, source: NDArray) -> None:  # type: ignore[type-arg]
    """Write the first numbers of source (n,) over target (n or fewer,)."""
    for i in range(target.shape[0]):
        target[i] = source[i]


@inlined
def copy_matrix(target: NDArray, source: NDArray) -> None:  # type: ignore[type-arg]
    """Write source (m, n) over target (m, n)."""
    for i in range(target.shape[0]):
        for j in range(target.shape[1]):
            target[i, j] = source[i, j]
