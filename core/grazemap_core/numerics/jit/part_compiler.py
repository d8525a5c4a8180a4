"""Numba's compilers of kernels: of wholes, and of parts, which stops at LLVM's intermediate code.

In a kernel no index counts from the end of an array, so numba's test for that, a comparison and a choice at every
access, is left out.

This uses numba's interface for custom compiler passes, and three undocumented parts of numba: `JITCodeLibrary` with the
methods below, `fix_integer_index`, and the option `_nrt`. Importing this module fails where one of them is missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba import types
from numba.core import event, ir
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.cpu import CPUTargetOptions
from numba.core.typed_passes import NativeLowering
from numba.np import arrayobj

for _owner, _name in (
    (JITCodeLibrary, "_optimize_final_module"),
    (JITCodeLibrary, "_finalize_final_module"),
    (JITCodeLibrary, "_finalize_dynamic_globals"),
    (DefaultPassBuilder, "define_nopython_pipeline"),
    (CPUTargetOptions, "_nrt"),
    (arrayobj, "fix_integer_index"),
    (ir.Inst, "_rec_list_vars"),  # of quick_compiler, as the next
    (event, "broadcast"),
):
    getattr(_owner, _name)


class _PartLibrary(JITCodeLibrary):
    """Intermediate code of a part and of the parts that it calls; linked into callers, never run."""

    for_vectors = False

    def _optimize_final_module(self) -> None:
        if self.for_vectors:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


def _index_from_start(context: Any, builder: Any, kind: Any, index: Any, _: Any) -> Any:
    return context.cast(builder, index, kind, types.intp if kind.signed else types.uintp)


@contextmanager
def _indices_from_start() -> Iterator[None]:
    """Have numba, whose lock the caller holds, take every index as the distance from the start of an array."""
    of_numba = arrayobj.fix_integer_index
    arrayobj.fix_integer_index = _index_from_start
    try:
        yield
    finally:
        arrayobj.fix_integer_index = of_numba


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):
    """Numba's last pass, with all indices from the start."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        with _indices_from_start():
            done: bool = super().run_pass(state)
        return done


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(_KernelLowering):
    """The last pass, without the machine code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        library = _PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        library.for_vectors = bool(state.flags.fastmath) and not state.flags.forceinline
        state.library = library
        state.flags.no_compile = True
        super().run_pass(state)
        own: list[Any] = []
        name = own.append  # any unique builtin: numba identifies a compiled function by it
        state["cr"] = state["cr"]._replace(cfunc=name)
        state.targetctx.insert_user_function(name, state["cr"].fndesc, [library])
        return True


class KernelCompiler(CompilerBase):
    """Numba's compiler with another last pass."""

    lowering: type[_KernelLowering] = _KernelLowering
    """The last pass."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes, the last one replaced."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        last = [step for step, _ in passes.passes].index(NativeLowering)
        passes.passes[last] = (self.lowering, "native lowering of a kernel")
        passes._finalized = False
        passes.finalize()
        return [passes]


class PartCompiler(KernelCompiler):
    """Numba's compiler with another last pass, for parts."""

    lowering = _PartLowering
