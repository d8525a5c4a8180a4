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
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from pkgutil import walk_packages
from typing import IO

import structlog

import grazemap_core
from grazemap.module_command import module_command
from grazemap_core import kernel_folder, warmup
from grazemap_worker import watchdog
from grazemap_worker.environment import ONE_THREAD
from grazemap_worker.liveness import Liveness
from grazemap_worker.planning.kernel_steps import (
    COMPONENT_SECONDS,
    FIRST_STEPS,
    OF_LANES,
    STEPS,
    components_of,
    is_step,
    shares,
)
from grazemap_worker.system import available_cores, tied

# A compiling process may be killed, for example when memory is short. After so many killed attempts, a component is
# given up here, and is compiled when a tile needs it.
_MAX_TRIES = 3
_MAX_PROCESSES = 2
# A component that took a smaller share of its usual time was compiled by another stack, or most of its kernels were.
# The share of the time spent on a component that it takes at least from now on.
_OVERDUE = 0.25
_CACHED_SHARE = 0.3
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
    began: float
    """When it began with this one."""
    given: set[str] = field(default_factory=set)
    """All components that it was given."""

    def give(self, component: str) -> None:
        """Have the process compile a component after the others."""
        self.given.add(component)
        self.components.append(component)
        with suppress(BrokenPipeError):  # it has ended, and its components are compiled by another one
            self._input.write(f"{component}\n".encode())
            self._input.flush()

    @property
    def ends(self) -> bool:
        """Whether the process was told to end."""
        return self._input.closed

    def end(self) -> None:
        """Let the process end when it has compiled its components."""
        with suppress(BrokenPipeError):
            self._input.close()

    @property
    def _input(self) -> IO[bytes]:
        assert self.process.stdin is not None
        return self.process.stdin


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
        # seconds in which components were compiled here, and in which they usually are
        self._took = self._usual = 0.0
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
                usual, now = COMPONENT_SECONDS[compiler.components.pop(0)], time.monotonic()
                if now - compiler.began > _CACHED_SHARE * usual:
                    self._took, self._usual = self._took + now - compiler.began, self._usual + usual
                compiler.began = now
        self._compile()
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
        compiler.end()
        for component in [component for component in compiler.components if not self._is_settled(component)][:1]:
            self._tries[component] += 1
            self._log.warning("kernels not compiled", kernels=component, status=code, tries=self._tries[component])
            if code >= 0:
                # an error in the kernels, or a full disk: `_load` reports the error, or compiles them
                self._settled.add(component)
            elif self._tries[component] >= _MAX_TRIES:
                self._settled.add(component)
                self._given_up.add(component)

    def waits(self) -> dict[str, float]:
        """Return for each step that is not ready in how many seconds it usually is, if it is wanted now."""
        now, done = time.monotonic(), dict[str, float]()
        running = [compiler for compiler in self._compilers.values() if compiler.components]
        overdue = [(now - compiler.began) / COMPONENT_SECONDS[compiler.components[0]] for compiler in running]
        pace = max(self._took / self._usual if self._usual else 1.0, *overdue, 0.0)
        free = [0.0] * (min(_MAX_PROCESSES, available_cores()) - len(self._compilers))
        for compiler in self._compilers.values():
            after, spent = 0.0, now - compiler.began
            for component in compiler.components:
                # what takes longer than usual takes longer still
                after += max(pace * COMPONENT_SECONDS[component] - spent, _OVERDUE * spent)
                done[component], spent = after, 0.0
            free.append(after)
        waits: dict[str, float] = {}
        for step in [*self._wanted, *STEPS]:
            if step not in waits and step not in self.ready:
                ends, processes = dict(done), list(free)
                for component in components_of(step):
                    if component not in ends and not self._is_settled(component):
                        place = processes.index(min(processes))
                        processes[place] += pace * COMPONENT_SECONDS[component]
                        ends[component] = processes[place]
                waits[step] = max((ends.get(component, 0.0) for component in components_of(step)), default=0.0)
                if step in self._wanted:
                    done, free = ends, processes
        return waits

    def status_texts(self, waits: Mapping[str, float]) -> dict[str, str]:
        """Return a text for each wanted step: in how many seconds it is ready, from `waits`."""
        return {name: f"{_label(name)}, ready in about {waits[name]:.0f} s" for name in self._wanted}

    def stop(self) -> None:
        """Kill the compiling processes, and wait for their ends."""
        for compiler in self._compilers.values():
            compiler.process.kill()
        for compiler in self._compilers.values():
            compiler.process.wait()
            compiler.end()

    def _is_settled(self, component: str) -> bool:
        """Return whether a component is not to be compiled any more: it is in the cache, or its compilation has failed.

        A positive answer is remembered.
        """
        if component not in self._settled and kernel_folder.holds(component):
            self._settled.add(component)
        return component in self._settled

    def _compile(self) -> None:
        """Give the wanted components that no process compiles yet to processes, and let those end that have none."""
        being_compiled = {component for compiler in self._compilers.values() for component in compiler.components}
        wanted = dict.fromkeys(component for name in self._wanted for component in components_of(name))
        missing = [name for name in wanted if name not in being_compiled and not self._is_settled(name)]
        free = min(_MAX_PROCESSES, available_cores()) - len(self._compilers)
        if free > 0:
            for components in shares(missing) if free > 1 else (missing,):
                if components:
                    self._start(components)
        else:
            for component in missing:
                self._give_to_one_that_runs(component)
        for compiler in self._compilers.values():
            if not compiler.components:
                compiler.end()

    def _start(self, components: Sequence[str]) -> None:
        command = module_command("grazemap_core.warmup", "-")
        environment = {**os.environ, **dict.fromkeys(ONE_THREAD, "1"), **kernel_folder.environment()}
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, process_group=0, preexec_fn=_guest(), env=environment
        )
        compiler = _Compiler(process, Liveness(process.pid), [], time.monotonic())
        self._compilers[process.pid] = compiler
        for component in components:
            compiler.give(component)

    def _give_to_one_that_runs(self, component: str) -> None:
        """Give a component to the process that compiles lanes if it is one of these, else to the one with less to do.

        What a process has compiled it need not compile again, and the components of lanes have much in common.
        """
        running = [compiler for compiler in self._compilers.values() if not compiler.ends]
        of_lanes = [compiler for compiler in running if not compiler.given.isdisjoint(OF_LANES)]
        for compiler in sorted((component in OF_LANES and of_lanes) or running, key=self._seconds_left)[:1]:
            compiler.give(component)

    def _seconds_left(self, compiler: _Compiler) -> float:
        return sum(COMPONENT_SECONDS[component] for component in compiler.components)

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
