"""The processes under the stack: started, watched, started again, stopped; they die when the stack dies."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import structlog

from grazemap_service.redis_server import RedisServer
from grazemap_worker.parent_death import tied

# A child that lived this long is not part of a crash loop; others wait 0.2, 0.4, ... s before the next start.
HEALTHY_SECONDS = 10.0
LONGEST_WAIT = 5.0
MOST_LOG_BYTES = 10_000_000
# Redis is asked at this interval whether it answers, with this time limit. It may fail to answer so often in a row,
# because it stops to fork, and so often at the start, while it reads its data.
PING_SECONDS = 3.0
ANSWER_SECONDS = 1.0
MOST_UNANSWERED = 10
MOST_UNANSWERED_AT_FIRST = 200


class Child(Protocol):
    """What the stack watches."""

    name: str

    @property
    def running(self) -> bool:
        """Whether the process lives."""

    def end_if_hung(self) -> None:
        """Kill it if it lives and does nothing any more."""

    def start(self) -> None:
        """Start it; does not wait."""

    def ask_to_stop(self) -> None:
        """Ask it to end in order."""

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline` (monotonic seconds), then kill it."""

    def last_words(self) -> str:
        """Return the end of its log."""


class PythonChild:
    """A module of ours, run by this interpreter, its log appended to a file.

    Parameters
    ----------
    name : str
        Of the child and its log file.
    command : sequence of str
        The program and its arguments.
    environment : mapping
        The whole environment of the child.
    log : Path
        The file that takes its stdout and stderr; set aside as .1 when it has grown over `MOST_LOG_BYTES`.
    inherited : sequence of int
        Open file descriptors that the child keeps.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        log: Path,
        inherited: Sequence[int] = (),
    ) -> None:
        self.name = name
        self._command = list(command)
        self._environment = dict(environment)
        self._log = log
        self._inherited = tuple(inherited)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self._process is not None and self._process.poll() is None

    def end_if_hung(self) -> None:
        """Do nothing: workers have time limits of their own, and whether the service answers is not watched."""

    @property
    def status(self) -> int | None:
        """Exit status, negative for a signal; None while it lives or was never started."""
        return self._process.returncode if self._process else None

    @property
    def pid(self) -> int | None:
        """Process id of the last start."""
        return self._process.pid if self._process else None

    def start(self) -> None:
        """Start it in a session of its own, so that an interrupt from the terminal reaches the stack alone."""
        if self._log.exists() and self._log.stat().st_size > MOST_LOG_BYTES:
            self._log.replace(self._log.with_suffix(".log.1"))
        with self._log.open("ab") as output:
            self._process = subprocess.Popen(
                self._command,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                pass_fds=self._inherited,
                start_new_session=True,
                preexec_fn=tied(signal.SIGKILL),
            )

    def ask_to_stop(self) -> None:
        """Send SIGTERM."""
        if self.running and self._process:
            self._process.terminate()

    def end(self, deadline: float) -> None:
        """Wait for its end until `deadline`, then kill it."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def last_words(self) -> str:
        """Return the end of its log."""
        if not self._log.is_file():
            return ""
        with self._log.open("rb") as stream:
            stream.seek(max(0, stream.seek(0, os.SEEK_END) - 4000))
            return "\n".join(stream.read().decode("utf-8", "replace").splitlines()[-15:])


class RedisChild:
    """The embedded Redis as a child of the stack.

    Attributes
    ----------
    has_answered : bool
        Whether it has, since its start.

    Parameters
    ----------
    server : RedisServer
    most_unanswered : int
        How often in a row it may not answer, once it has. Then it is killed: it may hang for ever, as in reporting its
        own crash.
    """

    name = "redis"

    def __init__(self, server: RedisServer, most_unanswered: int = MOST_UNANSWERED) -> None:
        self._server = server
        self._most_unanswered = most_unanswered
        self.has_answered = False
        self._unanswered = 0
        self._next_ping = 0.0

    @property
    def running(self) -> bool:
        """Whether the process lives."""
        return self._server.running

    def end_if_hung(self) -> None:
        """Ask it now and then whether it answers, and kill it when it has not for too long."""
        if not self._server.running or time.monotonic() < self._next_ping:
            return
        if self._server.answers(ANSWER_SECONDS):
            self.has_answered, self._unanswered = True, 0
        else:
            self._unanswered += 1
        if self._unanswered > (self._most_unanswered if self.has_answered else MOST_UNANSWERED_AT_FIRST):
            structlog.get_logger("grazemap_service.stack").warning("Redis does not answer, killing it")
            self._server.kill()
        self._next_ping = time.monotonic() + PING_SECONDS

    def start(self) -> None:
        """Start it; it loads its append-only file."""
        self.has_answered, self._unanswered = False, 0
        self._server.start()

    def ask_to_stop(self) -> None:
        """Do nothing yet: it ends last, after the processes that use it."""

    def end(self, deadline: float) -> None:
        """Stop it and remove its socket."""
        self._server.stop(max(0.5, deadline - time.monotonic()))
        self._server.close()

    def last_words(self) -> str:
        """Return the end of its log."""
        return self._server.log_tail()


class Watched:
    """A child and how often it died lately."""

    def __init__(self, child: Child) -> None:
        self.child = child
        self.deaths = 0
        self._started = 0.0
        self._not_before = 0.0
        self._up = False

    def start(self) -> None:
        """Start the child for the first time."""
        self._started = time.monotonic()
        self._up = True
        self.child.start()

    def look(self) -> bool:
        """Start the child again if it ended and its wait is over. Returns True when its end was noticed just now."""
        self.child.end_if_hung()
        if self.child.running:
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
