"""Tolerances and limits of trajectories, period detection and growth, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

END_ROUNDING: Final = 1.0 + 4.0 * EPSILON
"""Factor on the end of a record up to which a time counts as inside: the end has three roundings, a given time one."""

LENGTH_ROUNDING: Final = 16.0 * EPSILON
"""Length, relative to the sum of the moduli of its terms, up to which it is round-off and no unit of length: the gap of
a stop at the equilibrium, whose place is a few roundings of a solution, or the distance of a state from its stop."""

COORDINATE_ROUNDING: Final = 2.0 * EPSILON
"""Round-off of a contact coordinate of several displacements, or of its velocity, relative to the sum of the moduli of
its terms: four roundings, of both factors of a term, of their product and of the sum."""

CLOSING_GOAL: Final = 1e-9
"""Largest distance of a return, in units of the clearance, at which the stroboscopic orbit counts as closed: a thousand
times CLOSING_FLOOR, so that round-off does not hide it, and a thousandth of the distance at which a smaller period is
excluded (SEPARATION)."""

CLOSING_FLOOR: Final = 1e-12
"""Distance of a return that is round-off: it does not determine a rate of convergence."""

LIMIT_DISTANCE: Final = 1e-8
"""Largest extrapolated distance to the limit, return * rate / (1 - rate), at which the period of a motion is accepted.
A return at CLOSING_GOAL suffices up to the rate 0.9; slower motions go on to closer returns."""

SLOWEST_RATE: Final = 0.999
"""Contraction per motion period above which the motion is unresolved: the limit is a thousand returns away, and the
extrapolation multiplies the relative error of the rate by a thousand."""

SEPARATION: Final = 100.0
"""A smaller period is excluded at this many times LIMIT_DISTANCE; an impact counts as no graze when its squared speed
(in units of omega * clearance) is this many times the distance to the limit."""

APPROACH_RATE: Final = 0.99
"""Contraction per return from which on a trajectory does not count as convergent, unless the orbit was verified. At
this rate the distance takes 230 returns to decrease by a factor of ten."""

GRAZE_SPEED_RATIO: Final = 4.0
"""Square of the slowest impact speed (in units of omega * clearance) over the distance to an orbit, up to which it is
uncertain whether the orbit touches the stop. Such an orbit is not used. Without the stop the motion would go beyond it
by half of this square, if its acceleration is omega^2 times the clearance: by twice the distance."""

MIN_SAFE_SQUARE: Final = 1e-280
"""Sums of squares below this, or above its inverse, may have lost digits by underflow or overflow: a square that is
EPSILON of the sum is then still a normal number, above 2e-308."""

RANK_ROUNDING: Final = 64.0 * EPSILON
"""Relative residual of a perturbation after projection on the others up to which it is in their span: round-off."""

EXPONENT_WINDOWS: Final = 12
"""Number of windows of a run from whose means the standard error of an exponent is computed. At 1000 periods of a map
a window has 58 periods: the growth along chaotic motions remembers far less in most cases."""

EXPONENT_STUDENT: Final = 1.28331
"""Factor on the standard error of the mean of the windows, as their spread is known from so few: by Student's
distribution with EXPONENT_WINDOWS - 1 degrees of freedom, three errors then have the probability of three standard
errors of a normal variable, 99.7 %."""

SHORTEST_WINDOW: Final = 3
"""Minimum number of forcing periods of a window."""

EXPONENT_MARGIN: Final = 5.0
"""Standard errors between zero and an exponent of decided sign; exceeded by chance once in forty thousand cases."""

GROWTH_SURE: Final = 18.0
"""Growth of perturbations, in nats, over either half of a run above which a motion is chaotic, however uneven the
growth is. Over both halves it enlarges round-off to the size of the motion. For a periodic or quasi-periodic motion the
sum is bounded by less than this, however slow the impacts are."""

GROWTH_BOUND: Final = 1.5
"""Range of the summed growth over a run, in units of the minimum range over its eighths, up to which it is bounded:
1 for a bounded sum, above sqrt(8) = 2.8 for a random walk, 8 for a drift."""

GROWTH_DRIFT: Final = 0.05
"""Weighted growth over a whole run, in nats, up to which the largest exponent counts as zero. Of fifty motions of
random systems with bounded growth over 500 periods, 47 were still tori after 20,000. Over 1,000 periods the growth of
43 of them was less than this; 4, of up to 0.19, stay undecided. The growth of the three that settle was 0.078 or more,
so none of them is called a torus (`make tolerance-sizes`)."""

ORBIT_EXTENT: Final = 0.02
"""Relative change of the extent of a quasi-periodic orbit from the first half of the run to the second. Means over a
torus converge as the inverse number of periods; a spiral below this change over a thousand periods shrinks by less than
4e-5 per period."""

MIN_ORBIT_EXTENT: Final = 1e-6
"""Minimum extent of a quasi-periodic orbit in units of the clearance, well above CLOSING_GOAL."""

ROUND_OFF_RETURNS: Final = 10
"""Returns without a decrease of the distance, once it is below CLOSING_FLOOR, after which it is round-off."""

EVENTS: Final = 64
"""Initial capacity of the record of a run, in events; it is made four times as large whenever it is full."""

RECORD_BLOCK: Final = 64
"""Half periods of a transient after which its events are discarded, so that the record stays short."""

TRANSIENT_EVENTS: Final = 4096
"""Events of a transient after which they are discarded within such a block too, once a half period has fewer."""

MOST_RECORD_BYTES: Final = 256 << 20
"""Default of the maximum bytes that the events of a trajectory take in a result."""

ROWS_OF_RESULT: Final = 2
"""Bytes of the record's rows, which have the states after the events, over the bytes that its events may take in a
result. With few masses the latter are fewer; with many masses this bounds the memory of a run."""

PANEL_REACH: Final = 2.0
"""Length of a panel, over which an output has one Taylor series, times the largest exponent or frequency."""

PANEL_DEGREE: Final = 22
"""Degree of the series in a panel; the first term that is left out is PANEL_REACH^23/23! = 3e-16."""

PEAK_ACCURACY: Final = 1e-14
"""Accuracy of the peak of an output, relative to the sum of the moduli of its terms; round-off is a few EPSILON of it.
A value found by bisection differs from the peak in second order, so this costs about twenty bisections."""

PEAK_DEPTH: Final = 64
"""Number of intervals that may wait in the search for a peak, one for every bisection in a row. PEAK_ACCURACY ends it
after 27 bisections at the latest (`output_rows._raise_peak`)."""

AVERAGED_PERIODS: Final = 100
"""Forcing periods over which quantities of a chaotic or quasi-periodic motion are averaged. A tenth of those in which a
map finds that the motion is chaotic; the means of chaotic motions are then known to a few percent."""

CLOSING_RETURNS: Final = 64
"""Maximum number of periods in which a motion that was named by its returns is followed until it closes to round-off,
before quantities of one period are computed."""

CLOSED: Final = 1e-14
"""Distance of a return, in units of the stops, that counts as round-off at once."""

NEAR_EXPONENTS: Final = 2.0**-14
"""Distance of two exponents, relative to their moduli, below which they share a group in multi-precision arithmetic.
Modes farther apart lose at most 14 bits, fewer than a time that is solved for, and double precision still locates the
contacts of their sums."""

VANISHING_EXPONENT: Final = EPSILON
"""Modulus, relative to the largest one, of an exponent that double precision does not tell from 0. Both exponents of a
free mode are 0, and runs with the fewest bits find them to half of these 128 bits."""

GROUP_SHIFT: Final = 2.0**-10
"""Distance from the center of a group, relative to that of the next exponent, at which the equations are inverted.
Every turn of the inverse iteration gains about ten bits, and a solution with the nearly singular matrix loses twice as
many, for which twice the bits are enough."""

NEGLIGIBLE_TERM: Final = 2.0**-100
"""Part of the largest term of a polynomial of time below which its terms are left out. Double precision shows 2^-53 of
a sum; the terms are compared in coordinates of different units."""

SAMPLES_AT_ONCE: Final = 128
"""Samples of a motion that are taken at once in multi-precision arithmetic, from one table of exponentials."""

SAMPLE_ANGLE: Final = 0.1
"""Time between two samples, in units of 1 over the largest modulus of an exponent. Between two samples a gap is smaller
than at them by at most a thousandth of the size of the motion."""

SAMPLE_PARTS: Final = 16
"""Number of parts into which an interval between samples is divided where a contact is possible."""

FINEST_ANGLE: Final = 1e-6
"""Length of an interval, in the same units, below which full precision decides: over it the gap differs from a straight
line by about SUM_ROUNDING."""

SUM_ROUNDING: Final = 1e-13
"""Error of a displacement in double precision, in units of the sum of the moduli of its terms."""

MOST_SUM_ROUNDING: Final = 1e-3
"""Limit of this error, in units of `Stops.unit`: a larger one would not exclude contacts at too many samples."""

LONGEST_ANGLE: Final = 100.0
"""Time since the origin of the exponentials, in the same units, after which the origin moves: the rounding of the
arguments of the exponentials, 1e-16 of them, stays below SUM_ROUNDING."""

CONTACT_BRACKET: Final = 1e-15
"""Relative accuracy of the first approximation of the time of a contact, a few roundings of a double."""

CONTACT_HALVINGS: Final = 20
"""Number of halvings of an interval shorter than FINEST_ANGLE around a slow impact, before Newton's method."""

CONTACT_NEWTON_STEPS: Final = 60
"""Maximum number of steps of Newton's method for the time of a contact; it needs many only beside a graze."""

SOLVED_BITS_LESS: Final = 24
"""Bits by which a solved time may be less accurate than the arithmetic."""

COARSE_BITS: Final = 128
"""Least precision of the first step of Newton's method, and precision of states that are rounded to doubles."""

BOUNCE_ANGLE: Final = 1e-4
"""Time of a flight back to the stop, in the same units, below which it follows from velocity and acceleration."""

SHORTEST_FLIGHT: Final = 1e-6
"""Time between two impacts on one stop, in forcing periods, below which they are those of a chatter."""

CHATTER_BITS: Final = 1 / 3
"""A chatter is followed until a flight of t forcing periods has t < 2^(-bits/3). The rest, left out, costs about t^2,
and rounding about 2^-bits/t; the exponent makes these equal."""

MOST_RESTS: Final = 100
"""Number of rests on a stop after which a run ends: orbits with rests are not verified, so nothing is decided later."""

SAME_BITS: Final = 60
"""Impacts whose times differ by less than 2^-SAME_BITS forcing periods are the same."""

LAST_IMPACTS: Final = 8
"""Number of last impacts that show to how many bits a run is known."""

IMPACT_BITS: Final = 1000
"""Bits that count in addition for every impact, for the work that does not depend on the precision."""

MODES_PER_IMPACT: Final = 9
"""N^3 over this is the number of impacts that take as long as computing the modes of N masses."""
