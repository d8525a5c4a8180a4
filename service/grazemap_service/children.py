"""The child processes of the stack: started, watched, restarted and stopped; they end when the stack ends."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

import structlog

from grazemap_service.liveness import Liveness
from grazemap_worker.parent_death import tied

# A child that lived this long is not part of a crash loop; others wait 0.2, 0.4, ... s before the next start.
HEALTHY_SECONDS = 10.0
LONGEST_WAIT = 5.0
MOST_LOG_BYTES = 10_000_000
_TAIL_BYTES = 4000


class Child(ABC):
    """A process that the stack watches.

    Attributes
    ----------
    name : str
    log : Path
        The file to which it appends what it says; it has at most about `MOST_LOG_BYTES`, and `.1` what was before.
    deaths : int
        Number of recent deaths.
    """

    name: str
    log: Path
    deaths = 0
    _inherited: tuple[int, ...] = ()
    _process: subprocess.Popen[bytes] | None = None
    _started = 0.0
    _not_before = 0.0
    _up = False

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self._process is not None and self._process.poll() is None

    @property
    def pid(self) -> int | None:
        """Process id of the last start."""
        return self._process.pid if self._process else None

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it lives or was never started."""
        return self._process.returncode if self._process else None

    def start(self) -> None:
        """Start it; does not wait."""
        self._started, self._up = time.monotonic(), True
        self._process = self._spawned()

    def look(self) -> bool:
        """Start it again if it ended and its pause is over. Returns whether this call noticed its end."""
        bound_log(self.log)
        self.end_if_hung()
        if self.running:
            return False
        now = time.monotonic()
        if self._up:
            self._up = False
            self.deaths = 1 if now - self._started > HEALTHY_SECONDS else self.deaths + 1
            self._not_before = now + (min(LONGEST_WAIT, 0.1 * 2**self.deaths) if self.deaths > 1 else 0.0)
            return True
        if now >= self._not_before:
            self.start()
        return False

    def ask_to_stop(self) -> None:
        """Send SIGTERM."""
        if self.running and self._process:
            self._process.terminate()

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline` (monotonic seconds), then kill it."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def end_if_hung(self) -> None:
        """Kill it if it lives but no longer responds; what it has started ends with it."""
        if self._process is not None and self.running and (reason := self.hangs()):
            structlog.get_logger("grazemap_service.stack").warning("child killed", child=self.name, reason=reason)
            self._process.kill()

    @abstractmethod
    def hangs(self) -> str:
        """Return why it counts as hung; empty if it does not. It is called several times a second while it runs."""

    @abstractmethod
    def last_words(self) -> str:
        """Return the end of its log."""

    @abstractmethod
    def _spawned(self) -> subprocess.Popen[bytes]:
        """Return the process, started by `_popen`."""

    def _popen(
        self,
        command: Sequence[str],
        output: int | IO[bytes],
        at_death: signal.Signals,
        environment: Mapping[str, str] | None = None,
    ) -> subprocess.Popen[bytes]:
        """Return a process that gets the signal `at_death` when the stack ends.

        It has a session of its own, so that an interrupt from the terminal reaches the stack alone.
        """
        return subprocess.Popen(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            pass_fds=self._inherited,
            start_new_session=True,
            preexec_fn=tied(at_death),
        )


class PythonChild(Child):
    """A module of grazemap, run by this interpreter; its log is appended to a file.

    Parameters
    ----------
    name : str
        Of the child and its log file.
    command : sequence of str
        The program and its arguments.
    environment : mapping
        The whole environment of the child.
    log : Path
        The file for its stdout and stderr.
    liveness : Liveness
        Where the child says that it goes on.
    inherited : sequence of int
        Open file descriptors that the child keeps.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        log: Path,
        liveness: Liveness,
        inherited: Sequence[int] = (),
    ) -> None:
        self.name = name
        self._command = list(command)
        self._environment = {**environment, **liveness.environment}
        self._liveness = liveness
        self.log = log
        self._inherited = tuple(inherited)

    def hangs(self) -> str:
        """As `Child.hangs`: it is stopped, or no longer says that it goes on."""
        return self._liveness.hangs()

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline` (monotonic seconds), then kill it."""
        super().end(deadline)
        self._liveness.close()

    def last_words(self) -> str:
        """Return the end of its log."""
        return tail(self.log, 15)

    def _spawned(self) -> subprocess.Popen[bytes]:
        with self.log.open("ab") as output:
            process = self._popen(self._command, output, signal.SIGKILL, self._environment)
        self._liveness.begin(process.pid)
        return process


def bound_log(log: Path) -> None:
    """Move what a log has over `MOST_LOG_BYTES` to `.1`; the process that appends to it goes on with the same file."""
    if log.is_file() and log.stat().st_size > MOST_LOG_BYTES:
        with suppress(OSError):  # on a full disk the log is emptied all the same
            shutil.copyfile(log, log.with_suffix(".log.1"))
        os.truncate(log, 0)


def tail(log: Path, lines: int) -> str:
    """Return the last lines of a log; empty where there is none."""
    if not log.is_file():
        return ""
    with log.open("rb") as stream:
        stream.seek(max(0, stream.seek(0, os.SEEK_END) - _TAIL_BYTES))
        return "\n".join(stream.read().decode("utf-8", "replace").splitlines()[-lines:])
