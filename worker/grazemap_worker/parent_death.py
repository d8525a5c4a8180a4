"""Children that end with their parent: the kernel's parent-death signal, Linux only.

The signal fires when the *thread* that made the child ends, so children are made from main threads only.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from collections.abc import Callable

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36
# Looked up before any fork: between fork and exec nothing may be imported.
_PRCTL = ctypes.CDLL(None, use_errno=True).prctl if sys.platform == "linux" else None


def die_with_parent(parent: int, signal_number: int = signal.SIGKILL) -> None:
    """Ask the kernel to send this process a signal when its parent ends; end at once when it has ended already.

    Parameters
    ----------
    parent : int
        Process id of the parent, taken before the fork, so that a parent that died in between is noticed.
    signal_number : int
        What is sent.

    Raises
    ------
    OSError
        The kernel refused. On other systems than Linux nothing is done, and children may outlive a killed parent.
    """
    if _PRCTL is None:
        return
    if _PRCTL(_PR_SET_PDEATHSIG, int(signal_number), 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_PDEATHSIG)")
    if os.getppid() != parent:
        os.kill(os.getpid(), signal_number)


def tied(signal_number: int = signal.SIGKILL) -> Callable[[], None]:
    """Return a `preexec_fn` for subprocess.Popen that ties the child to this process."""
    parent = os.getpid()
    return lambda: die_with_parent(parent, signal_number)


def adopt_orphans() -> None:
    """Make this process the parent of its children's orphans, so that it can wait for them and none remains a zombie.

    Linux only; on other systems init adopts the orphans.

    Raises
    ------
    OSError
        The kernel refused.
    """
    if _PRCTL is not None and _PRCTL(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), "prctl(PR_SET_CHILD_SUBREAPER)")
