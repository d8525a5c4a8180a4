"""Notices that a tile compiles kernels.

The warm-up compiles every kernel for three masses. The kernels of maps have the number of masses as a constant, so the
first map of a chain with another number compiles them again, inside its tile.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from grazemap_worker.said import said

SECONDS = 30.0
"""The time in which one core of a server compiles, roughly, the kernels of maps for another number of masses."""


@contextmanager
def compiling_said(say: Callable[[str], None], masses: int) -> Iterator[None]:
    """Call `say` once a second while numba compiles within this block, with what is compiled and how long it takes.

    Kernels that are loaded from the cache are not compiled. Once something was compiled, `say("")` is called where
    nothing is compiled, and at the end.
    """
    from numba.core import event

    class Compilations(event.Listener):
        """Counts the compilations in progress; one contains those of the functions that it calls."""

        depth = 0
        said = False

        def on_start(self, _: Any) -> None:
            self.depth += 1
            if not self.said:
                self.said = True
                stack.enter_context(said(say, self.text))

        def on_end(self, _: Any) -> None:
            self.depth -= 1

        def text(self) -> str:
            # not the seconds that are left, as it may take three times as long on a busy machine
            kernels = f"kernels for {masses} mass{'' if masses == 1 else 'es'}"
            return f"{kernels}, about {SECONDS:.0f} s to compile" if self.depth else ""

    with ExitStack() as stack, event.install_listener("numba:compile", Compilations()):
        yield
