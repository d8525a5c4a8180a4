"""Tolerances and limits of contact and sticking, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

SHORT_DEGREE: Final = 9
"""Degree of the first contact search; the omitted terms of the series count as errors (1/10! = 3e-7)."""

CELL_REACH: Final = 1.0
"""Length of a cell times the largest exponent (or omega). Longer cells need a higher degree, shorter ones cost more."""

MIN_CELLS_PER_PERIOD: Final = 16
"""Minimum number of cells per forcing period; even, because states are recorded every half period."""

MAX_CELLS_PER_PERIOD: Final = 200_000
"""Maximum number of cells per forcing period; a structure that needs more is too stiff for its forcing frequency.
At the maximum a period of one trajectory takes about 10 ms, a point of a map with a thousand periods about 10 s."""

MAX_TABLED_CELLS: Final = 64
"""Maximum number of cells of a tabulated flow; longer flows are composed of several."""

FACTOR_TERMS: Final = 40
"""Terms of the series of the flow over a cell: with exponents of at most CELL_REACH the remainder is below 2**-104."""

CONTACT_ROUNDING: Final = 32.0 * EPSILON
"""Round-off of a Bernstein coefficient of the distance, relative to the sum of the moduli of its terms:
a few operations for the series, 18 additions in the change of basis, as many halvings in a subdivision."""

CHATTER_ACCURACY: Final = 1e-14
"""Error, in units of a cell, at which the remaining impacts of a complete chatter are replaced by their sum.

The series of the remaining time is truncated after its second term. With r that time over the length of a cell and e
the relative change of the contact acceleration within it, the next term is estimated (not bounded) by r (r + e)^2; the
effect of the impacts on the rest of the structure is of third order too. The impacts are computed one by one until the
estimate is below this tolerance, which r = 2e-5 achieves for a constant contact acceleration. The tolerance is a
hundredth of 1e-12, the accuracy of the times of accumulation and release.
"""

CHATTER_CHANGE: Final = 0.5
"""Relative change of the contact acceleration during the remaining impacts of a complete chatter from which on they are
not summed: half of that with which it might vanish before the contact is at rest."""

ANCHORED_GAP: Final = 1e-3
"""Gap to the stop just left, in units of `Stops.unit`, below which it is carried from cell to cell as a separate
number: computed from positions, whose round-off is EPSILON of that unit, it would lose digits."""

HALF_PERIOD_IMPACTS: Final = 50_000
"""Maximum number of impacts in half a forcing period, without those of complete chatter; the trajectory then ends."""

MAX_CHATTER_IMPACTS: Final = 150_000
"""Maximum number of impacts of one complete chatter.

Before the remaining impacts are summed (`CHATTER_ACCURACY`), a chatter has log(1/2e-5)/log(1/R) impacts within a cell,
50 at R = 0.8 and 108,000 at R = 0.9999, and log(n)/log(1/R) in n cells before. For R close to 1, impacts may follow one
another so fast that time hardly advances: the trajectory then ends with the reason TOO_MANY_IMPACTS.
"""

PASSAGE_PARTS: Final = 8
"""Parts of a cell in each of which the displacement has at most one extremum: a cell spans one radian of the fastest
oscillation."""

PASSAGE_STEPS: Final = 4
"""Steps of regula falsi for the time of an extremum. The distance from the stop there has an error of second order in
that of the time, and it is compared with an error that is known to a digit."""

END_OF_REST: Final = 0.125
"""Part of a cell after a rest on a stop in which the sign of the slope may be that of round-off."""

CLEARED: Final = 1.0 - 1e-12
"""Fraction of a gap below which a bound of a motion excludes all later contacts."""

HIGHEST_ERROR: Final = 1e-13
"""What is added to the largest displacement of a steady motion in several harmonics, over the sum of their moduli,
besides round-off, so that it is an upper bound. A maximum without curvature is found to within 1e-14 (`PEAK_RANGE`)."""
