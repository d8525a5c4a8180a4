"""What a worker tells its supervisor, in memory that they share: a worker that hangs cannot tell it by itself."""

from __future__ import annotations

import mmap
import struct
import time

_DOUBLES = struct.Struct("3d")


class Watched:
    """Three numbers in memory that is shared with forked processes.

    Attributes
    ----------
    seen : float
        When the worker was last seen to do something, on the monotonic clock.
    computing : float
        Since when it has computed a small tile; 0.0: it computes none.
    stops : float
        1.0 asks the worker to stop after what it does.
    """

    def __init__(self) -> None:
        self._memory = mmap.mmap(-1, _DOUBLES.size)
        self.reset()

    def reset(self) -> None:
        """Begin anew, for another worker."""
        _DOUBLES.pack_into(self._memory, 0, time.monotonic(), 0.0, 0.0)

    def _set(self, index: int, value: float) -> None:
        struct.pack_into("d", self._memory, 8 * index, value)

    def _get(self, index: int) -> float:
        return float(struct.unpack_from("d", self._memory, 8 * index)[0])

    @property
    def seen(self) -> float:
        """When the worker was last seen."""
        return self._get(0)

    @property
    def computing(self) -> float:
        """Since when it computes a tile."""
        return self._get(1)

    @property
    def asked_to_stop(self) -> bool:
        """Whether it was asked to stop."""
        return self._get(2) != 0.0

    def beat(self) -> None:
        """Say that the worker does something."""
        self._set(0, time.monotonic())

    def compute(self, begins: bool) -> None:
        """Say that the worker begins to compute a tile, or has computed it."""
        self.beat()
        self._set(1, time.monotonic() if begins else 0.0)

    def ask_to_stop(self) -> None:
        """Ask it to stop after what it does."""
        self._set(2, 1.0)
