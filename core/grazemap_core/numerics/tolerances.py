"""Tolerances and limits of numerical kernels, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

TAYLOR_DEGREE: Final = 18
"""Degree of the Taylor series of q on a cell. With cells of at most CELL_REACH / |lambda| the first omitted term is
below 1/19! = 8e-18 of the amplitude of a mode; the contact test adds a bound of it nevertheless."""

QR_STEPS: Final = 60
"""Maximum number of QR steps for one eigenvalue; two or three are usual."""

EXCEPTIONAL_SHIFT: Final = 10
"""Number of QR steps for one eigenvalue after which an exceptional shift is used, as in LAPACK."""

PRODUCT_BY_ROWS: Final = 24
"""Size of a matrix from which on products are computed row by row, in vectors. The compiler makes none of smaller ones,
whose preparations would cost several times as much."""

MAX_DEPTH: Final = 60
"""Maximum number of halvings of [0, 1], which bounds the memory for pieces; after 50 they are of the size MIN_WIDTH."""

SHORT_DEPTH: Final = 6
"""Maximum number of halvings in a search on the first terms alone: beyond it the full series decides faster."""

UNDECIDED_ERRORS: Final = 4.0
"""Largest coefficient of a piece, in units of their error, at which the piece is not halved further: the distance is
zero to within a few errors on all of it. What is left undecided is reported, so a larger number misses no contact."""

ROOT_STEPS: Final = 100
"""Newton or bisection steps for a zero in a bracket: bisection alone needs 53 for a double, so it is never reached."""

ROOT_WIDTH: Final = 1.2e-16
"""Relative step at which a zero is found: just above half of EPSILON, so that the next step would round to the same
number."""

START_STEPS: Final = 3
"""Newton steps for a zero next to the start of an interval; the start is within round-off of it."""

GRAZE_SLOPE: Final = 64.0
"""Slope squared, over error times second derivative, above which a distance that is zero to within its error at the end
of a step is an impact and not a graze: at a graze the ratio is a few units."""

MIN_WIDTH: Final = 1e-15
"""Length of a piece of [0, 1] that is not halved again: a few EPSILON."""

RANGES_PER_ORDER: Final = 4
"""First number of ranges of the phase in the search for peaks, per order of the highest harmonic: a wave of it is cut
into four, in which its curvature changes little."""

PEAK_RANGE: Final = 1e-5
"""Half of a range of the phase in which a polynomial may not be concave, times the highest order, below which it is not
halved further. Its cube, to which values in it differ from that in its middle, is below a few roundings."""

RATE_RANGE: Final = 0.25
"""Variation of the slope in a range of the phase, over that by the change of omega in a cell, below which the range is
not halved further."""

PEAK_ROUNDOFF: Final = 8.0 * EPSILON
"""Round-off of a trigonometric polynomial at a phase, relative to the sum of its amplitudes times 1 + order: some for
the amplitudes, and those of the angle order times phase."""

PEAK_STEPS: Final = 60
"""Maximum number of Newton or bisection steps for a peak."""
