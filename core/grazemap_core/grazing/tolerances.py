"""Tolerances and limits of the grazing curve and its points, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

NEAR_DOUBLE_WIDTH: Final = 1.0e-10
"""Relative width of an interval below which an undecided pair of zeros is reported as one near-double zero.

Round-off hides two zeros that are closer than about sqrt(EPSILON) = 1.5e-8 of a period; this is well below.
"""

CELL_ROUNDING: Final = 1.0 + 4.0 * EPSILON
"""Factor on the radius of an interval that covers the rounding of its middle and of its radius."""

SHORTEST_CELL: Final = 8.0 * EPSILON
"""Radius of an interval of omega, relative to its middle, that is not halved again: a few numbers are left in it."""

EQUAL_HEIGHTS: Final = 4.0
"""Difference of two maxima, or a margin, in units of the round-off of a displacement, up to which it may be 0: twice
that of two displacements."""

OMEGA_ACCURACY: Final = 4.0 * EPSILON
"""Relative accuracy of a frequency at which two maxima are equal or a margin vanishes: the smallest that scipy's brentq
takes."""

NEAR_DOUBLE_GAP: Final = 1e-7
"""Relative gap between two undecided intervals of a search for equal maxima up to which they are parts of one. Between
them the maxima differ by a few roundings; this is several times the 1.5e-8 within which round-off hides two zeros."""

MAX_CELLS: Final = 250_000
"""Maximum number of cells of a root isolation: enough for 16,000 zeros of one function, and usually for 40,000. On
fifty random systems a zero takes 6.1 cells in the median of the functions, and 15 at most (`make tolerance-sizes`)."""

ISOLATION_STACK: Final = 256
"""Maximum number of intervals that wait in a root isolation. Each halving adds one. An interval of the relative width 1
is halved 33 times until it has NEAR_DOUBLE_WIDTH; one of MAX_FREQUENCY_RATIO takes 30 more."""

MAX_FREQUENCY_RATIO: Final = 1e9
"""Largest stop/start of an interval of omega. Far below 1/EPSILON, so that halving the interval of half periods
keeps its ends distinct; searches over wider intervals would need more than MAX_CELLS anyway."""

END_WIDTH: Final = 1.0e-13
"""Relative amount by which the interval is widened, so that rounding does not exclude a zero at an end."""

CONTACT_ROUNDOFF: Final = 64.0 * EPSILON
"""Round-off of the distance to a stop, relative to its terms times the angles in their sines: a few units for the flow
of a block, its state and the sums (`RESPONSE_ROUNDOFF`), and as many for the coefficient of the sums."""

BACKWARD_STEPS: Final = 500
"""Maximum number of steps of a backward search: up to ten near a graze, hundreds if the contact nearly came to rest
earlier or a fast overdamped mode shortens them. If more are needed, the mapping counts as undefined."""

BACKWARD_SETTLED: Final = 2.0 * EPSILON
"""Newton step, relative to the time, at which a backward search has converged: it is a rounding of the time."""

BACKWARD_GROWTH: Final = 600.0
"""Largest exponent in a bound of the backward growth of a mode; its exponential does not overflow."""

KANTOROVICH_RATIO: Final = 0.1
"""Product of value and bound of the second derivative, over the slope squared, at which Newton's method starts.
Below 1/2 it converges to the unique zero nearby (Kantorovich); from 0.1 four steps suffice."""

RETURN_STEPS: Final = 50
"""Maximum number of Newton steps for the phase at which the contact is at rest at the next return; three to five are
usual near a graze."""

RETURN_SETTLED: Final = 1e-10
"""Newton step of that phase, relative to the size of its terms, at which the next step would change roundings only:
convergence is quadratic."""

RETURN_ROUNDING: Final = 4.0 * EPSILON
"""Round-off of the velocity of a steady motion in several harmonics where it is 0, relative to the sum of its
terms: a few roundings of each."""

SURFACE_ROUNDING: Final = 16.0 * EPSILON
"""Velocity of a contact coordinate of several displacements, relative to the sum of its terms, up to which it is 0."""

MAX_OVERSHOOT: Final = 1024.0
"""Largest overshoot, in units of the amplitude, at which the domain of a discontinuity mapping is tested."""

FIRST_OVERSHOOT: Final = 1e-3
"""First overshoot, in units of the amplitude, at which the domain is tested; it is doubled from there."""

DOMAIN_WIDTH: Final = 1e-6
"""Relative accuracy of the end of the domain: no result depends on it, and every halving costs hundreds of steps."""
