"""Memory that a worker and its supervisor share.

The worker writes its state, and the supervisor can read the state even when the worker hangs.
"""

from __future__ import annotations

import ctypes
import mmap
import time


class SharedWorkerState(ctypes.Structure):
    """The state of a worker. Create it with `shared`, so that forked processes see the same memory."""

    _fields_ = (
        ("beats", ctypes.c_uint64),
        ("tile_began", ctypes.c_double),
        ("processor_time_at_begin", ctypes.c_double),
        ("job", ctypes.c_char * 64),
        ("asked_to_stop", ctypes.c_bool),
    )

    beats: int
    """Number of signs of life that the worker has given."""
    tile_began: float
    """When the worker began to compute its small tile, in monotonic seconds; 0.0: it computes none."""
    processor_time_at_begin: float
    """Processor time of the worker when it began the small tile."""
    job: bytes
    """Id of the job of the small tile."""
    asked_to_stop: bool
    """Whether the worker is to end after its current tile."""
    # `beats` at the last call of `heard`; it is not shared, but lives in the supervisor only
    _heard = 0

    @classmethod
    def shared(cls) -> SharedWorkerState:
        """Return a new shared state, all zero."""
        return cls.from_buffer(mmap.mmap(-1, ctypes.sizeof(cls)))

    def reset(self) -> None:
        """Reset the state for another worker; signs of life of the previous worker no longer count."""
        self.tile_began, self.asked_to_stop = 0.0, False
        self.heard()

    def beat(self) -> None:
        """Give a sign of life of the worker."""
        self.beats += 1

    def heard(self) -> bool:
        """Return whether the worker has given a sign of life since the last call; for the supervisor."""
        before, self._heard = self._heard, self.beats
        return self._heard != before

    def report_small_tile(self, job_id: str) -> None:
        """Record that the worker begins the small tile of a job or, with an empty id, that it has finished it."""
        self.beat()
        if job_id:
            self.job, self.processor_time_at_begin = job_id.encode(), time.process_time()
        self.tile_began = time.monotonic() if job_id else 0.0
