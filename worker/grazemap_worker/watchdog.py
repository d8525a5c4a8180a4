"""Signs of life by the protocol of systemd's sd_notify: sends those of this process, and receives those of others.

The stack, or a systemd unit with `WatchdogSec`, listens on the datagram socket that the environment variable
NOTIFY_SOCKET names. It replaces a process that no longer sends. Without that variable nothing is sent.
"""

from __future__ import annotations

import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from grazemap_worker.system import orphaned, thread_seconds

VARIABLE = "NOTIFY_SOCKET"
MESSAGE = b"WATCHDOG=1"
INTERVAL_SECONDS = 2.0


def beat() -> None:
    """Send a sign of life of this process, or end it (SIGTERM) if the watching process has ended.

    It never waits, even if the watching process is stopped.
    """
    address = os.environ.get(VARIABLE)
    if not address:
        return
    if orphaned():
        os.kill(os.getpid(), signal.SIGTERM)
    if address.startswith("@"):  # an abstract socket of Linux
        address = "\0" + address[1:]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender, suppress(OSError):
        sender.setblocking(False)
        sender.sendto(MESSAGE, address)


@contextmanager
def repeated(action: Callable[[], object], seconds: float) -> Iterator[None]:
    """Call a function in a thread during this block: at once, and then every `seconds`."""
    ended = threading.Event()

    def repeat() -> None:
        action()
        while not ended.wait(seconds):
            action()

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def beating() -> Iterator[None]:
    """Send signs of life during this block as long as the main thread uses processor time.

    Call this from the main thread.
    """
    thread, last = threading.get_ident(), -1.0

    def beat_if_time_was_used() -> None:
        nonlocal last
        before, last = last, thread_seconds(thread)
        if last > before:
            beat()

    with repeated(beat_if_time_was_used, INTERVAL_SECONDS):
        yield


class WatchdogSocket:
    """A socket that receives the signs of life of one watched process.

    Parameters
    ----------
    path : Path
        Path of the socket to be created.
    """

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._socket.setblocking(False)
        self.environment = {VARIABLE: str(path)}

    def heard(self) -> bool:
        """Return whether a sign of life has arrived since the last call."""
        received = False
        with suppress(BlockingIOError):
            while True:
                received |= MESSAGE in self._socket.recv(4096).split(b"\n")
        return received

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
