"""Compiles and loads kernels for the workers of this machine: some at the first start, others when jobs need them.

Kernels are compiled in steps, and a step has components (`kernel_steps`). Child processes compile the components into
the cache folder. When all components of a step are there, this process loads the step; workers that are forked
afterwards have it. With two cores or more, two processes compile, which share the components so that a map can be
computed soon. Two stacks that start at the same time do not wait for each other. Each compiles what is missing, and
loads what the other has compiled.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from pkgutil import walk_packages

import structlog

import grazemap_core
from grazemap.module_command import module_command
from grazemap_core import kernel_folder, warmup
from grazemap_worker import watchdog
from grazemap_worker.environment import ONE_THREAD
from grazemap_worker.liveness import Liveness
from grazemap_worker.planning.kernel_steps import FIRST_STEPS, compiling_seconds, components_of, is_step, shares
from grazemap_worker.system import available_cores, tied

# A compiling process may be killed, for example when memory is short. After so many killed attempts, a component is
# given up here, and is compiled when a tile needs it.
_MAX_TRIES = 3
_MAX_PROCESSES = 2
# The lowest priority: questions are answered, and tiles are computed, before kernels are compiled.
_NICENESS = 19


@dataclass
class _Compiler:
    """A child process that compiles components one after another."""

    process: subprocess.Popen[bytes]
    """The child process."""
    liveness: Liveness
    """Tells whether the process hangs."""
    components: list[str]
    """The components that are not compiled yet; the process compiles the first of them now."""


class Kernels:
    """The steps of kernels that are being compiled, and those for which nothing more is done here (`ready`).

    A step is ready when it is loaded, could not be loaded, or has a component that was given up. Without `load` it is
    ready when it is compiled.
    """

    def __init__(self, steps: Iterable[str] = FIRST_STEPS, *, load: bool = True) -> None:
        self._loads = load
        self.ready: set[str] = set()
        self._wanted: list[str] = []
        self._settled: set[str] = set()
        self._given_up: set[str] = set()
        self._step_began: dict[str, tuple[float, float]] = {}  # when, and how long it usually takes
        self._compilers: dict[int, _Compiler] = {}
        self._tries: Counter[str] = Counter()
        self._reported_ready = 0
        self._log = structlog.get_logger("grazemap_worker")
        self.want(steps)

    def want(self, names: Iterable[str]) -> None:
        """Ask for steps by name; a name that is not a step is ignored."""
        for name in names:
            if is_step(name) and name not in self.ready and name not in self._wanted:
                self._wanted.append(name)

    def advance(self) -> bool:
        """Load compiled steps and start compiling others; return whether a step became ready since the last call."""
        for compiler in self._compilers.values():
            while compiler.components and self._is_settled(compiler.components[0]):
                compiler.components.pop(0)
        self._compile()
        for compiler in self._compilers.values():
            if (step := self._step_of(compiler)) is not None:
                self._step_began.setdefault(step, (time.monotonic(), compiling_seconds(step, self._settled)))
        compiled = [name for name in self._wanted if all(map(self._is_settled, components_of(name)))]
        for name in compiled if self.ready else compiled[:1]:  # the first workers do not wait for all of them
            self._load(name)
        for compiler in self._compilers.values():
            if compiler.liveness.hangs(computing=True):
                self._log.warning("compiling hangs, its process is killed", kernels=compiler.components[:1])
                os.kill(compiler.process.pid, signal.SIGKILL)  # Popen.kill may reap it, and `ended` would miss it
        before, self._reported_ready = self._reported_ready, len(self.ready)
        return self._reported_ready > before

    def look(self) -> None:
        """Record which of the compiling processes have ended, in a process that waits for no children itself."""
        for pid, compiler in list(self._compilers.items()):
            if (code := compiler.process.poll()) is not None:
                self.ended(pid, code)

    def ended(self, pid: int, code: int) -> None:
        """Record that a child of this process has ended, with its exit code."""
        compiler = self._compilers.pop(pid, None)
        if compiler is None:
            return
        compiler.process.returncode = code
        for component in [component for component in compiler.components if not self._is_settled(component)][:1]:
            self._tries[component] += 1
            self._log.warning("kernels not compiled", kernels=component, status=code, tries=self._tries[component])
            if code >= 0:
                # an error in the kernels, or a full disk: `_load` reports the error, or compiles them
                self._settled.add(component)
            elif self._tries[component] >= _MAX_TRIES:
                self._settled.add(component)
                self._given_up.add(component)

    def status_texts(self) -> dict[str, str]:
        """Return a text for each step that is not ready: what is being compiled, and for how long."""
        texts = {name: f"{_label(name)}, after others" for name in self._wanted}
        for compiler in self._compilers.values():
            name = self._step_of(compiler)
            if name is not None:
                began, usual = self._step_began.get(name, (time.monotonic(), compiling_seconds(name, self._settled)))
                took = time.monotonic() - began
                texts[name] = f"{_label(name)}, compiling for {took:.0f} s (about {usual:.0f} s usually)"
        return texts

    def stop(self) -> None:
        """Kill the compiling processes, and wait for their ends."""
        for compiler in self._compilers.values():
            compiler.process.kill()
        for compiler in self._compilers.values():
            compiler.process.wait()

    def _step_of(self, compiler: _Compiler) -> str | None:
        """Return the first wanted step that needs the component which a process compiles now; None if there is none."""
        component = next(iter(compiler.components), None)
        return next((name for name in self._wanted if component in components_of(name)), None)

    def _is_settled(self, component: str) -> bool:
        """Return whether a component is not to be compiled any more: it is in the cache, or its compilation has failed.

        A positive answer is remembered.
        """
        if component not in self._settled and kernel_folder.holds(component):
            self._settled.add(component)
        return component in self._settled

    def _compile(self) -> None:
        """Start processes for the wanted components that no process compiles yet."""
        max_processes = min(_MAX_PROCESSES, available_cores())
        being_compiled = {component for compiler in self._compilers.values() for component in compiler.components}
        wanted = dict.fromkeys(component for name in self._wanted for component in components_of(name))
        missing = [name for name in wanted if name not in being_compiled and not self._is_settled(name)]
        for components in shares(missing) if max_processes - len(self._compilers) > 1 else (missing,):
            if components and len(self._compilers) < max_processes:
                command = module_command("grazemap_core.warmup", *components)
                environment = {**os.environ, **dict.fromkeys(ONE_THREAD, "1"), **kernel_folder.environment()}
                process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, process_group=0, preexec_fn=_guest(), env=environment
                )
                self._compilers[process.pid] = _Compiler(process, Liveness(process.pid), list(components))

    def _load(self, name: str) -> None:
        """Load a step, unless one of its components was given up: this process would compile the component."""
        if self._loads and self._given_up.isdisjoint(components_of(name)):
            try:
                with watchdog.beating():
                    warmup.load(components_of(name))
            except Exception:
                # a tile that needs the kernels will report the error
                self._log.exception("kernels cannot be loaded", kernels=name)
        self._wanted.remove(name)
        self.ready.add(name)
        if not self._wanted and self._loads:
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


def _guest() -> Callable[[], None]:
    """Return the `preexec_fn` of a process that compiles: it ends with this process, and gives way to all others."""
    tie = tied()

    def begin() -> None:
        tie()
        os.nice(_NICENESS)

    return begin


def _label(name: str) -> str:
    return f"kernels for {name.replace('_', ' ')}"
