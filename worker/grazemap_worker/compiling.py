"""Notices that a tile compiles kernels, and remembers for which numbers of masses they are compiled.

The warm-up compiles every kernel for three masses. The kernels of maps have the number of masses as a constant, so the
first map of a chain with another number compiles them again, inside its tile. An empty file beside the compiled kernels
then says so: it is removed with them, and another version of the core has another folder.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from grazemap_worker.planning import COMPILING_SECONDS
from grazemap_worker.said import said

WARM = 3
"""The number of masses for which the warm-up compiles."""
_MARK = "compiled-for-"


def compiled_here() -> set[int]:
    """Return the numbers of masses for which the kernels of maps are compiled on this machine; imports the core."""
    marks = _folder().glob(f"{_MARK}*")
    return {WARM, *(int(mark.name.removeprefix(_MARK)) for mark in marks)}


def remember_compiled(masses: int) -> bool:
    """Remember that a map of a chain was computed on this machine; return whether that was not known yet."""
    mark = _folder() / f"{_MARK}{masses}"
    if masses == WARM or mark.exists():
        return False
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()
    return True


def _folder() -> Path:
    """Return the folder of the kernels of this version of the core."""
    from numba.core import config

    import grazemap_core  # noqa: F401 - chooses the folder

    return Path(config.CACHE_DIR)  # type: ignore[attr-defined]  # set when numba is imported


@contextmanager
def compiling_said(say: Callable[[str], None], masses: int) -> Iterator[None]:
    """Call `say` once a second while numba compiles within this block, with what is compiled and for how long so far.

    Kernels that are loaded from the cache are not compiled. Once something was compiled, `say("")` is called where
    nothing is compiled, and at the end.
    """
    from numba.core import event

    class Compilations(event.Listener):
        """Counts the compilations in progress; one contains those of the functions that it calls."""

        depth = 0
        said = False
        began = 0.0

        def on_start(self, _: Any) -> None:
            self.depth += 1
            if not self.said:
                self.said = True
                self.began = time.monotonic()
                stack.enter_context(said(say, self.text))

        def on_end(self, _: Any) -> None:
            self.depth -= 1

        def text(self) -> str:
            if not self.depth:
                return ""
            # not the seconds that are left, as it may take three times as long on a busy machine
            kernels = f"kernels for {masses} mass{'' if masses == 1 else 'es'}"
            took = time.monotonic() - self.began
            return f"{kernels}, compiling for {took:.0f} s (about {COMPILING_SECONDS:.0f} s usually)"

    with ExitStack() as stack, event.install_listener("numba:compile", Compilations()):
        yield
