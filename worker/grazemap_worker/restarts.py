"""Decides when an ended process is started again: at once, or after a pause when it ends again and again."""

from __future__ import annotations

import time

# A process that lived this long is started again at once. One that ends again and again earlier is started at once for
# the first time, and then after 0.4, 0.8, ... s, up to MAX_WAIT_SECONDS.
HEALTHY_SECONDS = 10.0
MAX_WAIT_SECONDS = 5.0
_MOST_DOUBLINGS = 10  # of 0.1 s: longer than that wait


class Restarts:
    """The starts and ends of one process; `deaths` is the number of recent ends."""

    deaths = 0
    _started = 0.0
    _not_before = 0.0

    @property
    def due(self) -> bool:
        """Whether the pause since the last end is over."""
        return time.monotonic() >= self._not_before

    def started(self) -> None:
        """Record a start."""
        self._started = time.monotonic()

    def ended(self, *, blameless: bool = False) -> None:
        """Record an end. After a `blameless` one, the next start follows without a pause."""
        now = time.monotonic()
        self.deaths = 1 if blameless or now - self._started > HEALTHY_SECONDS else self.deaths + 1
        self._not_before = now + (
            min(MAX_WAIT_SECONDS, 0.1 * 2 ** min(self.deaths, _MOST_DOUBLINGS)) if self.deaths > 1 else 0.0
        )
