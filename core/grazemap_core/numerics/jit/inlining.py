"""Kernels as parts of other kernels: compiled into their callers, and to code of their own only when Python calls them.

Numba makes machine code of every function that a compiled one calls, with a wrapper for Python, and compiles all of it
anew in each caller. With kernels that call kernels, ten deep, that was two thirds of the time that a cold machine
compiles. Here a part is carried no further than LLVM's intermediate code, and is optimised with the kernel that Python
calls; that one holds all its parts, and its machine code is cached. Parts for vectors (`fastmath`) are optimised by
themselves first: merged into a caller before, they are not vectorised. So a loop over all lanes must be in a
`fused_kernel` that is not inlined.

This uses numba's interface for compiler passes of one's own, and a class behind it that is not documented
(`JITCodeLibrary`): numba is pinned, and a test compares what is compiled with what is interpreted.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types
from numba.core import config
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.extending import typeof_impl

INTERPRETED = bool(vars(config)["DISABLE_JIT"])
"""Whether numba was told (NUMBA_DISABLE_JIT) to leave functions as they are."""

_njit: Any = njit  # numba's type stubs know neither private options nor those of wrappers


class _PartLibrary(JITCodeLibrary):
    """Intermediate code of a part and of the parts that it calls; linked into callers, never run."""

    for_vectors = False

    def _optimize_final_module(self) -> None:
        if self.for_vectors:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """Numba's last pass, without the machine code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.for_vectors = bool(state.flags.fastmath) and not state.flags.forceinline
        state.library = library
        state.flags.no_compile = True
        super().run_pass(state)
        own: list[Any] = []
        name = own.append  # numba knows a compiled function by a builtin of its own, to be called from Python
        state["cr"] = state["cr"]._replace(cfunc=name)
        state.targetctx.insert_user_function(name, state["cr"].fndesc, [library])
        return True


class _PartCompiler(CompilerBase):
    """Numba's compiler with the last pass exchanged."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        last = [step for step, _ in passes.passes].index(NativeLowering)
        passes.passes[last] = (_PartLowering, "native lowering of a part")
        passes._finalized = False
        passes.finalize()
        return [passes]


class Kernel:
    """A compiled function: a part where a kernel calls it, a whole where Python does."""

    def __init__(self, function: Callable[..., object], options: dict[str, Any]) -> None:
        """Take numba's options of `njit`; nothing is compiled before a call."""
        self.py_func = function
        self.targetoptions = options
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.part = _njit(pipeline_class=_PartCompiler, **wrappers, **options)(function)
        self.whole = _njit(cache=True, **options)(function)

    def __call__(self, *args: Any) -> Any:
        """Call the whole, compiled or from the cache."""
        return self.whole(*args)


@typeof_impl.register(Kernel)
def _type_of_kernel(kernel: Kernel, _: Any) -> Any:
    return types.Dispatcher(kernel.part)
