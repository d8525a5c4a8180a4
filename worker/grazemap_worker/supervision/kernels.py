"""The kernels of this machine's workers, by steps: those of a first start, and those that jobs ask for.

A step (`grazemap_core.warmup`) is compiled in a process of its own, into the cache, and then loaded here, so that
workers that are forked afterwards have it. Two processes compile at a first start where there are two cores: the
kernels of maps take as long as all others. Two stacks that start at once each compile what is missing, and wait for
nothing; what one of them has compiled, the other one loads.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import structlog

from grazemap_core import kernel_folder, warmup
from grazemap_worker import watchdog
from grazemap_worker.parent_death import tied
from grazemap_worker.planning import compiling_seconds
from grazemap_worker.progress import Progress
from grazemap_worker.settings import available_cores

# A process that compiles may be killed, as by a system without memory; what is not compiled then is left to tiles.
_MOST_TRIES = 3
_MOST_PROCESSES = 2


@dataclass
class _Compiler:
    """A process that compiles steps one after another: those that it has not compiled yet, since when the first."""

    process: subprocess.Popen[bytes]
    progress: Progress
    steps: list[str]
    began: float


class Kernels:
    """The names of the steps that are loaded in this process (`ready`), and those that are compiled for it."""

    def __init__(self, steps: Iterable[str] = warmup.STEPS) -> None:
        self.ready: set[str] = set()
        self._wanted: list[str] = []
        self._compilers: dict[int, _Compiler] = {}
        self._tries: Counter[str] = Counter()
        self._said_ready = 0
        self._log = structlog.get_logger("grazemap_worker")
        self.want(steps)

    def want(self, names: Iterable[str]) -> None:
        """Ask for steps; names that are none are ignored."""
        for name in names:
            if warmup.is_step(name) and name not in self.ready and name not in self._wanted:
                self._wanted.append(name)

    def advance(self) -> bool:
        """Load what is compiled, and go on compiling; return whether more is ready than the last time."""
        for name in [name for name in self._wanted if kernel_folder.holds(name)]:
            self._load(name)
        for compiler in self._compilers.values():
            if compiler.progress.hangs(computing=True):
                self._log.warning("compiling hangs and is begun again", kernels=compiler.steps[:1])
                os.kill(compiler.process.pid, signal.SIGKILL)  # not Popen.kill, which may hide its end from `ended`
        self._compile()
        before, self._said_ready = self._said_ready, len(self.ready)
        return self._said_ready > before

    def ended(self, pid: int, status: int) -> None:
        """Take note of a child of this process that has ended, with its wait status."""
        compiler = self._compilers.pop(pid, None)
        if compiler is None:
            return
        code = compiler.process.returncode = os.waitstatus_to_exitcode(status)
        for name in [name for name in compiler.steps if not kernel_folder.holds(name)][:1]:
            self._tries[name] += 1
            self._log.warning("kernels not compiled", kernels=name, status=code, tries=self._tries[name])
            # an error of the kernels, or no space for them: the tile says what is wrong, or compiles them itself
            if code >= 0 or self._tries[name] >= _MOST_TRIES:
                self._load(name)

    def said(self) -> dict[str, str]:
        """Return, for each step that is not ready, what is done for it."""
        said = {name: f"{_label(name)}, after others" for name in self._wanted}
        for compiler in self._compilers.values():
            for name in compiler.steps[:1]:
                took, usual = time.monotonic() - compiler.began, compiling_seconds(name)
                said[name] = f"{_label(name)}, compiling for {took:.0f} s (about {usual:.0f} s usually)"
        return said

    def stop(self) -> None:
        """End the processes that compile."""
        for compiler in self._compilers.values():
            compiler.process.kill()

    def _compile(self) -> None:
        """Start processes for what is wanted and not yet compiled by one."""
        most = min(_MOST_PROCESSES, available_cores())
        taken = {name for compiler in self._compilers.values() for name in compiler.steps}
        free = [name for name in self._wanted if name not in taken]
        maps = [name for name in free if warmup.masses_of(name)]
        others = [name for name in free if name not in maps]
        for steps in (others, maps) if most - len(self._compilers) > 1 else (free,):
            if steps and len(self._compilers) < most:
                command = [sys.executable, "-m", "grazemap_core.warmup", *steps]
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL, process_group=0, preexec_fn=tied())
                self._compilers[process.pid] = _Compiler(process, Progress(process.pid), list(steps), time.monotonic())

    def _load(self, name: str) -> None:
        try:
            with watchdog.beating():
                warmup.load(name)
        except Exception:
            # the tile itself will say what is wrong
            self._log.exception("kernels cannot be loaded", kernels=name)
        self._wanted.remove(name)
        self.ready.add(name)
        for compiler in self._compilers.values():
            if name in compiler.steps:
                compiler.steps.remove(name)
                compiler.began = time.monotonic()


def _label(name: str) -> str:
    masses = warmup.masses_of(name)
    of_masses = f" of {masses} mass{'' if masses == 1 else 'es'}" if masses else ""
    return f"kernels for {name.partition('-')[0]}{of_masses}"
