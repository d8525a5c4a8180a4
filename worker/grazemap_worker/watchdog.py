"""Tells the process that watches this one that it goes on, by the protocol of systemd's sd_notify; and hears others.

The stack, or a systemd unit with `WatchdogSec`, listens on the datagram socket that NOTIFY_SOCKET names, and replaces
a process from which it no longer hears. Without that variable nothing is sent.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
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
def repeated(action: Callable[[], object], seconds: float) -> Iterator[None]:
    """Call a function within this block, in a thread: at once, and again after every pause of so many seconds."""
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
    """Say so repeatedly while the main thread, which computes or looks at others within this block, goes on.

    It goes on as long as it uses processor time. Call this from the main thread.
    """
    # not on every system of its own for a thread
    clock = getattr(time, "pthread_getcpuclockid", lambda _: time.CLOCK_PROCESS_CPUTIME_ID)(threading.get_ident())
    last = -1.0

    def beat_if_it_goes_on() -> None:
        nonlocal last
        before, last = last, time.clock_gettime(clock)
        if last > before:
            beat()

    with repeated(beat_if_it_goes_on, INTERVAL_SECONDS):
        yield


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
