"""Numba's compiler for parts: it stops at LLVM's intermediate code.

It uses numba's interface for custom compiler passes, and two undocumented parts of numba: `JITCodeLibrary` with the
methods below, and the option `_nrt`. Importing this module fails where one of them is missing.
"""

from __future__ import annotations

from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.cpu import CPUTargetOptions
from numba.core.typed_passes import NativeLowering

for _owner, _name in (
    (JITCodeLibrary, "_optimize_final_module"),
    (JITCodeLibrary, "_finalize_final_module"),
    (JITCodeLibrary, "_finalize_dynamic_globals"),
    (DefaultPassBuilder, "define_nopython_pipeline"),
    (CPUTargetOptions, "_nrt"),
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
        name = own.append  # any unique builtin: numba identifies a compiled function by it
        state["cr"] = state["cr"]._replace(cfunc=name)
        state.targetctx.insert_user_function(name, state["cr"].fndesc, [library])
        return True


class PartCompiler(CompilerBase):
    """Numba's compiler, with `_PartLowering` as its last pass."""

    def define_pipelines(self) -> list[Any]:
        """Return numba's passes, the last one replaced."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        last = [step for step, _ in passes.passes].index(NativeLowering)
        passes.passes[last] = (_PartLowering, "native lowering of a part")
        passes._finalized = False
        passes.finalize()
        return [passes]
