"""Tolerances and limits of maps, basins and borders, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.contact.tolerances import CHATTER_ACCURACY
from grazemap_core.tolerances import EPSILON

SETTLING_IMPACTS: Final = 5_000_000
"""Maximum number of impacts of a trajectory until it settles, not counting those that complete chatter may take in
every half period: several seconds. Thousands are the rule; between very close stops there is no limit."""

LANE_DEGREE: Final = 14
"""Degree of the polynomials over a cell in the lockstep kernel, about its middle (see CELL_REACH): the term left out is
below (CELL_REACH / 2)^15 / 15! = 2e-17 of a mode's amplitude. The kernels are written out for this degree."""

LANE_SURE: Final = 1e-7
"""Margin of the certificates of the lockstep kernel, relative to the terms of the gap. It is above the square root of
round-off, so that a root that round-off moves is still the only one. Other lanes go through a second pass, or on by
themselves."""

LANE_REST_SHARE: Final = 1e-4
"""Share of a cell after which a rebound ends, were the contact acceleration constant, up to which a lane goes through a
second pass, which decides whether mass 1 may come to rest. It has to exceed the cube root of CHATTER_ACCURACY, 2.2e-5,
the share up to which it may (`event_loop.may_rest`); the factor of 4.6 covers the contact acceleration, which is known
to about five digits there, and costs next to nothing."""
assert LANE_REST_SHARE**3 > CHATTER_ACCURACY

ROOT_CHANGE: Final = 1e-8
"""Last change of a contact by Halley's method, in half cells, up to which it has converged."""

ROOT_SLOPE_CHANGE: Final = 1e-6
"""Relative change of the slope, from the second derivative, up to which it has too. Halley's method is of third order:
the next change would be about the square of this, 1e-12, of the last one, in all 1e-20."""

HALF_PERIOD_EVENTS: Final = 48
"""Events of one half period that a lane can record. A lane with more is run again by itself, for verification and for
the propagation of small changes. Motions have a few impacts in half a period as a rule."""

MOST_FUSED_MASSES: Final = 5
"""Masses up to which the lockstep kernel advances all blocks in one loop; the compiler unrolls no more."""

APPROACH: Final = 1e-4
"""Distance of returns, in units of the clearance, up to which the periodic orbit that a trajectory approaches is solved
for. It counts only if it is verified."""

APPROACH_RETRY: Final = 1e-2
"""Factor on APPROACH after an orbit was not verified."""

COARSEST_SPACING: Final = 8
"""Spacing of an adaptive map's first lattice, in steps of the grid, a power of 2: at least one point in 64 is computed.
A region between two lines of the lattice is found only if points next to it are computed for another reason."""

SAME_APPROACH: Final = 2.0
"""Maximum difference, between neighbours that settle to motions of one name, of the logarithms of the contractions of
their transients: periods until settled times the largest exponent. It is a factor of 7. Within a region of similar
transients the periods hardly change; where they differ more, some trajectories approached another motion first, which
is likely to be near. A larger number computes fewer points and overlooks more (docs/adaptive.md)."""

MOST_CONTRACTION: Final = 36.0
"""Maximum logarithm of the contraction over a forcing period: all digits of a binary64 number. Where mass 1 rests on a
stop a change of the state may vanish."""

APPARENT: Final = 8.0
"""Distance of impacts, in units of that of the orbit, up to which they may repeat after a shorter time: two states at
that distance from an orbit are at most twice as far apart. Where they do not repeat, only time is lost."""

SAME_SPEED: Final = 1e-6
"""Difference of the slowest impacts of two orbits, in units of omega * clearance, up to which they are one. A motion
that a map has verified is known to round-off; neighbouring families of one name are apart by far more, but for points
that a fold or a birth is closer to than 1e-12 of the clearance."""

BORDER_REACH: Final = 0.55
"""Distance from the middle between two neighbouring points of a map, in its steps, up to which a curve separates them:
half a step where it passes between them, and what its chords are away from it."""

BORDER_STEP: Final = 16.0
"""Longest step along a curve that is to explain borders, in steps of the map. Near the default oscillator's
codimension-two point chords of it are 0.03 steps of a 256 x 256 map away from the saddle-node curve."""

END_OF_RANGE: Final = 8.0 * EPSILON
"""Relative difference from the end of its range up to which a branch has arrived there: values and their units are
multiplied and divided."""

BORDER_MARGIN: Final = 1.5
"""Steps of the map by which the window of such a curve is wider than the borders that are left to be explained."""

BORDER_WORK: Final = 500_000
"""Orbits that are followed one way for one border, times the square of their impacts, which is what one takes: all 500
of up to 31 impacts, fifty of a hundred, some seconds. More than 353 impacts are not followed."""

BORDER_LEAST_IMPACTS: Final = 16
"""Impacts up to which an orbit takes as much as one with so many."""

BORDER_FEWEST: Final = 4
"""Orbits below which following is not begun."""

BORDERS_WORK: Final = 100_000_000
"""The same summed over all borders of a map: about twenty minutes. What comes last are motions that few points of
the map have."""

BORDER_SEARCH_PERIODS: Final = 20_000_000
"""Forcing periods at most, of random states together, that are looked through for the motions of a map's points that
neither the trajectory from rest nor a neighbour leads to: a minute."""

GROWTH_SKIPPED: Final = 20
"""Of the half periods in which growth is measured, twice the integer part of one in so many do not count: a tenth."""

MOST_GROWTH_PERIODS: Final = 2000
"""Maximum number of forcing periods over which the growth of changes is measured."""
