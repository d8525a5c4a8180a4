"""Tolerances and limits of the grazing curve and its points, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

NEAR_DOUBLE_WIDTH: Final = 1.0e-10
"""Relative width of an interval below which an undecided pair of zeros is reported as one near-double zero.

Round-off hides two zeros that are closer than about sqrt(EPSILON) = 1.5e-8 of a period; this is well below.
"""

MAX_CELLS: Final = 250_000
"""Cells after which root isolation gives up with a message: some 4e4 zeros of one function, hence 4e5 points.

The default set takes 415 to 595 cells a function over (0.05, 2.5): five to eight a zero.
"""

MOST_SPREAD: Final = 1e9
"""Largest stop/start of an interval of omega. Far below 1/EPSILON, so that halving the interval of half periods keeps
its ends apart; searches over wider ones would need more than MAX_CELLS anyway."""

END_WIDTH: Final = 1.0e-13
"""Relative amount by which the searched interval is widened, so that a zero at an end is not lost to rounding."""

CONTACT_CELLS: Final = 8
"""Cells in half a forcing period with which the search for a further contact begins; it halves them as bounds ask."""

CONTACT_ROUNDOFF: Final = 64.0 * EPSILON
"""Round-off of the distance to a stop, relative to its terms times the angles in their sines: a few units for the flow
of a block, its state and the sums (`RESPONSE_ROUNDOFF`), and as many for the coefficient that multiplies them."""

LEAST_CONTACT_CELL: Final = 1e-9
"""Length, relative to the time between impacts, below which a cell is not halved any more: a graze whose curvature is
zero too. Its distance is then known to the cube of this times the bound of its third derivative."""

BACKWARD_STEPS: Final = 500
"""Steps of a search back to a stop, or to where mass 1 stood still: up to ten near a graze, hundreds where mass 1
nearly turned before or a fast overdamped mode shortens them; with these spent the mapping counts as not defined."""

BACKWARD_GROWTH: Final = 600.0
"""Largest exponent in a bound of what a decaying mode was before: exp of it is a number still."""

SURE_OF_NEWTON: Final = 0.1
"""Product of value and bound of the second derivative, over the slope squared, at which Newton's method takes over.
Below 1/2 it converges to the one zero nearby (Kantorovich); 0.1 is near enough for four steps."""

HALF_MAP_STEPS: Final = 50
"""Newton steps for the phase at which mass 1 stands still half a period later; near a graze three to five are used."""

HALF_MAP_SETTLED: Final = 1e-10
"""Newton step of that phase, relative to the size of what it is made from, behind which the next one would only move
roundings about: convergence is quadratic."""

FARTHEST_OVERSHOOT: Final = 1024.0
"""Overshoot, in units of the clearance, to which the domain of a discontinuity mapping is followed."""

DOMAIN_WIDTH: Final = 1e-6
"""Relative accuracy of the domain's end: nothing depends on it, and every halving costs hundreds of steps there."""
