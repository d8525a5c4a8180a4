"""Tolerances and limits of contact and sticking, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

SHORT_DEGREE: Final = 9
"""Degree at which the contact search tries first, the rest of the series being counted as error (1/10! = 3e-7)."""

CELL_REACH: Final = 1.0
"""Length of a cell times the largest exponent (or omega). Larger cells need a higher degree, smaller ones cost more."""

LEAST_CELLS: Final = 16
"""Cells per forcing period at least; even, because the motion is read off every half period."""

CONTACT_ROUNDING: Final = 32.0 * EPSILON
"""Round-off of a Bernstein coefficient of the distance, relative to the sum of the terms that it was added up from:
a few operations for the series, 18 additions in the change of basis, as many halvings in a subdivision."""

CHATTER_ACCURACY: Final = 1e-14
"""Error left, in units of a cell, when the remaining bounces of a complete chatter are summed up by their limit.

The series of the remaining time is cut behind its second term. With r that time over the cell's length and e the
relative change of the pressing within it, the next term is estimated (not bounded) by r (r + e)^2; what the bounces do
to the other masses is of the third order too. The bounces are followed one by one until it is below this, which
r = 2e-5 does where the pressing is steady: a hundredth of the 1e-12 that accumulation and release are good to.
"""

ANCHORED_GAP: Final = 1e-3
"""Gap to the stop just left, in units of the clearance, below which it is carried from cell to cell by itself: read off
positions, whose round-off is EPSILON of the clearance, it would lose digits in slow bounces."""

HALF_PERIOD_IMPACTS: Final = 50_000
"""Impacts in half a forcing period, beside those of complete chatter, after which a trajectory is given up."""

COMPLETE_CHATTERS: Final = 2
"""Complete chatters in half a forcing period whose bounces are followed beside those: one on each stop."""

LONGEST_CHATTER: Final = 150_000
"""Bounces of one complete chatter that are waited for.

A chatter has log(1/2e-5)/log(1/R) of them within a cell before its rest is summed up (`CHATTER_ACCURACY`), 50 at R =
0.8 and 108,000 at R = 0.9999, and log(n)/log(1/R) in n cells before. Closer to 1, and at 1, mass 1 may in effect slide
on the stop, and time practically stand still: it is followed for as many bounces as this and then given up with that
reason.
"""

CLEARED: Final = 1.0 - 1e-12
"""Share of the clearance that the envelope of a motion must stay below to be called free of contact for ever."""
