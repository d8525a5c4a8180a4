"""The child processes of the stack: started, watched, restarted and stopped; they end when the stack ends."""

from __future__ import annotations

import math
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

from grazemap_worker.liveness import Liveness
from grazemap_worker.parent_death import tied
from grazemap_worker.restarts import Restarts
from grazemap_worker.watchdog import WatchdogSocket

# After the first message of a child, so many seconds without one. Children send one every two seconds, and wait for
# Redis five seconds at most.
SILENT_SECONDS = 20.0
MOST_LOG_BYTES = 10_000_000
_TAIL_BYTES = 4000


class Child(ABC):
    """A process that the stack watches.

    Parameters
    ----------
    name : str
        What it is called in logs.
    log : Path
        The file to which it appends what it says; it has at most about `MOST_LOG_BYTES`, and `.1` what was before.
    inherited : sequence of int
        Open file descriptors that it keeps.
    silent_seconds, first_seconds : float
        How long it may give no sign of life, after the first one and before. A start may take long.
    """

    _process: subprocess.Popen[bytes] | None = None
    _liveness: Liveness | None = None
    _up = False

    def __init__(
        self,
        name: str,
        log: Path,
        inherited: Sequence[int] = (),
        silent_seconds: float = math.inf,
        first_seconds: float = math.inf,
    ) -> None:
        self.name, self.log, self.restarts = name, log, Restarts()
        self._inherited = tuple(inherited)
        self._silent_seconds, self._first_seconds = silent_seconds, first_seconds

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
        self._up = True
        self.restarts.started()
        self._process = self._spawned()
        self._liveness = Liveness(
            self._process.pid, silent_seconds=self._silent_seconds, first_seconds=self._first_seconds
        )

    def look(self) -> bool:
        """Start it again if it ended and its pause is over. Returns whether this call noticed its end."""
        bound_log(self.log)
        self.end_if_hung()
        if self.running:
            return False
        if self._up:
            self._up = False
            self.restarts.ended()
            return True
        if self.restarts.due:
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
        if self._process is None or self._liveness is None or not self.running:
            return
        if reason := self._liveness.hangs(heard=self.heard()):
            structlog.get_logger("grazemap_service.stack").warning("child killed", child=self.name, reason=reason)
            self._process.kill()

    @abstractmethod
    def heard(self) -> bool:
        """Return whether it gave a sign of life since the last call; called several times a second while it runs."""

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
    name, log, inherited
        As `Child`; stdout and stderr are appended to the log.
    command : sequence of str
        The program and its arguments.
    environment : mapping
        The whole environment of the child.
    watchdog : WatchdogSocket
        Where the child says that it goes on.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        log: Path,
        watchdog: WatchdogSocket,
        inherited: Sequence[int] = (),
    ) -> None:
        super().__init__(name, log, inherited, silent_seconds=SILENT_SECONDS)
        self._command = list(command)
        self._environment = {**environment, **watchdog.environment}
        self._watchdog = watchdog

    def heard(self) -> bool:
        """As `Child.heard`: it has said that it goes on."""
        return self._watchdog.heard()

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline` (monotonic seconds), then kill it."""
        super().end(deadline)
        self._watchdog.close()

    def last_words(self) -> str:
        """Return the end of its log."""
        return tail(self.log, 15)

    def _spawned(self) -> subprocess.Popen[bytes]:
        self._watchdog.heard()  # of one that was there before
        with self.log.open("ab") as output:
            return self._popen(self._command, output, signal.SIGKILL, self._environment)


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
