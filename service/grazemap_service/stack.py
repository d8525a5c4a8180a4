"""`python -m grazemap_service.stack`: the whole product on one machine.

It starts, watches and restarts an embedded Redis, the HTTP service and the workers, and ends all of them when it ends.
When requests can be answered it prints one line of JSON on stdout, {"url": ..., "pid": ...}; with --talk, also lines
{"starting": ...} before it, once a second. Everything that must last lies in the data folder; without one, a temporary
folder is used and removed at the end.
"""

from __future__ import annotations

import argparse
import http.client
import json
import math
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any, TypeVar

import structlog
from pydantic import ValidationError
from redis.exceptions import RedisError

from grazemap.module_command import module_command
from grazemap_service.append_only import StorageError
from grazemap_service.children import Child, PythonChild
from grazemap_service.redis_server import LONGEST_SOCKET_PATH, NoRedisError, RedisServer
from grazemap_service.settings import StackSettings
from grazemap_service.storage import REDIS, locked, opened_lock
from grazemap_service.temporary import TemporaryFolder, remove_abandoned
from grazemap_worker import logs
from grazemap_worker.redis_settings import USAGE_ERROR, RedisSettings, refusal_text
from grazemap_worker.store import Store, connect
from grazemap_worker.watchdog import WatchdogSocket

_POLL_SECONDS = 0.1
_STOP_SECONDS = 3.0
# Seconds to wait for the Redis of a killed stack, which writes its data before it ends.
_LOCK_SECONDS = 4.0
# Seconds after which a line on stderr says what the stack waits for.
_PATIENCE_SECONDS = 10.0
# Seconds between lines that say what it waits for.
_TALK_SECONDS = 1.0
# Seconds between attempts to count the children that ended, and until Redis has to answer.
_COUNT_SECONDS = 0.5
# A child that dies this often before the stack was ever ready counts as unable to start.
_MOST_EARLY_DEATHS = 3

S = TypeVar("S", bound=RedisSettings)


class StackError(RuntimeError):
    """The stack cannot start; the message is for users."""


class Stack:
    """Redis, service and workers under one parent.

    Parameters
    ----------
    host, port : str, int
        Where the service listens; port 0: any free one. The socket is opened here and stays open, so that a
        restarted service keeps the address and clients that come meanwhile wait.
    data : Path
        Folder of this stack alone.
    workers : int, optional
        Worker processes; default one per core.

    Raises
    ------
    StackError
        The address cannot be listened on, or a setting is invalid.
    StorageError
        The data folder cannot be used.
    NoRedisError
        There is no Redis to start and GRAZEMAP_REDIS_URL is not set.
    """

    def __init__(self, host: str, port: int, data: Path, workers: int | None = None) -> None:
        self._data = data
        self._lock = opened_lock(data)
        try:
            family = socket.AF_INET6 if ":" in host else socket.AF_INET
            self._listener = socket.create_server((host.strip("[]"), port), family=family)
        except OSError as error:
            raise StackError(f"cannot listen on {host} port {port}: {error.strerror}") from None
        self._log = structlog.get_logger("grazemap_service.stack")
        self._ready = False
        self._missing = ""
        self._answered = False
        self._patient_until = math.inf

        # keys of clients are for the service alone
        variables = own_variables(os.environ)
        keys = {name: value for name, value in variables.items() if name.startswith("GRAZEMAP_API_KEY")}
        environment = {name: value for name, value in variables.items() if name not in keys}
        self._allowed_host = environment.get("GRAZEMAP_ALLOWED_HOSTS", "").split(",")[0].strip()
        self._children: list[Child] = []
        if not environment.get("GRAZEMAP_REDIS_URL"):
            settings = _settings(StackSettings, workers=workers)
            memory = settings.most_redis_bytes
            server = RedisServer(data / REDIS, inherited=(self._lock.fileno(),), most_memory=memory)
            environment["GRAZEMAP_RESULT_BYTES"] = str(settings.result_bytes)
            environment["GRAZEMAP_REDIS_URL"] = server.url
            environment.pop("GRAZEMAP_REDIS_PASSWORD", None)  # the password of another Redis
            self._children.append(server)
            self._store = Store(connect(server.url, _COUNT_SECONDS))
        else:
            self._store = Store(_settings(RedisSettings).connect(socket_timeout=_COUNT_SECONDS))
        self._uncounted: list[str] = []
        self._count_from = 0.0
        listening = self._listener.fileno()
        environment["GRAZEMAP_FD"] = str(listening)
        if workers is not None:
            environment["GRAZEMAP_WORKERS"] = str(workers)
        self._sockets = TemporaryFolder(longest=LONGEST_SOCKET_PATH - len("/service"))
        for name, module in (("service", "grazemap_service"), ("workers", "grazemap_worker")):
            inherited, own = ((listening,), environment | keys) if name == "service" else ((), environment)
            command, watchdog = module_command(module), WatchdogSocket(self._sockets.path / name)
            self._children.append(PythonChild(name, command, own, data / f"{name}.log", watchdog, inherited))

    @property
    def missing(self) -> str:
        """What it waits for, in a few words."""
        return self._missing or "starting the service"

    @property
    def url(self) -> str:
        """Where clients on this machine find the service."""
        host, port = self._address()
        return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

    def start(self, talk: Callable[[], None] | None = None) -> None:
        """Lock the data folder and start everything. What takes long is logged, unless `talk`, called often, says it.

        Raises
        ------
        StackError
            Another stack uses the data folder.
        """
        self._take_lock(talk or (lambda: None))
        self._patient_until = math.inf if talk else time.monotonic() + _PATIENCE_SECONDS
        for child in self._children:
            child.start()

    def look_after(self) -> None:
        """Start again what ended.

        Raises
        ------
        StackError
            A child does not start.
        """
        for child in self._children:
            if not child.look():
                continue
            if not self._ready:
                refused = isinstance(child, PythonChild) and child.status == USAGE_ERROR
                if refused or child.restarts.deaths >= _MOST_EARLY_DEATHS:
                    raise StackError(f"the {child.name} process does not start:\n{child.last_words()}")
            self._log.warning("child ended, starting it again", child=child.name, deaths=child.restarts.deaths)
            self._uncounted.append("ended:supervisor" if child.name == "workers" else f"ended:{child.name}")
        self._count()

    def _count(self) -> None:
        """Count the children that ended, for metrics, as soon as Redis answers."""
        if not self._uncounted or time.monotonic() < self._count_from:
            return
        self._count_from = time.monotonic() + _COUNT_SECONDS
        with suppress(RedisError):
            while self._uncounted:
                self._store.count(self._uncounted[0])
                self._uncounted.pop(0)

    def ready(self) -> bool:
        """Return whether requests are answered and computed: the service is healthy, Redis writes, a worker lives."""
        if not self._ready and self._answer("/healthz") is not None:
            readiness = self._answer("/readyz")
            if readiness is not None:
                self._ready = readiness["workers"] > 0
                self._missing = readiness["detail"]
        if not self._ready and time.monotonic() > self._patient_until:
            self._patient_until = math.inf
            self._log.warning("not ready yet", reason=self._missing, logs=str(self._data))
        return self._ready

    def stop(self) -> None:
        """Stop everything in order, Redis last; kill what does not end in time."""
        for child in self._children:
            child.ask_to_stop()
        deadline = time.monotonic() + _STOP_SECONDS
        for child in reversed(self._children):
            child.end(deadline)
        self._sockets.close()
        self._listener.close()
        self._lock.close()

    def _take_lock(self, talk: Callable[[], None]) -> None:
        """Lock the data folder: for this process, and for the Redis on it, which may outlive a killed stack.

        Raises StackError.
        """
        deadline = time.monotonic() + _LOCK_SECONDS
        while True:
            if locked(self._lock):
                self._missing = ""
                return
            self._missing = f"waiting for another stack that uses {self._data}"
            if time.monotonic() > deadline:
                raise StackError(f"another stack runs on the data folder {self._data}")
            talk()
            time.sleep(_POLL_SECONDS)

    def _address(self) -> tuple[str, int]:
        host, port = self._listener.getsockname()[:2]
        return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host), port

    def _answer(self, path: str) -> dict[str, Any] | None:
        """Return the object that the service answers with; None, and what is missing, where it is a problem."""
        connection = http.client.HTTPConnection(*self._address(), timeout=2)
        allowed = self._allowed_host
        try:
            connection.request("GET", path, headers={"Host": allowed} if allowed not in ("", "*") else {})
            answer = connection.getresponse()
            content = answer.read()
        except (OSError, http.client.HTTPException) as error:
            reason = f"the service does not answer: {error or type(error).__name__}"
            self._missing = reason if self._answered else ""
            return None
        finally:
            connection.close()
        self._answered = True
        try:
            answered: dict[str, Any] = json.loads(content)
            if answer.status == http.HTTPStatus.OK:
                return answered
            self._missing = str(answered["detail"])
        except (ValueError, LookupError, TypeError):
            self._missing = f"{path} answers {answer.status}"
        return None


def own_variables(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment with grazemap's variables in upper case: they are read in any case."""
    return {name.upper() if name.upper().startswith("GRAZEMAP_") else name: environment[name] for name in environment}


def _settings(kind: type[S], **given: Any) -> S:
    """Return settings of the environment, but for those that are given and not None. Raises StackError."""
    try:
        return kind(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        raise StackError(refusal_text(error)) from None


def _end(parent: int | None) -> Callable[[], bool]:
    """Return a function that says whether the stack should stop: after a signal, or the end of its parent."""
    signals: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        signals.append(number)

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        signal.signal(number, note)
    # Polled, because PR_SET_PDEATHSIG would fire when the thread that started this process ends.
    return lambda: bool(signals) or (parent is not None and os.getppid() != parent)


def run(stack: Stack, ended: Callable[[], bool], ready_file: Path | None, talks: bool = False) -> None:
    """Start the stack, print when it is ready, restart what ends, and stop it when asked.

    With `talks`, a line of JSON, {"starting": ...}, is printed every second until it is ready. Raises StackError.
    """
    talk = _Talk(stack) if talks else None
    announced = False
    try:
        if talk:
            talk()
        stack.start(talk)
        while not ended():
            stack.look_after()
            if not announced and stack.ready():
                announced = True
                line = json.dumps({"url": stack.url, "pid": os.getpid()})
                if ready_file is not None:
                    ready_file.write_text(line + "\n", "utf-8")
                print(line, flush=True)  # noqa: T201 - the one line that the starting process reads
            if talk and not announced:
                talk()
            time.sleep(_POLL_SECONDS)
    finally:
        stack.stop()
        if announced and ready_file is not None:
            ready_file.unlink(missing_ok=True)


class _Talk:
    """Prints what the stack waits for, when it is called for the first time and at most every second.

    It is no thread: children are forked while the stack starts, and a lock that a thread holds stays held in them.
    """

    def __init__(self, stack: Stack) -> None:
        self._stack = stack
        self._next = 0.0

    def __call__(self) -> None:
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + _TALK_SECONDS
        with suppress(BrokenPipeError):  # the starting process has gone, which ends the stack too
            print(json.dumps({"starting": self._stack.missing}), flush=True)  # noqa: T201 - for the starting process


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the stack until SIGTERM or SIGINT; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m grazemap_service.stack", description=__doc__)
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default: 127.0.0.1)")
    parser.add_argument("--port", type=int, default=0, help="port to listen on (default: any free one)")
    parser.add_argument("--data", type=Path, help="data folder (default: temporary, removed at the end)")
    parser.add_argument("--workers", type=int, help="worker processes (default: one per core)")
    parser.add_argument("--ready-file", type=Path, help="file that holds the line of JSON while the stack is ready")
    parser.add_argument(
        "--die-with-parent",
        type=int,
        nargs="?",
        const=os.getppid(),
        metavar="PID",
        help="stop when the parent process (this one, of id PID) ends",
    )
    parser.add_argument("--talk", action="store_true", help='print {"starting": ...} every second until it is ready')
    parser.add_argument("--verbose", action="store_true", help="say more than warnings on stderr")
    given = parser.parse_args(arguments)
    logs.configure("INFO" if given.verbose else "WARNING")

    ended = _end(given.die_with_parent)
    remove_abandoned()
    temporary = None if given.data else TemporaryFolder("data")
    data = temporary.path if temporary else given.data.resolve()
    try:
        run(Stack(given.host, given.port, data, given.workers), ended, given.ready_file, given.talk)
    except (StackError, StorageError, NoRedisError) as error:
        if not ended():  # it was asked to end while it waited to start
            sys.stderr.write(f"grazemap: {error}\n")
            return 1
    finally:
        if temporary:
            temporary.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
