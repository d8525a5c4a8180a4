"""Notices that a child of the stack hangs: it is stopped, or no longer says that it goes on."""

from __future__ import annotations

import socket
from contextlib import suppress
from pathlib import Path

from grazemap_worker import watchdog
from grazemap_worker.progress import Progress, Stopwatch

# After the first message, so many seconds without one. Children send one every two seconds, and wait for Redis five
# seconds at most.
SILENT_SECONDS = 20.0


class Liveness:
    """The socket on which a child says that it goes on, and what is known of it.

    Before its first message, and in children that send none, only a stopped process counts as hung: a start may take
    long.

    Parameters
    ----------
    path : Path
        Of the socket, which is made.
    """

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._socket.setblocking(False)
        self.environment = {watchdog.VARIABLE: str(path)}

    def begin(self, pid: int) -> None:
        """Watch a process that has just been started."""
        self._heard()  # of one that was there before
        self._progress, self._silence, self._spoke = Progress(pid), Stopwatch(), False

    def hangs(self) -> str:
        """Return why the process counts as hung; empty if it does not. Call this several times a second."""
        heard = self._heard()
        self._spoke |= heard
        silent = self._silence.look(reset=heard or not self._spoke)
        if self._progress.hangs(computing=False):
            return "it is stopped"
        return "it does not answer" if silent > SILENT_SECONDS else ""

    def _heard(self) -> bool:
        """Return whether messages have arrived since the last call."""
        heard = False
        with suppress(BlockingIOError):
            while True:
                heard |= watchdog.MESSAGE in self._socket.recv(4096).split(b"\n")
        return heard

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
