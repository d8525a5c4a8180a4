"""The kernels that the workers of this machine have: those of the warm-up, and those that jobs ask for.

The kernels of maps have the number of masses as a constant. Those for another number than that of the warm-up are
compiled before any tile that needs them, in one process, and then loaded here, so that workers that are forked later
have them. An empty file beside the compiled kernels says which are cached.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Iterable
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

import structlog

from grazemap_worker import watchdog
from grazemap_worker.parent_death import die_with_parent
from grazemap_worker.planning import COMPILING_SECONDS
from grazemap_worker.progress import Progress

MAPS = "maps-"
WARM = ("core", f"{MAPS}3")
"""The kernels of the warm-up."""
_MARK = "compiled-"


class Kernels:
    """The names of the kernels that are loaded in this process (`ready`), and those that are compiled for it."""

    def __init__(self) -> None:
        self.ready = set(WARM)
        self._wanted: list[str] = []
        self._process: BaseProcess | None = None
        self._began = 0.0

    def want(self, names: Iterable[str]) -> None:
        """Ask for kernels; names that are not of kernels for maps are ignored."""
        for name in sorted(names):
            if name.removeprefix(MAPS).isdigit() and name not in self.ready and name not in self._wanted:
                self._wanted.append(name)

    def advance(self) -> bool:
        """Go on with what is wanted, a step at a time; return whether more kernels are ready."""
        if not self._wanted:
            return False
        name = self._wanted[0]
        if self._process is None and not _mark(name).exists():
            self._began = time.monotonic()
            context = multiprocessing.get_context("spawn")
            self._process = context.Process(target=_compile, args=(masses_of(name), os.getpid()), daemon=True)
            self._process.start()
            self._progress = Progress(self._process.pid or 0)
            return False
        if self._process is not None:
            # not is_alive(), which never learns of the end of a process that the supervisor has waited for
            if not wait([self._process.sentinel], 0):
                if self._progress.hangs(computing=True):
                    structlog.get_logger("grazemap_worker").warning("compiling hangs and is begun again", kernels=name)
                    self._process.kill()
                    self._process = None
                return False
            self._process = None
        try:
            with watchdog.beating():
                compile_maps(masses_of(name))  # loads them; if they do not compile, the tile itself will say why
            _mark(name).touch()
        except Exception:
            structlog.get_logger("grazemap_worker").exception("kernels cannot be loaded", kernels=name)
        self._wanted.remove(name)
        self.ready.add(name)
        return True

    def said(self) -> dict[str, str]:
        """Return, for each of the kernels that jobs wait for, what is done for them."""
        said = {}
        for place, name in enumerate(self._wanted):
            masses = masses_of(name)
            kernels = f"kernels for {masses} mass{'' if masses == 1 else 'es'}"
            took = time.monotonic() - self._began
            usual = f"(about {COMPILING_SECONDS:.0f} s usually)"
            said[name] = f"{kernels}, compiling for {took:.0f} s {usual}" if place == 0 else f"{kernels}, after others"
        return said

    def stop(self) -> None:
        """End the process that compiles."""
        if self._process is not None:
            self._process.kill()


def masses_of(name: str) -> int:
    """Return the number of masses that kernels are for."""
    return int(name.removeprefix(MAPS))


def _compile(masses: int, parent: int) -> None:
    die_with_parent(parent)
    compile_maps(masses)


def compile_maps(masses: int) -> None:
    """Compile the kernels of maps for a number of masses, or load them from the cache."""
    import numpy as np

    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.model.oscillator import Oscillator

    ones, forcing = [1.0] * masses, [1.0] + [0.0] * (masses - 1)
    for damping in (0.05, [0.05] * masses):
        oscillator = Oscillator.create(ones, ones, damping, forcing, 0.8)
        unfolding_map_tile(oscillator, np.array([0.28, 0.29]), np.array([1.6]), max_periods=4, max_period=2)


def _mark(name: str) -> Path:
    """Return the file that says that kernels are in the cache of this version of the core."""
    from numba.core import config

    import grazemap_core  # noqa: F401 - chooses the folder

    return Path(config.CACHE_DIR) / f"{_MARK}{name}"  # type: ignore[attr-defined]  # set when numba is imported
