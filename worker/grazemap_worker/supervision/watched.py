"""What a worker tells its supervisor, in memory that they share: a worker that hangs cannot tell it by itself."""

from __future__ import annotations

import ctypes
import mmap
import time


class Watched(ctypes.Structure):
    """Values in memory that is shared with forked processes; `shared` makes them.

    Attributes
    ----------
    seen : float
        When the worker was last seen to do something, on the monotonic clock.
    computing : float
        Since when it has computed a small tile; 0.0: it computes none.
    processor_seconds : float
        The processor time that it had taken then.
    job : bytes
        The job of that tile.
    asked_to_stop : bool
        Whether the worker is to stop after what it does.
    """

    _fields_ = (
        ("seen", ctypes.c_double),
        ("computing", ctypes.c_double),
        ("processor_seconds", ctypes.c_double),
        ("job", ctypes.c_char * 64),
        ("asked_to_stop", ctypes.c_bool),
    )

    seen: float
    computing: float
    processor_seconds: float
    job: bytes
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

    def compute(self, job_id: str) -> None:
        """Say that the worker begins to compute the tile of a job; empty: that it has computed it."""
        self.beat()
        if job_id:
            self.job, self.processor_seconds = job_id.encode(), time.process_time()
        self.computing = time.monotonic() if job_id else 0.0
