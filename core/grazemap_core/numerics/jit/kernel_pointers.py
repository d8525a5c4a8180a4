"""Kernels that other kernels call by their address.

Such a kernel is compiled apart from its callers, into an entry of its own of the cache: two processes compile both at
the same time, and callers of several types share it. A call costs some nanoseconds more than one of a part, and nothing
of it is merged into the caller.
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
        self._dispatcher, self._signature, self._known = dispatcher, signature, 0
        self._numba_type_ = types.FunctionType(signature)  # numba would find it anew at every call

    def signature(self) -> Any:
        return self._signature

    def __wrapper_address__(self) -> int:
        if not self._known:
            compiled = self._dispatcher.get_compile_result(self._signature)
            self._known = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)
        return self._known


class PointerKernel:
    """A kernel of a reference to a named tuple and of integers, which returns an integer."""

    def __init__(self, function: Callable[..., int], options: dict[str, Any]) -> None:
        """Take the options of `njit`; nothing is compiled."""
        self.py_func = function
        if KERNEL_COMPILER is not None:
            options = {**options, "_nrt": False, "pipeline_class": KERNEL_COMPILER}
        self.targetoptions = options
        self._dispatcher = _njit(cache=True, no_cpython_wrapper=True, **options)(function)
        self._integers = len(inspect.signature(function).parameters) - 1
        self._addresses: dict[type, _Address] = {}

    def address(self, record: tuple[Any, ...]) -> Any:
        """Return what a kernel takes as an argument and calls with a reference to `record` and integers.

        All records of a class have arrays of the types of the first one, whose types take milliseconds to find; numba
        refuses a caller whose record has others.
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
