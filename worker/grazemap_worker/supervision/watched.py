"""The state of a worker in memory that it shares with its supervisor, which can read it even when the worker hangs."""

from __future__ import annotations

import ctypes
import mmap
import time


class Watched(ctypes.Structure):
    """The shared state of a worker; `shared` makes one in memory that forked processes share."""

    _fields_ = (
        ("signs", ctypes.c_uint64),
        ("tile_began", ctypes.c_double),
        ("processor_began", ctypes.c_double),
        ("job", ctypes.c_char * 64),
        ("asked_to_stop", ctypes.c_bool),
    )

    signs: int
    """Number of signs of life that the worker has given."""
    tile_began: float
    """When the worker began to compute its small tile, in monotonic seconds; 0.0: it computes none."""
    processor_began: float
    """Processor time of the worker at that moment."""
    job: bytes
    """Id of the job of that tile."""
    asked_to_stop: bool
    """Whether the worker is to end after its current tile."""
    _heard = 0

    @classmethod
    def shared(cls) -> Watched:
        """Return a new shared state."""
        state = cls.from_buffer(mmap.mmap(-1, ctypes.sizeof(cls)))
        state.reset()
        return state

    def reset(self) -> None:
        """Reset the state for another worker."""
        self.tile_began, self.asked_to_stop = 0.0, False

    def beat(self) -> None:
        """Give a sign of life of the worker."""
        self.signs += 1

    def heard(self) -> bool:
        """Return whether the worker has given a sign of life since the last call; for the supervisor."""
        before, self._heard = self._heard, self.signs
        return self.signs != before

    def report_small_tile(self, job_id: str) -> None:
        """Record that the worker begins the small tile of a job or, with an empty id, that it has finished it."""
        self.beat()
        if job_id:
            self.job, self.processor_began = job_id.encode(), time.process_time()
        self.tile_began = time.monotonic() if job_id else 0.0
