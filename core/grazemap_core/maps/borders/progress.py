"""Progress of explaining a map's borders, as one number that never decreases.

Each stage reports the share of it that is done; a listener is called at every thousandth of the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

Report = Callable[[int, int], object]
"""Called with (done, total)."""

TOTAL: Final = 1000
"""Total number of steps."""

Stage = tuple[float, float]
"""Shares of the whole that are done at the beginning and at the end of a stage."""

REGIONS: Final[Stage] = (0.0, 0.05)
"""The orbits of all points are found."""
ACROSS: Final[Stage] = (0.05, 0.2)
"""The orbits of border pairs are solved for at the other point."""
COEXISTING: Final[Stage] = (0.2, 0.3)
"""The motions that exist at both points are followed."""
CURVES: Final[Stage] = (0.3, 1.0)
"""The motions that end are followed to their curves. This takes longest, unless a map is fine and its motions few."""


class BorderProgress:
    """Report progress to a listener; the number never decreases, and stays below the total."""

    def __init__(self, report: Report | None) -> None:
        """Take the listener, or None."""
        self._report = report
        self._reported = 0

    def stage(self, stage: Stage, share: float) -> None:
        """Report the share of a stage that is done."""
        done = min(int(TOTAL * (stage[0] + (stage[1] - stage[0]) * share)), TOTAL - 1)
        if self._report is not None and done > self._reported:
            self._reported = done
            self._report(done, TOTAL)
