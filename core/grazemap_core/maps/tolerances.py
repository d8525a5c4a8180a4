"""Tolerances and limits of maps, basins and borders, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

SETTLING_IMPACTS: Final = 5_000_000
"""Impacts, beside those that complete chatter may take in every half period, after which a trajectory that has not
settled is given up: several seconds. Thousands are the rule; between very close stops there is no limit to them."""

LANE_DEGREE: Final = 14
"""Degree of the polynomials over a cell in the lockstep kernel, about its middle (see CELL_REACH): the term left out is
below (CELL_REACH / 2)^15 / 15! = 2e-17 of a mode's amplitude. The kernels are written out for this degree."""

LANE_SURE: Final = 1e-7
"""What the certificates of the lockstep kernel must hold by, relative to the terms of the gap. Above the square root of
round-off: then a root that round-off moves is still the only one. Lanes below it are followed more carefully."""

MOST_FUSED_MASSES: Final = 5
"""Masses up to which the lockstep kernel advances all blocks in one loop; the compiler unrolls no more."""

APPROACH: Final = 1e-4
"""Return, in units of the clearance, from which on the periodic orbit that a trajectory comes ever closer to is solved
for. What is found counts only where it is proven."""

APPROACH_RETRY: Final = 1e-2
"""What APPROACH is multiplied by where nothing was proven."""

EXTRAPOLATED_FROM: Final = 1e-3
"""Return, in units of the clearance, from which on the limit of a trajectory's returns is looked for where nothing can
be proven: it has to close there by itself. From ten times as far it takes as long."""

FARTHEST_LEAP: Final = 4.0
"""Distance of that limit at most, in units of what the returns extrapolate to one by one."""

STAYED: Final = 0.5
"""Return after a leap at most, in units of the one before it: one that led to another motion does not stay so close."""

COARSEST_SPACING: Final = 8
"""Steps of the grid between neighbours of an adaptive map's first lattice, a power of 2: one point in 64 is computed
everywhere. A region between two of its lines is found only by way of what is computed beside its neighbours."""

SAME_APPROACH: Final = 2.0
"""Neighbours that settle to motions of one name count as alike as long as the contractions of their ways there, whose
logarithms are the periods until settled times the largest exponent, differ by this at most: by a factor of 7. Over a
cell in which trajectories go one way the periods hardly change; where they differ more, some went elsewhere first, and
other motions are likely to be near. A larger number computes fewer points and overlooks more (docs/adaptive.md)."""

MOST_CONTRACTION: Final = 36.0
"""Logarithm of the contraction of a forcing period, at most: all digits of a binary64 number. Where mass 1 rests on a
stop nothing may be left of a change."""

APPARENT: Final = 8.0
"""Distance of impacts, in units of that of the orbit, up to which they count as the same ones a shorter time later: two
states at that distance from an orbit are at most twice as far apart. Where they are not the same, time is lost only."""

SAME_SPEED: Final = 1e-6
"""Difference of the slowest impacts of two orbits, in units of omega * clearance, up to which they are one. A motion
that a map has proven is known to round-off; neighbouring families of one name are apart by far more, but for points
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
"""Growth counts from the tenth of the half periods on in which it is measured: an even number, twice one in so many."""

MOST_GROWTH_PERIODS: Final = 2000
"""Forcing periods over which the growth of changes is measured, at most."""
