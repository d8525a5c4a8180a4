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

_REGIONS, _ACROSS, _COEXISTING = 0.05, 0.2, 0.3
"""Share of the whole that is done at the end of each stage but the last. The stages find the orbits of all points,
solve for those of border pairs at the other point, follow the motions that exist at both points, and follow the motions
that end to their curves. The last stage is the longest, unless a map is fine and its motions are few."""


class BorderProgress:
    """Report progress to a listener; the number never decreases, and stays below the total."""

    def __init__(self, report: Report | None) -> None:
        """Take the listener, or None."""
        self._report = report
        self._reported = 0

    def regions(self, share: float) -> None:
        """Report the share of the points that have been searched."""
        self._report_share(_REGIONS * share)

    def across(self, share: float) -> None:
        """Report the share of the border pairs that have been solved for at the other point."""
        self._report_share(_REGIONS + (_ACROSS - _REGIONS) * share)

    def coexisting(self, share: float) -> None:
        """Report the share of followed pairs among those with both motions at both points."""
        self._report_share(_ACROSS + (_COEXISTING - _ACROSS) * share)

    def curves(self, share: float) -> None:
        """Report the share of explained or abandoned borders among those at which a motion ends."""
        self._report_share(_COEXISTING + (1.0 - _COEXISTING) * share)

    def _report_share(self, share: float) -> None:
        done = min(int(TOTAL * share), TOTAL - 1)
        if self._report is not None and done > self._reported:
            self._reported = done
            self._report(done, TOTAL)
