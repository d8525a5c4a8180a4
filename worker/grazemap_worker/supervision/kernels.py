"""The kernels of this machine's workers, by steps: those of a first start, and those that jobs ask for.

The components of a step (`grazemap_core.warmup`) are compiled in processes of their own, into the cache. When all are
there the step is loaded here, so that workers that are forked afterwards have it. Two processes compile at a first
start where there are two cores: the component that carries the lanes of maps takes as long as all others that a map
needs or that come before it. Two stacks that start at once each compile what is missing, and wait for nothing; what one
of them has compiled, the other one loads.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from pkgutil import walk_packages

import structlog

import grazemap_core
from grazemap.module_command import module_command
from grazemap_core import kernel_folder, warmup
from grazemap_worker import watchdog
from grazemap_worker.liveness import Liveness
from grazemap_worker.parent_death import tied
from grazemap_worker.planning.costs import compiling_seconds
from grazemap_worker.settings import available_cores

# A process that compiles may be killed, as by a system without memory; what is not compiled then is left to tiles.
_MOST_TRIES = 3
_MOST_PROCESSES = 2


@dataclass
class _Compiler:
    """A process that compiles components one after another."""

    process: subprocess.Popen[bytes]
    """The process."""
    liveness: Liveness
    """Tells whether it goes on."""
    components: list[str]
    """Those that it still has to compile."""
    began: float
    """Since when it compiles the first of them."""


class Kernels:
    """The names of the steps that are loaded in this process (`ready`), and those that are compiled for it."""

    def __init__(self, steps: Iterable[str] = warmup.STEPS) -> None:
        self.ready: set[str] = set()
        self._wanted: list[str] = []
        self._done: set[str] = set()
        self._since: dict[str, float] = {}
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
        for compiler in self._compilers.values():
            while compiler.components and self._has(compiler.components[0]):
                compiler.components.pop(0)
                compiler.began = time.monotonic()
        for name in [name for name in self._wanted if all(map(self._has, warmup.components_of(name)))]:
            self._load(name)
        for compiler in self._compilers.values():
            if compiler.liveness.hangs(computing=True):
                self._log.warning("compiling hangs and is begun again", kernels=compiler.components[:1])
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
        for component in [component for component in compiler.components if not self._has(component)][:1]:
            self._tries[component] += 1
            self._log.warning("kernels not compiled", kernels=component, status=code, tries=self._tries[component])
            # an error of the kernels, or no space for them: the tile says what is wrong, or compiles them itself
            if code >= 0 or self._tries[component] >= _MOST_TRIES:
                self._done.add(component)

    def said(self) -> dict[str, str]:
        """Return, for each step that is not ready, what is done for it."""
        said = {name: f"{_label(name)}, after others" for name in self._wanted}
        for compiler in self._compilers.values():
            for name in [name for name in self._wanted if {*compiler.components[:1]} & {*warmup.components_of(name)}][
                :1
            ]:
                took, usual = time.monotonic() - self._since.setdefault(name, compiler.began), compiling_seconds(name)
                said[name] = f"{_label(name)}, compiling for {took:.0f} s (about {usual:.0f} s usually)"
        return said

    def stop(self) -> None:
        """End the processes that compile."""
        for compiler in self._compilers.values():
            compiler.process.kill()

    def _has(self, component: str) -> bool:
        """Return whether a component is stored, or given up; its entries are read once."""
        if component not in self._done and kernel_folder.holds(component):
            self._done.add(component)
        return component in self._done

    def _compile(self) -> None:
        """Start processes for what is wanted and not yet compiled by one."""
        most = min(_MOST_PROCESSES, available_cores())
        taken = {component for compiler in self._compilers.values() for component in compiler.components}
        wanted = dict.fromkeys(component for name in self._wanted for component in warmup.components_of(name))
        free = [component for component in wanted if component not in taken and not self._has(component)]
        lanes = [component for component in free if warmup.masses_of(component)]
        others = [component for component in free if component not in lanes]
        for components in (others, lanes) if most - len(self._compilers) > 1 else (free,):
            if components and len(self._compilers) < most:
                command = module_command("grazemap_core.warmup", *components)
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL, process_group=0, preexec_fn=tied())
                self._compilers[process.pid] = _Compiler(
                    process, Liveness(process.pid), list(components), time.monotonic()
                )

    def _load(self, name: str) -> None:
        try:
            with watchdog.beating():
                warmup.load(name)
        except Exception:
            # the tile itself will say what is wrong
            self._log.exception("kernels cannot be loaded", kernels=name)
        self._wanted.remove(name)
        self.ready.add(name)
        if not self._wanted:
            with watchdog.beating():
                import_core()


def import_core() -> None:
    """Import the modules of the core, so that no process of a tile does."""
    for module in walk_packages(grazemap_core.__path__, f"{grazemap_core.__name__}."):
        try:
            import_module(module.name)
        except ModuleNotFoundError as error:
            if error.name != "flint":  # python-flint is optional
                raise


def _label(name: str) -> str:
    masses = warmup.masses_of(name)
    of_masses = f" of {masses} mass{'' if masses == 1 else 'es'}" if masses else ""
    return f"kernels for {name.partition('-')[0].replace('_', ' ')}{of_masses}"
