"""Kernels that other kernels call by their address.

Such a kernel is compiled apart from its callers and cached separately: two processes can compile kernel and caller in
parallel, and callers compiled for different types share it. A call costs a few nanoseconds more than that of a kernel
compiled into its caller, and is never inlined.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from numba import njit, typeof, types

from grazemap_core.numerics.jit.inlining import INTERPRETED, KERNEL_COMPILER
from grazemap_core.numerics.jit.record_references import Reference

_njit: Any = njit  # numba's type stubs omit private options and the options of wrappers


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
    """A kernel that takes a reference to a named tuple and integers, and returns an integer."""

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
