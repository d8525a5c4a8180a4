"""What a worker tells its supervisor, in memory that they share: a worker that hangs cannot tell it by itself."""

from __future__ import annotations

import ctypes
import mmap
import time


class Watched(ctypes.Structure):
    """Values in memory that is shared with forked processes; `shared` makes them."""

    _fields_ = (
        ("signs", ctypes.c_uint64),
        ("computing", ctypes.c_double),
        ("processor_seconds", ctypes.c_double),
        ("job", ctypes.c_char * 64),
        ("asked_to_stop", ctypes.c_bool),
    )

    signs: int
    """How often the worker has said that it does something."""
    computing: float
    """Since when it has computed a small tile; 0.0: it computes none."""
    processor_seconds: float
    """The processor time that it had taken then."""
    job: bytes
    """The job of that tile."""
    asked_to_stop: bool
    """Whether the worker is to stop after what it does."""
    _heard = 0

    @classmethod
    def shared(cls) -> Watched:
        """Return new ones."""
        made = cls.from_buffer(mmap.mmap(-1, ctypes.sizeof(cls)))
        made.reset()
        return made

    def reset(self) -> None:
        """Begin anew, for another worker."""
        self.computing, self.asked_to_stop = 0.0, False

    def beat(self) -> None:
        """Say that the worker does something."""
        self.signs += 1

    def heard(self) -> bool:
        """Return whether the worker has said so since the last call, in the process that watches it."""
        before, self._heard = self._heard, self.signs
        return self.signs != before

    def compute(self, job_id: str) -> None:
        """Say that the worker begins to compute the tile of a job; empty: that it has computed it."""
        self.beat()
        if job_id:
            self.job, self.processor_seconds = job_id.encode(), time.process_time()
        self.computing = time.monotonic() if job_id else 0.0
