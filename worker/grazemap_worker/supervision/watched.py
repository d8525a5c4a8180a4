"""What a worker tells its supervisor, in memory that they share: a worker that hangs cannot tell it by itself."""

from __future__ import annotations

import ctypes
import mmap
import time


class Watched(ctypes.Structure):
    """Three values in memory that is shared with forked processes; `shared` makes them.

    Attributes
    ----------
    seen : float
        When the worker was last seen to do something, on the monotonic clock.
    computing : float
        Since when it has computed a small tile; 0.0: it computes none.
    asked_to_stop : bool
        Whether the worker is to stop after what it does.
    """

    _fields_ = (("seen", ctypes.c_double), ("computing", ctypes.c_double), ("asked_to_stop", ctypes.c_bool))

    seen: float
    computing: float
    asked_to_stop: bool

    @classmethod
    def shared(cls) -> Watched:
        """Return new ones."""
        made = cls.from_buffer(mmap.mmap(-1, ctypes.sizeof(cls)))
        made.reset()
        return made

    def reset(self) -> None:
        """Begin anew, for another worker."""
        self.seen, self.computing, self.asked_to_stop = time.monotonic(), 0.0, False

    def beat(self) -> None:
        """Say that the worker does something."""
        self.seen = time.monotonic()

    def compute(self, begins: bool) -> None:
        """Say that the worker begins to compute a tile, or has computed it."""
        self.beat()
        self.computing = time.monotonic() if begins else 0.0
