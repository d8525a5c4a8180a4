"""How much of explaining a map's borders is done, as one number that only rises.

What is done of each stage flows in, as a share; whoever waits is told of every thousandth of the whole.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

Report = Callable[[int, int], object]
"""Called with (done, total)."""

TOTAL: Final = 1000
"""Parts of the whole."""

_REGIONS, _ACROSS, _COEXISTING = 0.05, 0.2, 0.3
"""Of the whole, at the end of each stage but the last: finding the orbits of all points, solving for those of border
pairs at the other point, following the motions that are there at both, and then those that end, to their curves. The
last one is the longest unless a map is fine and its motions are few."""


class BorderProgress:
    """Tells a listener how far the work is; never less than before, and never that it is over."""

    def __init__(self, report: Report | None) -> None:
        """Take who is told, if anybody is."""
        self._report = report
        self._told = 0

    def regions(self, share: float) -> None:
        """Say what share of the points has been looked at."""
        self._say(_REGIONS * share)

    def across(self, share: float) -> None:
        """Say what share of the border pairs has been solved for at the other point."""
        self._say(_REGIONS + (_ACROSS - _REGIONS) * share)

    def coexisting(self, share: float) -> None:
        """Say what share of the pairs with both motions at both points has been followed."""
        self._say(_ACROSS + (_COEXISTING - _ACROSS) * share)

    def curves(self, share: float) -> None:
        """Say what share of the borders at which a motion ends is explained, or given up."""
        self._say(_COEXISTING + (1.0 - _COEXISTING) * share)

    def _say(self, share: float) -> None:
        done = min(int(TOTAL * share), TOTAL - 1)
        if self._report is not None and done > self._told:
            self._told = done
            self._report(done, TOTAL)
