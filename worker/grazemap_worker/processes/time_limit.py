"""Runs a function with a limit of processor time, which holds within long calls of compiled libraries too.

The function runs in a forked process, which the operating system ends at the limit.
"""

from __future__ import annotations

import io
import os
import pickle
import signal
import traceback
from collections.abc import Callable, Iterator
from typing import TypeVar

from grazemap_worker.system import die_with_parent

Step = TypeVar("Step")


def run_limited(seconds: float, work: Callable[[], Iterator[Step]]) -> tuple[list[Step], bool]:
    """Return the items that a function yields within a limit of processor time, and whether it reached the limit.

    Raises
    ------
    RuntimeError
        The function raised an exception, or its process ended otherwise.
    """
    receiving, sending = os.pipe()
    parent = os.getpid()
    process = os.fork()
    if process == 0:
        status = 1
        try:
            os.close(receiving)
            die_with_parent(parent)
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends this process
            signal.signal(signal.SIGPROF, signal.SIG_DFL)
            signal.setitimer(signal.ITIMER_PROF, seconds)
            with open(sending, "wb") as stream:
                for step in work():
                    pickle.dump(step, stream)
                    stream.flush()
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)  # never return into the caller's code
    os.close(sending)
    code = None
    try:
        with open(receiving, "rb") as stream:
            data = stream.read()
        code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    finally:
        if code is None:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)
    if code not in (0, -signal.SIGPROF):
        raise RuntimeError(f"the process of the work ended with the status {code}")
    return list(_steps(data)), code != 0


def _steps(data: bytes) -> Iterator[Step]:
    """Yield the written steps, without the last one if it is incomplete."""
    stream = io.BytesIO(data)
    while stream.tell() < len(data):
        try:
            yield pickle.load(stream)
        except (EOFError, pickle.UnpicklingError):
            return
