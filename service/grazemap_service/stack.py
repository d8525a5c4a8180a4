"""`python -m grazemap_service.stack`: the whole product on one machine.

It starts, watches and restarts an embedded Redis, the HTTP service and the workers, and ends all of them when it ends.
When requests can be answered it prints one line of JSON on stdout, {"url": ..., "pid": ..., "announcement": ...}; with
--talk, also lines {"starting": ...} before it, once a second. Everything that must last lies in the data folder;
without one, a temporary folder is used and removed at the end.
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
from grazemap.running_stacks import Announcement, announce, withdraw
from grazemap_service.append_only import StorageError
from grazemap_service.children import Child, PythonChild
from grazemap_service.redis_server import MAX_SOCKET_PATH, NoRedisError, RedisServer
from grazemap_service.settings import ServiceSettings, StackSettings
from grazemap_service.storage import REDIS, locked, opened_lock
from grazemap_service.temporary import TemporaryFolder, remove_abandoned
from grazemap_worker import logs
from grazemap_worker.environment import usable_cache_dir
from grazemap_worker.redis_settings import USAGE_ERROR, RedisSettings, refusal_text, unknown_variables
from grazemap_worker.store import Store, connect
from grazemap_worker.system import IdleMemory, not_kept
from grazemap_worker.watchdog import WatchdogSocket

_POLL_SECONDS = 0.1
_START_POLL_SECONDS = 0.02
_STOP_SECONDS = 3.0
# Seconds to wait for the Redis of a killed stack, because it writes its data before it ends.
_LOCK_SECONDS = 4.0
# Seconds after which a warning says what the stack waits for.
_PATIENCE_SECONDS = 10.0
# Seconds between the lines of JSON that say what the stack waits for.
_TALK_SECONDS = 1.0
# Seconds between attempts to count ended children in Redis, and timeout of an attempt.
_COUNT_SECONDS = 0.5
# A child that ends this often before the stack was ever ready counts as unable to start.
_MAX_EARLY_DEATHS = 3

S = TypeVar("S", bound=RedisSettings)


class StackStartError(RuntimeError):
    """The stack cannot start; the message is for users."""


class ServiceStack:
    """The child processes of a stack: Redis, service and workers.

    Parameters
    ----------
    host, port : str, int
        Address of the service; port 0: any free port. The socket is opened here and stays open, so that a restarted
        service keeps the address, and clients wait during the restart.
    data : Path
        Data folder, which no other stack may use.
    workers : int, optional
        Number of worker processes; default: one per core.

    Raises
    ------
    StackStartError
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
            raise StackStartError(f"cannot listen on {host} port {port}: {error.strerror}") from None
        self._log = structlog.get_logger("grazemap_service.stack")
        self._ready = False
        self._missing = ""
        self._patient_until = math.inf

        # only the service gets the keys of clients
        variables = own_variables(os.environ)
        keys = {name: value for name, value in variables.items() if name.startswith("GRAZEMAP_API_KEY")}
        environment = {name: value for name, value in variables.items() if name not in keys}
        if usable_cache_dir() is None:
            self._log.warning("kernels are kept in the data folder, as the user's home cannot be written")
            environment["GRAZEMAP_CACHE_DIR"] = str(data / "kernels")
        for unknown in unknown_variables(os.environ, ServiceSettings, StackSettings):
            self._log.warning(unknown)
        for limit in not_kept():
            self._log.warning("a limit is not kept on this system", limit=limit)
        self._allowed_host = environment.get("GRAZEMAP_ALLOWED_HOSTS", "").split(",")[0].strip()
        self._children: list[Child] = []
        if not environment.get("GRAZEMAP_REDIS_URL"):
            settings = _settings(StackSettings, workers=workers, cache_dir=environment.get("GRAZEMAP_CACHE_DIR"))
            memory = settings.max_redis_bytes
            server = RedisServer(data / REDIS, inherited=(self._lock.fileno(),), max_memory=memory)
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
        self._sockets = TemporaryFolder(max_path_bytes=MAX_SOCKET_PATH - len("/service"))
        self._service = self._python_child("service", "grazemap_service", environment | keys, listening)
        self._children += [self._service, self._python_child("workers", "grazemap_worker", environment)]

    def _python_child(self, name: str, module: str, environment: Mapping[str, str], *inherited: int) -> PythonChild:
        watchdog = WatchdogSocket(self._sockets.path / name)
        return PythonChild(name, module_command(module), environment, self._data / f"{name}.log", watchdog, inherited)

    @property
    def missing(self) -> str:
        """A phrase that says what the stack waits for."""
        return self._missing or "starting the service"

    @property
    def url(self) -> str:
        """URL of the service for clients on this machine."""
        host, port = self._address()
        return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"

    def start(self, talk: Callable[[], None] | None = None) -> None:
        """Lock the data folder and start all children.

        `talk` is called often until the folder is locked. Without it, a warning is logged if the start takes long.

        Raises
        ------
        StackStartError
            Another stack uses the data folder.
        """
        self._take_lock(talk or (lambda: None))
        self._patient_until = math.inf if talk else time.monotonic() + _PATIENCE_SECONDS
        for child in self._children:
            child.start()

    def look_after(self) -> None:
        """Start ended children again.

        Raises
        ------
        StackStartError
            A child does not start.
        """
        for child in self._children:
            if not child.look():
                continue
            if not self._ready:
                refused = isinstance(child, PythonChild) and child.status == USAGE_ERROR
                if refused or child.restarts.deaths >= _MAX_EARLY_DEATHS:
                    raise StackStartError(f"the {child.name} process does not start:\n{child.log_tail()}")
            self._log.warning("child ended, starting it again", child=child.name, deaths=child.restarts.deaths)
            self._uncounted.append("ended:supervisor" if child.name == "workers" else f"ended:{child.name}")
        self._count()

    def _count(self) -> None:
        """Count ended children for the metrics, as soon as Redis answers."""
        if not self._uncounted or time.monotonic() < self._count_from:
            return
        self._count_from = time.monotonic() + _COUNT_SECONDS
        with suppress(RedisError):
            while self._uncounted:
                self._store.count(self._uncounted[0])
                self._uncounted.pop(0)

    def ready(self) -> bool:
        """Return whether the stack is ready: the service is healthy, Redis takes writes, and a worker is alive."""
        # A service that is not up yet would keep a request waiting, and the lines of `_Talk` with it.
        if not self._ready and self._service.has_answered and self._answer("/healthz") is not None:
            readiness = self._answer("/readyz")
            if readiness is not None:
                self._ready = readiness["workers"] > 0
                self._missing = readiness["detail"]
        if not self._ready and time.monotonic() > self._patient_until:
            self._patient_until = math.inf
            self._log.warning("not ready yet", reason=self._missing, logs=str(self._data))
        return self._ready

    def stop(self) -> None:
        """Stop all children, Redis last; kill those that do not end in time."""
        for child in self._children:
            child.ask_to_stop()
        deadline = time.monotonic() + _STOP_SECONDS
        for child in reversed(self._children):
            child.end(deadline)
        self._sockets.close()
        self._listener.close()
        self._lock.close()

    def _take_lock(self, talk: Callable[[], None]) -> None:
        """Lock the data folder for this process and for its Redis, which may live longer than a killed stack.

        Raises StackStartError.
        """
        deadline = time.monotonic() + _LOCK_SECONDS
        while True:
            if locked(self._lock):
                self._missing = ""
                return
            self._missing = f"waiting for another stack that uses {self._data}"
            if time.monotonic() > deadline:
                raise StackStartError(f"another stack runs on the data folder {self._data}")
            talk()
            time.sleep(_POLL_SECONDS)

    def _address(self) -> tuple[str, int]:
        host, port = self._listener.getsockname()[:2]
        return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host), port

    def _answer(self, path: str) -> dict[str, Any] | None:
        """Return the JSON object with which the service answers a GET; None, and set `missing`, after a failure."""
        connection = http.client.HTTPConnection(*self._address(), timeout=2)
        allowed = self._allowed_host
        try:
            connection.request("GET", path, headers={"Host": allowed} if allowed not in ("", "*") else {})
            answer = connection.getresponse()
            content = answer.read()
        except (OSError, http.client.HTTPException) as error:
            self._missing = f"the service does not answer: {error or type(error).__name__}"
            return None
        finally:
            connection.close()
        try:
            answered: dict[str, Any] = json.loads(content)
            if answer.status == http.HTTPStatus.OK:
                return answered
            self._missing = str(answered["detail"])
        except (ValueError, LookupError, TypeError):
            self._missing = f"{path} answers {answer.status}"
        return None


def own_variables(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment with the names of grazemap's variables in upper case; they may be written in any case."""
    return {name.upper() if name.upper().startswith("GRAZEMAP_") else name: environment[name] for name in environment}


def _settings(kind: type[S], **options: Any) -> S:
    """Return settings from the environment; options that are not None override it. Raises StackStartError."""
    try:
        return kind(**{name: value for name, value in options.items() if value is not None})
    except ValidationError as error:
        raise StackStartError(refusal_text(error)) from None


class _End:
    """Whether the stack should stop: after a signal, or when neither its parent nor a process that joined it uses it.

    The parent leaves it by its end, or by SIGUSR1.
    """

    def __init__(self, parent: int | None) -> None:
        self._parent, self._asked, self._left = parent, False, False
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGUSR1):
            signal.signal(number, self._note)

    def _note(self, number: int, _frame: FrameType | None) -> None:
        self._asked |= number != signal.SIGUSR1
        self._left |= number == signal.SIGUSR1

    def __call__(self, announcement: Announcement | None = None) -> bool:
        # Polled, because PR_SET_PDEATHSIG would fire when the thread that started this process ends.
        self._left |= self._parent is not None and os.getppid() != self._parent
        return self._asked or (self._left and (announcement is None or withdraw(announcement.path)))


def run(
    stack: ServiceStack,
    ended: Callable[[Announcement | None], bool],
    ready_file: Path | None,
    talks: bool = False,
    announces: bool = True,
) -> None:
    """Start the stack, print when it is ready, restart ended children, and stop the stack when asked.

    With `talks`, a line of JSON, {"starting": ...}, is printed every second until it is ready. With `announces`, other
    processes may join the stack. Raises StackStartError.
    """
    talk = _Talk(stack) if talks else None
    announced, announcement, memory = False, None, IdleMemory()
    try:
        if talk:
            talk()
        stack.start(talk)
        while not ended(announcement):
            stack.look_after()
            if not announced and stack.ready():
                announced = True
                announcement = announce(stack.url) if announces else None
                path = str(announcement.path) if announcement else None
                line = json.dumps({"url": stack.url, "pid": os.getpid(), "announcement": path})
                if ready_file is not None:
                    ready_file.write_text(line + "\n", "utf-8")
                print(line, flush=True)  # noqa: T201 - the one line that the starting process reads
            if talk and not announced:
                talk()
            memory.look()
            time.sleep(_POLL_SECONDS if announced else _START_POLL_SECONDS)
    finally:
        if announcement is not None:
            announcement.close()
        stack.stop()
        if announced and ready_file is not None:
            ready_file.unlink(missing_ok=True)


class _Talk:
    """Prints what the stack waits for, when it is called for the first time and then at most every second.

    It does not use a thread, because the stack forks children: a lock that a thread holds would stay locked in them.
    """

    def __init__(self, stack: ServiceStack) -> None:
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
    parser.add_argument("--unannounced", action="store_true", help="have no other process use the stack")
    parser.add_argument("--verbose", action="store_true", help="say more than warnings on stderr")
    options = parser.parse_args(arguments)
    logs.configure("INFO" if options.verbose else "WARNING")

    ended = _End(options.die_with_parent)
    remove_abandoned()
    temporary = None if options.data else TemporaryFolder("data")
    data = temporary.path if temporary else options.data.resolve()
    try:
        stack = ServiceStack(options.host, options.port, data, options.workers)
        run(stack, ended, options.ready_file, options.talk, not options.unannounced)
    except (StackStartError, StorageError, NoRedisError) as error:
        if not ended():  # it was asked to end while it waited to start
            sys.stderr.write(f"grazemap: {error}\n")
            return 1
    finally:
        if temporary:
            temporary.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
