"""Compilation of kernels into the kernels that call them.

Numba generates machine code, with a wrapper for Python, for every function that a compiled function calls, and
compiles it again in every caller. For kernels that call kernels, ten deep, this was two thirds of the compile time.
Here a kernel that another one calls (a *part*) is compiled to LLVM's intermediate code only, and optimised together
with the kernel that Python calls (a *whole*), whose machine code is cached. Parts that are compiled with `fastmath`
are optimised separately first: merged into a caller before, their loops would not be vectorised. Therefore a loop over
all lanes must be in a `fused_kernel` that is not inlined.

This uses numba's documented interface for custom compiler passes and an undocumented class, `JITCodeLibrary`: numba is
pinned, and a test compares compiled with interpreted results.
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
"""Whether the environment variable NUMBA_DISABLE_JIT turns compilation off."""

_njit: Any = njit  # numba's type stubs have neither the private options nor those of wrappers


class _PartLibrary(JITCodeLibrary):
    """Intermediate code of a part and of the parts that it calls; it is linked into callers and never run itself."""

    for_vectors = False

    def _optimize_final_module(self) -> None:
        if self.for_vectors:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """Numba's last compiler pass, without the generation of machine code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.for_vectors = bool(state.flags.fastmath) and not state.flags.forceinline
        state.library = library
        state.flags.no_compile = True
        super().run_pass(state)
        own: list[Any] = []
        name = own.append  # numba identifies a compiled function by a builtin that Python could call
        state["cr"] = state["cr"]._replace(cfunc=name)
        state.targetctx.insert_user_function(name, state["cr"].fndesc, [library])
        return True


class _PartCompiler(CompilerBase):
    """Numba's compiler with its last pass replaced."""

    def define_pipelines(self) -> list[Any]:
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        last = [step for step, _ in passes.passes].index(NativeLowering)
        passes.passes[last] = (_PartLowering, "native lowering of a part")
        passes._finalized = False
        passes.finalize()
        return [passes]


class Kernel:
    """A compiled function: a part when a kernel calls it, a whole when Python calls it."""

    def __init__(self, function: Callable[..., object], options: dict[str, Any]) -> None:
        """Take the options of `njit`; compilation starts with the first call."""
        self.py_func = function
        self.targetoptions = options
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.part = _njit(pipeline_class=_PartCompiler, **wrappers, **options)(function)
        self.whole = _njit(cache=True, **options)(function)

    def __call__(self, *args: Any) -> Any:
        """Call the compiled or cached whole."""
        return self.whole(*args)


@typeof_impl.register(Kernel)
def _type_of_kernel(kernel: Kernel, _: Any) -> Any:
    return types.Dispatcher(kernel.part)
