"""Tells the process that watches this one that it goes on, by the protocol of systemd's sd_notify; and hears others.

The stack, or a systemd unit with `WatchdogSec`, listens on the datagram socket that NOTIFY_SOCKET names, and replaces
a process from which it no longer hears. Without that variable nothing is sent.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

VARIABLE = "NOTIFY_SOCKET"
MESSAGE = b"WATCHDOG=1"
INTERVAL_SECONDS = 2.0


def beat() -> None:
    """Say that this process goes on; does not wait, not even for a watcher that is stopped."""
    address = os.environ.get(VARIABLE)
    if not address:
        return
    if address.startswith("@"):  # of Linux's abstract sockets
        address = "\0" + address[1:]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender, suppress(OSError):
        sender.setblocking(False)
        sender.sendto(MESSAGE, address)


@contextmanager
def beating() -> Iterator[None]:
    """Say so repeatedly while the main thread, which computes or looks at others within this block, goes on.

    It goes on as long as it uses processor time. Call this from the main thread.
    """
    ended = threading.Event()
    # not on every system of its own for a thread
    clock = getattr(time, "pthread_getcpuclockid", lambda _: time.CLOCK_PROCESS_CPUTIME_ID)(threading.get_ident())

    def repeat() -> None:
        last = -1.0
        while True:
            used = time.clock_gettime(clock)
            if used > last:
                beat()
            last = used
            if ended.wait(INTERVAL_SECONDS):
                return

    thread = threading.Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class WatchdogSocket:
    """The socket on which a process that is watched says that it goes on.

    Parameters
    ----------
    path : Path
        Of the socket, which is made.
    """

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._socket.setblocking(False)
        self.environment = {VARIABLE: str(path)}

    def heard(self) -> bool:
        """Return whether messages have arrived since the last call."""
        heard = False
        with suppress(BlockingIOError):
            while True:
                heard |= MESSAGE in self._socket.recv(4096).split(b"\n")
        return heard

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
