"""Compiles and loads the kernels of this machine's workers: those of a first start, and those that jobs need.

Kernels are compiled in steps, and a step has components (`grazemap_core.warmup`). Child processes compile the
components into the cache folder. When all components of a step are there, this process loads the step; workers that are
forked afterwards have it. With two cores or more, two processes compile at a first start: one compiles the component
with the lanes of maps, which takes as long as all other components together that a map needs. Two stacks that start at
the same time do not wait for each other. Each compiles what is missing, and loads what the other has compiled.
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

# A compiling process may be killed, for example when memory is short. A component that was not compiled in so many
# attempts is compiled when a tile needs it.
_MAX_TRIES = 3
_MAX_PROCESSES = 2


@dataclass
class _Compiler:
    """A child process that compiles components one after another."""

    process: subprocess.Popen[bytes]
    """The child process."""
    liveness: Liveness
    """Tells whether the process hangs."""
    components: list[str]
    """The components that are not compiled yet; the process compiles the first of them now."""
    began: float
    """When it began with the first component, in monotonic seconds."""


class Kernels:
    """The steps of kernels that this process has loaded (`ready`), and those that are being compiled."""

    def __init__(self, steps: Iterable[str] = warmup.STEPS) -> None:
        self.ready: set[str] = set()
        self._wanted: list[str] = []
        self._done: set[str] = set()
        self._since: dict[str, float] = {}
        self._compilers: dict[int, _Compiler] = {}
        self._tries: Counter[str] = Counter()
        self._reported_ready = 0
        self._log = structlog.get_logger("grazemap_worker")
        self.want(steps)

    def want(self, names: Iterable[str]) -> None:
        """Ask for steps by name; a name that is not a step is ignored."""
        for name in names:
            if warmup.is_step(name) and name not in self.ready and name not in self._wanted:
                self._wanted.append(name)

    def advance(self) -> bool:
        """Load compiled steps and start compiling others; return whether more are ready than after the last call."""
        for compiler in self._compilers.values():
            while compiler.components and self._has(compiler.components[0]):
                compiler.components.pop(0)
                compiler.began = time.monotonic()
        for name in [name for name in self._wanted if all(map(self._has, warmup.components_of(name)))]:
            self._load(name)
        for compiler in self._compilers.values():
            if compiler.liveness.hangs(computing=True):
                self._log.warning("compiling hangs and is begun again", kernels=compiler.components[:1])
                os.kill(compiler.process.pid, signal.SIGKILL)  # Popen.kill may reap it, and `ended` would miss it
        self._compile()
        before, self._reported_ready = self._reported_ready, len(self.ready)
        return self._reported_ready > before

    def ended(self, pid: int, status: int) -> None:
        """Record that a child of this process has ended, with its wait status."""
        compiler = self._compilers.pop(pid, None)
        if compiler is None:
            return
        code = compiler.process.returncode = os.waitstatus_to_exitcode(status)
        for component in [component for component in compiler.components if not self._has(component)][:1]:
            self._tries[component] += 1
            self._log.warning("kernels not compiled", kernels=component, status=code, tries=self._tries[component])
            # an error in the kernels, or a full disk: the tile that needs them reports the error, or compiles them
            if code >= 0 or self._tries[component] >= _MAX_TRIES:
                self._done.add(component)

    def status_texts(self) -> dict[str, str]:
        """Return a text for each step that is not ready: what is being compiled, and for how long."""
        texts = {name: f"{_label(name)}, after others" for name in self._wanted}
        for compiler in self._compilers.values():
            for name in [name for name in self._wanted if {*compiler.components[:1]} & {*warmup.components_of(name)}][
                :1
            ]:
                took, usual = time.monotonic() - self._since.setdefault(name, compiler.began), compiling_seconds(name)
                texts[name] = f"{_label(name)}, compiling for {took:.0f} s (about {usual:.0f} s usually)"
        return texts

    def stop(self) -> None:
        """Kill the compiling processes."""
        for compiler in self._compilers.values():
            compiler.process.kill()

    def _has(self, component: str) -> bool:
        """Return whether a component is in the cache or was given up. A positive answer is remembered."""
        if component not in self._done and kernel_folder.holds(component):
            self._done.add(component)
        return component in self._done

    def _compile(self) -> None:
        """Start processes for the wanted components that no process compiles yet."""
        max_processes = min(_MAX_PROCESSES, available_cores())
        taken = {component for compiler in self._compilers.values() for component in compiler.components}
        wanted = dict.fromkeys(component for name in self._wanted for component in warmup.components_of(name))
        free = [component for component in wanted if component not in taken and not self._has(component)]
        lanes = [component for component in free if warmup.masses_of(component)]
        rest = [component for component in free if component not in lanes]
        for components in (rest, lanes) if max_processes - len(self._compilers) > 1 else (free,):
            if components and len(self._compilers) < max_processes:
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
            # a tile that needs the kernels will report the error
            self._log.exception("kernels cannot be loaded", kernels=name)
        self._wanted.remove(name)
        self.ready.add(name)
        if not self._wanted:
            with watchdog.beating():
                import_core()


def import_core() -> None:
    """Import the modules of the core, so that compute processes need not import them."""
    for module in walk_packages(grazemap_core.__path__, f"{grazemap_core.__name__}."):
        try:
            import_module(module.name)
        except ModuleNotFoundError as error:
            if error.name != "flint":  # python-flint is optional
                raise


def _label(name: str) -> str:
    masses = warmup.masses_of(name)
    masses_text = f" of {masses} mass{'' if masses == 1 else 'es'}" if masses else ""
    return f"kernels for {name.partition('-')[0].replace('_', ' ')}{masses_text}"
