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
from grazemap_worker.restarts import Restarts
from grazemap_worker.system import tied
from grazemap_worker.watchdog import WatchdogSocket

# Maximum seconds between two signs of life of a child. Children send a sign every two seconds (INTERVAL_SECONDS of the
# watchdog), and may wait for Redis for up to five seconds, so this must be well over seven seconds.
SILENT_SECONDS = 20.0
MAX_LOG_BYTES = 10_000_000
_TAIL_BYTES = 4000


class Child(ABC):
    """A child process that the stack watches.

    Parameters
    ----------
    name : str
        Its name in logs.
    log : Path
        The file to which it appends its log; see `rotate_log`.
    inherited : sequence of int
        Open file descriptors that the process inherits.
    silent_seconds : float
        Maximum time between two signs of life.
    first_seconds : float
        Maximum time from the start to the first sign of life. It is longer, because a start may take long.
    """

    _process: subprocess.Popen[bytes] | None = None
    _liveness: Liveness | None = None
    _end_unnoticed = False  # whether the process was started and `look` has not noticed its end yet
    has_answered = False
    """Whether the process has given a sign of life since its last start."""

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
        """Start the process, without waiting for it."""
        self._end_unnoticed, self.has_answered = True, False
        self.restarts.started()
        self._process = self._spawn()
        self._liveness = Liveness(
            self._process.pid, silent_seconds=self._silent_seconds, first_seconds=self._first_seconds
        )

    def look(self) -> bool:
        """Kill a hung process, or start an ended process again after a pause.

        Returns whether this call noticed an end.
        """
        rotate_log(self.log)
        self.end_if_hung()
        if self.running:
            return False
        if self._end_unnoticed:
            self._end_unnoticed = False
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
        """Wait for the end of the process until `deadline` (monotonic seconds), then kill it."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def end_if_hung(self) -> None:
        """Kill the process if it hangs. Children of the process end with it."""
        if self._process is None or self._liveness is None or not self.running:
            return
        heard = self.heard()
        self.has_answered |= heard
        if reason := self._liveness.hangs(heard=heard):
            structlog.get_logger("grazemap_service.stack").warning("child killed", child=self.name, reason=reason)
            self._process.kill()

    @abstractmethod
    def heard(self) -> bool:
        """Return whether the process gave a sign of life since the last call; called several times a second."""

    @abstractmethod
    def log_tail(self) -> str:
        """Return the end of the log."""

    @abstractmethod
    def _spawn(self) -> subprocess.Popen[bytes]:
        """Start the process with `_popen` and return it."""

    def _popen(
        self,
        command: Sequence[str],
        output: int | IO[bytes],
        at_death: signal.Signals,
        environment: Mapping[str, str] | None = None,
    ) -> subprocess.Popen[bytes]:
        """Start a process that gets the signal `at_death` when the stack ends.

        The process has its own session, so that an interrupt from the terminal reaches only the stack.
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
    """A child that runs a module of grazemap, and sends signs of life.

    Parameters
    ----------
    name, log, inherited
        See `Child`; stdout and stderr are appended to the log.
    command : sequence of str
        The Python interpreter, the module and its arguments; see `module_command`.
    environment : mapping
        The whole environment of the child.
    watchdog : WatchdogSocket
        The socket to which the child sends signs of life.
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
        """Return whether the child has sent a sign of life since the last call."""
        return self._watchdog.heard()

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline` (monotonic seconds), then kill it."""
        super().end(deadline)
        self._watchdog.close()

    def log_tail(self) -> str:
        """Return the end of its log."""
        return tail(self.log, 15)

    def _spawn(self) -> subprocess.Popen[bytes]:
        self._watchdog.heard()  # discard signs of life of a previous process
        with self.log.open("ab") as output:
            return self._popen(self._command, output, signal.SIGKILL, self._environment)


def rotate_log(log: Path) -> None:
    """If a log is over `MAX_LOG_BYTES`, copy it to a file with `.1` after its name, and empty it.

    The log is not renamed, because its process keeps it open. Lines that the process writes between the copy and the
    emptying are lost.
    """
    with suppress(OSError):  # the next call tries again
        if log.is_file() and log.stat().st_size > MAX_LOG_BYTES:
            with suppress(OSError):  # on a full disk the log is emptied all the same
                shutil.copyfile(log, log.with_name(f"{log.name}.1"))
            os.truncate(log, 0)


def tail(log: Path, lines: int) -> str:
    """Return the last lines of a log; an empty text if there is no log."""
    if not log.is_file():
        return ""
    with log.open("rb") as stream:
        stream.seek(max(0, stream.seek(0, os.SEEK_END) - _TAIL_BYTES))
        return "\n".join(stream.read().decode("utf-8", "replace").splitlines()[-lines:])
