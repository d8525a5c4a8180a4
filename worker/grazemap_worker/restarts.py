"""When a process that ended is started again: at once, but after pauses where it ends again and again."""

from __future__ import annotations

import time

# A process that lived this long is not part of a crash loop; others wait 0.2, 0.4, ... s before the next start.
HEALTHY_SECONDS = 10.0
LONGEST_WAIT = 5.0


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
        """Take note of a start."""
        self._started = time.monotonic()

    def ended(self, *, blameless: bool = False) -> None:
        """Take note of an end; a blameless one is no reason for a pause."""
        now = time.monotonic()
        self.deaths = 1 if blameless or now - self._started > HEALTHY_SECONDS else self.deaths + 1
        self._not_before = now + (min(LONGEST_WAIT, 0.1 * 2**self.deaths) if self.deaths > 1 else 0.0)
