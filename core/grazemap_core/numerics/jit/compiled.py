"""Decorators that compile kernels, and what they make.

A kernel takes arrays and numbers, and returns numbers or fills arrays; it does not allocate and does not raise. Kernels
are compiled without numba's runtime, which counts the references to every array that is passed on or looked up in a
tuple, with atomic instructions; this took a quarter of the time of a map. Without the runtime an allocation does not
compile, nor does the assignment of an array to a slice, which may have to copy the source; use `copy_vector` and
`copy_matrix`. Functions that allocate are compiled with `njit`.

Numba generates machine code, with a wrapper for Python, for every function that a compiled function calls, and compiles
it again in every caller. For kernels that call kernels, ten deep, this was two thirds of the compile time. Here a
kernel that another one calls (a *part*) is compiled to LLVM's intermediate code only, and optimised together with the
kernel that Python calls (a *whole*), whose machine code is cached. Parts that are compiled with `fastmath` are
optimised before they are merged into a caller; otherwise their loops would not be vectorised. Therefore a loop over all
lanes must be in a `fused_kernel` that is not inlined. In both no index counts from the end of an array: `a[i]` needs
i >= 0. A *pointer* kernel is called by its address instead.

This uses an undocumented interface of numba (`part_compiler`). With a version of numba that was not tested, or that
lacks the interface, kernels are functions of `njit` that call one another, with numba's runtime, and a warning states
the cost.

The code of an `inlined` function is merged into each of its callers. A `fused` function may contract a product and a
sum into one operation. Vectorised loops need this; it is not allowed where results must keep every rounding.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numba import njit, typeof, types
from numba.core import config
from numba.extending import typeof_impl
from numpy.typing import NDArray

from grazemap_core.numerics.jit.record_references import Reference

Function = TypeVar("Function", bound=Callable[..., object])

INTERPRETED = bool(vars(config)["DISABLE_JIT"])
"""Whether the environment variable NUMBA_DISABLE_JIT turns compilation off."""

TESTED = ("0.68",)
"""Versions of numba with whose private interface parts are tested."""

COST = "kernels are compiled without parts, which takes about 1.8 times as long; maps are about 10 % slower"

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_FUSED: dict[str, Any] = {"fastmath": {"contract"}}
_njit: Any = njit  # numba's type stubs omit private options and the options of wrappers


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
        self.targetoptions = options = {**options, "_nrt": False}
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


class _Address(types.WrapperAddressProtocol):
    """The address of a kernel for arguments of certain types; it is compiled, or loaded, when a caller is called."""

    def __init__(self, dispatcher: Any, signature: Any) -> None:
        self._dispatcher, self._signature, self._pointer = dispatcher, signature, 0
        self._numba_type_ = types.FunctionType(signature)  # numba would find it anew at every call

    def signature(self) -> Any:
        return self._signature

    def __wrapper_address__(self) -> int:
        if not self._pointer:
            compiled = self._dispatcher.get_compile_result(self._signature)
            self._pointer = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)
        return self._pointer


class PointerKernel:
    """A kernel that takes a reference to a named tuple and integers, and returns an integer; called by its address.

    It is compiled apart from its callers and cached separately: two processes can compile kernel and caller in
    parallel, and callers compiled for different types share it. A call costs a few nanoseconds more than that of a
    kernel compiled into its caller, and is never inlined.
    """

    def __init__(self, function: Callable[..., int], options: dict[str, Any]) -> None:
        """Take the options of `njit`; nothing is compiled."""
        self.py_func = function  # this and `targetoptions` are named as in numba's dispatchers
        if KERNEL_COMPILER is not None:
            options = {**options, "_nrt": False, "pipeline_class": KERNEL_COMPILER}
        self.targetoptions = options
        self._dispatcher = _njit(cache=True, no_cpython_wrapper=True, **options)(function)
        self._integers = len(inspect.signature(function).parameters) - 1
        self._addresses: dict[type, _Address] = {}

    def address(self, record: tuple[Any, ...]) -> Any:
        """Return what a kernel takes as an argument and calls with a reference to `record` and integers.

        The types are determined once per class, as this takes milliseconds. All records of a class must have arrays of
        the same types, or numba refuses the call.
        """
        if INTERPRETED:
            return self.py_func
        if type(record) not in self._addresses:
            signature = types.int64(Reference(typeof(record)), *[types.int64] * self._integers)
            self._addresses[type(record)] = _Address(self._dispatcher, signature)
        return self._addresses[type(record)]

    def compile(self, record: tuple[Any, ...]) -> None:
        """Compile the kernel, or load it, as `address` takes its record."""
        if not INTERPRETED:
            self.address(record).__wrapper_address__()


def _compile(function: Function, interpreted: bool = False, **options: Any) -> Function:
    options |= _OPTIONS
    if INTERPRETED:
        return function
    if PART_COMPILER is None:
        return _njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    return Kernel(function, options, interpreted)  # type: ignore[return-value]  # called as the function is


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
