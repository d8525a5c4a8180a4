"""Notices that a tile compiles kernels.

The warm-up compiles every kernel for three masses. The kernels of maps have the number of masses as a constant, so the
first map of a chain with another number compiles them again, inside its tile.
"""

from __future__ import annotations

import time
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
        began: tuple[float, float] | None = None

        def on_start(self, _: Any) -> None:
            self.depth += 1
            if self.began is None:
                self.began = time.monotonic(), time.process_time()
                stack.enter_context(said(say, self.text))

        def on_end(self, _: Any) -> None:
            self.depth -= 1

        def text(self) -> str:
            if not self.depth or self.began is None:
                return ""
            elapsed, computed = time.monotonic() - self.began[0], time.process_time() - self.began[1]
            # beside other processes it takes longer
            left = max(1.0, (SECONDS - computed) * (elapsed / computed if elapsed > 1.0 else 1.0))
            return f"the compilation of kernels for {masses} mass{'' if masses == 1 else 'es'}, about {left:.0f} s"

    with ExitStack() as stack, event.install_listener("numba:compile", Compilations()):
        yield
