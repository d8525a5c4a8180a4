"""Tolerances and limits of maps, basins and borders, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.contact.tolerances import CHATTER_ACCURACY
from grazemap_core.tolerances import EPSILON

LAST_RUNNERS: Final = 8
"""Number of structures whose runners are kept. Points are run structure by structure, so earlier ones are hardly asked
for again."""

BYTES_OF_SEPARATE_MODELS: Final = 2**26
"""Memory for the models of trajectories that share none, of which at least as many are stored as there are lanes."""

BYTES_OF_MASS: Final = 20_000
"""Memory for a model, for each mass, where the flow over a period is tabulated; others take less."""

SETTLING_IMPACTS: Final = 5_000_000
"""Maximum number of impacts of a trajectory until it settles, without those of complete chatter: this takes several
seconds. Thousands are usual; between very close stops there is no limit."""

LANE_DEGREE: Final = 14
"""Degree of the polynomials over a cell in the lockstep kernel, about its middle (see CELL_REACH): the omitted term is
below (CELL_REACH / 2)^15 / 15! = 2e-17 of a mode's amplitude. The kernels are written out for this degree."""

LANE_SURE: Final = 1e-7
"""Margin of the certificates of the lockstep kernel, relative to the terms of the gap. It is above the square root of
round-off, so that round-off cannot turn one root into two. Lanes within the margin go through a second pass or are
computed one by one."""

LANE_REST_SHARE: Final = 1e-4
"""Duration of a rebound with a constant contact acceleration, as a share of a cell, up to which a lane goes through a
second pass, to decide whether the contact may come to rest. It has to exceed the cube root of CHATTER_ACCURACY, 2.2e-5,
the share with which it may (`half_period.may_rest`); the factor of 4.6 covers the error of the contact acceleration,
which is known to about five digits there, and costs next to nothing."""
assert LANE_REST_SHARE**3 > CHATTER_ACCURACY

PARABOLA_DIVISOR: Final = 1e-300
"""Lower bound of the denominator of a parabola's root, from which the search for a contact starts: only a division by
zero is avoided, and the root is limited to the cell anyway."""

LANE_SPLIT: Final = 0.125
"""Least distance from either end, as a share of the rest of a cell, at which a second pass splits it to bound the gap
on both parts: a shorter part leaves the bound on the other one nearly as it is. Both bounds hold for any number; lanes
that they do not clear are computed one by one."""

OTHER_STOP_SHARE: Final = 0.95
"""Maximum distance of the contact from a stop, as a share of the distance of the stops, at which it does not touch the
other one in a second pass; the margin is wide because such lanes are rare."""

ROOT_CHANGE: Final = 1e-8
"""Last change of a contact by Halley's method, in half cells, up to which it has converged."""

ROOT_SLOPE_CHANGE: Final = 1e-6
"""Relative change of the slope, from the second derivative, that a converged contact may have. Halley's method is of
third order: the next change would be about the square of this, 1e-12, of the last one, in all 1e-20."""

HALF_PERIOD_EVENTS: Final = 48
"""Events of one half period that a lane can record. A lane with more is run again by itself, for verification and for
the propagation of small changes. Motions usually have a few impacts in half a period."""

CLOSE_PASSAGE: Final = 1e-3
"""Distance from a stop, in units of the clearance, up to which the gap of a passage without a contact is bounded for
every lane by itself. A larger number costs more cells that are computed twice."""

ERROR_GROWTH: Final = 8.0
"""Growth of an error in half a period that is provided for: passages are bounded up to the distance at which
an error this many times as large is decisive."""

FARTHEST_PASSAGE: Final = 0.25
"""Largest distance, in units of the clearance, up to which passages are bounded; an error for which a larger one is
decisive counts as decisive in any case."""

HALF_PERIOD_ERROR: Final = EPSILON
"""Round-off of half a forcing period, in displacement of the contact and units of its largest one."""

ERROR_SAFETY: Final = 32.0
"""Factor on the estimated error of a trajectory where a decision is compared with it. With it, all of 498 long
transients that double precision leaves are called sensitive, and 4.4 % of 500 that it follows to the end (`make
long-transients`)."""

APPROACH: Final = 1e-4
"""Distance of returns, in units of the clearance, up to which the periodic orbit that a trajectory approaches is solved
for. It counts only if it is verified."""

APPROACH_RETRY: Final = 1e-2
"""Factor on APPROACH after an orbit was not verified. An orbit is solved for at most three times from returns that are
farther than CLOSING_GOAL: at 1e-4, 1e-6 and 1e-8."""

CAPTURE_RETRY: Final = 0.5
"""Share of the distance at which an orbit captures a trajectory, to leading order, at which this is tried again. At
half the distance the terms of second order, which decided against it, have half their share."""

COARSEST_SPACING: Final = 8
"""Spacing of an adaptive map's first lattice, in steps of the grid, a power of 2: at least one point in 64 is computed.
A region between two lines of the lattice is found only if points next to it are computed for another reason."""

SAME_APPROACH: Final = 2.0
"""Maximum difference, between neighbours that settle to motions of one name, of the logarithms of the contractions of
their transients: periods until settled times the largest exponent. It is a factor of 7. Within a region of similar
transients the periods hardly change; where they differ more, some trajectories approached another motion first, which
is likely to be near. A larger number computes fewer points and overlooks more (docs/adaptive.md)."""

INFERRED_SAMPLE: Final = 0.05
"""Number of inferred points of an adaptive map that are computed to see how many of them are wrong, as a share of the
points that are computed in any case. Most of them settle sooner than these."""

LARGEST_INFERRED_SAMPLE: Final = 10_000
"""Maximum number of them. If three are wrong, the 95 % interval of the share is 0.006 % to 0.09 %. The sample does not
exceed RUN_ON_PERIODS either, unless it is a single point."""

MOST_CONTRACTION: Final = 36.0
"""Maximum logarithm of the contraction over a forcing period: all digits of a binary64 number. Where the contact
rests on a stop a change of the state may vanish."""

APPARENT: Final = 8.0
"""Difference of impacts, in units of the distance to the orbit, up to which they may be repetitions after a shorter
time: two states at that distance from an orbit are at most twice as far apart. A wrong guess costs only time."""

SAME_SPEED: Final = 1e-6
"""Difference of the slowest impacts of two orbits, in units of omega * clearance, up to which they are one. A motion
that a map has verified is known to round-off; neighbouring families of one name differ by far more, except within 1e-12
of the clearance from a bifurcation."""

BORDER_REACH: Final = 0.55
"""Distance from the middle between two neighbouring points of a map, in its steps, up to which a curve separates them:
half a step for a curve that passes between them, plus the distance of the curve from its chords."""

BORDER_STEP: Final = 16.0
"""Maximum step along a curve that may explain borders, in steps of the map. On fifty random curves 0.93 % of the points
are more than BORDER_REACH - 1/2 away from the chords, all on 7 of the curves; the median is 0.0002 and the farthest has
0.32 (`make tolerance-sizes`). There a border may stay unexplained."""

BORDER_BRANCH_STEP: Final = 0.05
"""Maximum step along a branch or a curve that may explain borders, relative to the parameters: on a coarse map
BORDER_STEP alone would allow steps as long as the parameters themselves."""

BORDER_SHORTER_STEP: Final = 0.1
"""Factor on the step along a branch, for a second attempt if the first reaches neither a special point nor the end."""

BORDER_ORBITS: Final = 500
"""Maximum number of orbits along a branch or a curve that may explain borders. With the longest steps they pass 8000
steps of a map, or a parameter's growth by a factor of 4e10; the rest is for curves that wind."""

END_OF_RANGE: Final = 8.0 * EPSILON
"""Relative difference from the end of its range up to which a branch has arrived there; the conversion to a unit and
back has roundings."""

BORDER_MARGIN: Final = 1.5
"""Steps of the map by which the window of such a curve extends beyond the borders that are not explained yet."""

BORDER_WORK: Final = 500_000
"""Limit of the work for one border in one direction: the number of orbits times the square of their impacts, to which
the cost of an orbit is proportional. It allows all 500 orbits of up to 31 impacts, or fifty of a hundred impacts, and
takes some seconds. Motions with more than 353 impacts are not followed."""

BORDER_LEAST_IMPACTS: Final = 16
"""Number of impacts below which the cost of an orbit does not decrease further."""

BORDER_CURVE_WORK: Final = {"SN": 1, "GR": 1, "PD": 2, "SB": 2, "NS": 8}
"""Work for a point of a curve, relative to a point of a branch: singular values of a matrix of twice the size, or
differences of functions of the multipliers and contacts."""

BORDER_FEWEST: Final = 4
"""Minimum number of orbits that the limit must allow; otherwise a motion is not followed."""

BORDERS_WORK: Final = 100_000_000
"""Limit of the same work for all borders of a map together: about twenty minutes. Motions of few points come last."""

BORDER_SEARCH_PERIODS: Final = 20_000_000
"""Maximum number of forcing periods, over all random states, of the search for those motions of a map to which neither
a trajectory from rest nor a neighbour leads: about a minute."""

BORDER_RUNS: Final = 3
"""Number of trajectories from one initial state, each twice as long as the one before, that are tried for an orbit of a
map. The last one is four times as long as the map's was until it settled."""

BORDER_STATES: Final = 256
"""Number of random initial states that are tried at a point, to find one that leads to the map's motion. A motion to
which 2 % of them lead is missed with a probability of 0.6 %."""

BORDER_CANDIDATES: Final = 4
"""Number of those states that are used: those whose trajectories settle first."""

GRAZE_SAMPLES: Final = 4
"""Samples of a grazing curve per step of a map, so that the curve is drawn finer than the map."""

GROWTH_SHARE: Final = 0.75
"""Share of a trajectory's maximum number of forcing periods, at its end, in which the growth of changes is measured.
Trajectories that settle in the first quarter, which are most of them, have no such cost."""

GROWTH_SKIPPED: Final = 30
"""The first fifteenth of the half periods in which growth is measured does not count: twice the integer part of their
number over this."""

MOST_GROWTH_PERIODS: Final = 2000
"""Maximum number of forcing periods over which the growth of changes is measured."""

RUN_ON: Final = 10
"""Factor on the maximum number of forcing periods of a trajectory, for the sample of the chaotic ones that is run on to
see how many of them settle."""

RUN_ON_SAMPLE: Final = 20
"""Maximum number of chaotic trajectories in that sample, which does not grow with a map."""

SIDE_BY_SIDE: Final = 5
"""Number of motions of that sample of one group of a map, simulated side by side, in a third of the time of as many
trajectories alone."""

RUN_ON_PERIODS: Final = 5_000_000
"""Number of forcing periods that the sample does not exceed, unless it is a single trajectory: about a minute."""

CONFIDENCE: Final = 0.95
"""Minimum probability with which the interval of a measured probability contains it: the usual one."""

ENTROPY_BOX: Final = 5
"""Number of states along a side of a box of the basin entropy, as Daza et al. (2016) take it: the entropy of 25 states
is resolved to a tenth, and the boxes are small."""

ENTROPY_SURE: Final = 3.0
"""Standard errors by which the boundary basin entropy has to exceed log 2 for a boundary to be called fractal. The
boxes of a boundary are not independent, so this is no exact level."""

EVEN_SPACING: Final = 1e-6
"""Largest difference of a step of evenly spaced values from their mean, in steps: lists of decimals have roundings."""

UNCERTAINTY_REACH: Final = 16
"""The shorter side of a rectangle over the largest distance of the uncertainty exponent: a power law holds where
distances are small beside the basins. Of random smooth boundaries the exponents were then 0.96 to 1 with 100 states a
side or more, 0.91 to 1 with 64; with distances twice as large 0.89 and 0.74."""

FEWEST_DISTANCES: Final = 3
"""Number of distances below which no exponent is fitted: two points would have no error."""

MOST_DRAWS: Final = 1000
"""Random initial states that are drawn for each one with the contact between the stops, on average. Ranges with fewer
are refused."""

EXPONENT_PERIODS: Final = 500
"""Forcing periods in which a motion of a bifurcation diagram may settle, beyond as many as the transient and the record
have. As in maps, the growth of small changes is measured in the last GROWTH_SHARE of all of them."""

RESOLVING_BITS: Final = 128
"""Precision of the first multi-precision run from a sensitive point, more than twice that of binary64."""

RESOLVING_MOST_BITS: Final = 2**16
"""Limit of the precision, if few impacts make little work: at a graze of the exact trajectory no precision suffices."""

RESOLVING_GUARD_BITS: Final = 96
"""Bits that a run continues with in addition to those to which its last impacts are known."""

RESOLVING_WORK: Final = 300_000_000
"""Limit of the work for a sensitive point, in impacts times bits: some two minutes."""

RESOLVING_PERIODS: Final = 16
"""Forcing periods after which two runs are compared first."""

RESOLVING_GROWTH: Final = 4
"""Inverse growth of that number until the next comparison: each time it is 5/4 of the one before."""

RESOLVING_LONGER: Final = 64
"""How many times the maximum number of periods of a map the runs may take: those that settle late are the sensitive
ones."""

CAPTURE_PERIODS: Final = 4
"""Periods of the orbit within which a trajectory is captured at once; it has to return a few times."""

CAPTURE_SPARE: Final = 6
"""Forcing periods in addition to these: returns are looked for every few half periods."""

RESTING_DISTANCE: Final = 1e-12
"""Distance from a stop, in units of the stops, of a state that rests on it; no trajectory of a map starts there."""

OTHER_STARTS_PERIODS: Final = 400
"""Forcing periods after which a further start of a sample (`other_starts`) is given up: motions that are verified have
mostly settled sooner, and chaotic ones never do."""

OTHER_STARTS_KNOCK: Final = 3.0
"""Velocities of every other start of that sample, over those of the states of an ensemble: some motions are reached by
knocks mostly, others hardly (`make two-motions`)."""

MAP_POINTS_A_SAMPLE: Final = 2000
"""Points of a map for each one that is in the sample of `other_starts`: such a point takes as long as up to two hundred
of the map, where these settle at once, because its trajectories share tables with no others."""

MOST_SAMPLED_POINTS: Final = 64
"""Points of that sample at most: a motion that is stable on a twentieth of the map is seen with probability 0.96."""
