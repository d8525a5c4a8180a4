"""Every tolerance of the core, named, with the reason for its size.

All of them are relative to a scale of the problem at hand, so the same numbers serve SI and nondimensional
descriptions of one system.
"""

from __future__ import annotations

from typing import Final

EPSILON: Final = 2.220446049250313e-16
"""Distance from 1 to the next binary64 number; one rounding errs by at most half of it."""

LEAST_NUMBER: Final = 1e-60
LARGEST_NUMBER: Final = 1e60
"""Sizes of given numbers other than 0. Fourth powers of frequencies then neither overflow nor vanish."""

# --- modal model --------------------------------------------------------------------------------------------------

MODAL_CONDITION_LIMIT: Final = 1.0e5
"""Largest condition number of the (column-scaled, energy-weighted) matrix of modes that is accepted.

States are rebuilt from modal coordinates with an error of about this times EPSILON: 2e-11 at the limit. Only two
blocks that are nearly defective *together* come near it; a critical mode alone is one block and perfectly conditioned.
"""

MODAL_REFINEMENT_STEPS: Final = 6
"""Newton steps allowed to the decomposition; two or three are used, since they converge quadratically."""

MODAL_REFINEMENT_GOAL: Final = 4.0 * EPSILON
"""Relative residual of the decomposition at which another Newton step would only move roundings about."""

MODAL_REFINEMENT_REACH: Final = 0.1
"""Largest relative correction from which Newton's method on the decomposition is trusted to converge."""

UNDAMPED_RATIO: Final = 8.0 * EPSILON
"""A block of a chain with a list of dampings is undamped when decay/frequency is at most this.

Decays are computed to a few times EPSILON of the frequency; a mode whose damped links do not stretch has exactly zero.
"""

PROPORTIONAL_SPREAD: Final = 2.0 * EPSILON
"""A list of link dampings is proportional when all c_i/k_i agree to this: the roundings of two quotients."""

# --- contact and trajectory ---------------------------------------------------------------------------------------

TAYLOR_DEGREE: Final = 18
"""Degree of the local series of x1. With steps of at most CELL_REACH / |lambda| the first term left out is below
1/19! = 8e-18 of a mode's amplitude; its bound is added to the contact test all the same."""

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

END_ROUNDING: Final = 1.0 + 4.0 * EPSILON
"""Factor on the end of a record up to which a time lies in it: its end has three roundings, a given time its own."""

SETTLING_IMPACTS: Final = 5_000_000
"""Impacts, beside those that complete chatter may take in every half period, after which a trajectory that has not
settled is given up: several seconds. Thousands are the rule; between very close stops there is no limit to them."""

RESONANCE_ROUNDING: Final = 1e-6
"""Round-off of the steady motion of mass 1, in units of the clearance, from which on nothing is said about a motion:
states are relative to the steady one, which grows beyond all bounds toward a resonance without damping."""

LANE_DEGREE: Final = 14
"""Degree of the polynomials over a cell in the lockstep kernel, about its middle (see CELL_REACH): the term left out is
below (CELL_REACH / 2)^15 / 15! = 2e-17 of a mode's amplitude. The kernels are written out for this degree."""

LANE_SURE: Final = 1e-7
"""What the certificates of the lockstep kernel must hold by, relative to the terms of the gap. Above the square root of
round-off: then a root that round-off moves is still the only one. Lanes below it are followed more carefully."""

MOST_FUSED_MASSES: Final = 5
"""Masses up to which the lockstep kernel advances all blocks in one loop; the compiler unrolls no more."""

# --- motion -------------------------------------------------------------------------------------------------------

CLOSING_GOAL: Final = 1e-9
"""The stroboscopic orbit has closed when it returns to this, in units of the clearance."""

CLOSING_FLOOR: Final = 1e-12
"""A return this close is round-off; no rate of convergence can be read from it."""

LIMIT_DISTANCE: Final = 1e-8
"""Largest extrapolated distance to the limiting orbit (return * rate / (1 - rate)) at which a motion is named."""

SLOWEST_RATE: Final = 0.999
"""Contraction per motion period above which the extrapolation means nothing and the motion is not named."""

SEPARATION: Final = 100.0
"""A smaller period is excluded at this many times LIMIT_DISTANCE; an impact counts as no graze when its squared speed
(in units of omega * clearance) is this many times the distance to the limit."""

APPROACH: Final = 1e-4
"""Return, in units of the clearance, from which on the periodic orbit that a trajectory comes ever closer to is solved
for. What is found counts only where it is proven."""

APPROACH_RATE: Final = 0.99
"""Contraction per return above which a trajectory cannot be said to come closer."""

SPEED_APART: Final = 4.0
"""A trajectory cannot be taken to an orbit whose slowest impact, its speed squared in units of omega * clearance, is at
most this many times its distance: it might touch the stop there, or not."""

APPROACH_RETRY: Final = 1e-2
"""What APPROACH is multiplied by where nothing was proven."""

EXTRAPOLATED_FROM: Final = 1e-3
"""Return, in units of the clearance, from which on the limit of a trajectory's returns is looked for where nothing can
be proven: it has to close there by itself. From ten times as far it takes as long."""

CHANGES_FIT: Final = 1e-3
"""Part of the last change at a return that those before it may leave unexplained for their limit to be trusted."""

FARTHEST_LEAP: Final = 4.0
"""Distance of that limit at most, in units of what the returns extrapolate to one by one."""

DEPENDENT: Final = 1e-12
"""Share of a change at a return that the others do not explain below which it is round-off."""

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

CLEARED: Final = 1.0 - 1e-12
"""Share of the clearance that the envelope of a motion must stay below to be called free of contact for ever."""

# --- steady motion ------------------------------------------------------------------------------------------------

STEADY_REFINEMENT_STEPS: Final = 10
"""Refinement steps allowed to one linear solve; one is the rule, a resonance with decay/frequency < 1e-8 takes more."""

STEADY_ACCURACY: Final = EPSILON / 16.0
"""Error left in x_1, relative to x_1, at which refinement stops: invisible once x_1 is rounded to a double."""

STEADY_DIVERGED: Final = 1.0e-13
"""Error left, relative to the solution, above which refinement has not converged: a resonance without damping."""

# --- impulse response, periodic sums and their zeros --------------------------------------------------------------

RESPONSE_ROUNDOFF: Final = 16.0 * EPSILON
"""Round-off of an impulse response or periodic sum, relative to its terms plus time times the terms of its derivative.

Frequencies and decays carry up to about 6 roundings (3 units of EPSILON), sines and exponentials and their sums as
many again; measured errors stay below a third of this bound (tests/core/test_impulse_response.py). It is multiplied by
the conditioning of the modal model.
"""

BOUND_SAFETY: Final = 1.0 + 1.0e-9
"""Factor on bounds of derivatives that covers the roundings made in computing the bound."""

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

# --- one-impact orbits --------------------------------------------------------------------------------------------

CONTACT_CELLS: Final = 8
"""Cells in half a forcing period with which the search for a further contact begins; it halves them as bounds ask."""

CONTACT_ROUNDOFF: Final = 64.0 * EPSILON
"""Round-off of the distance to a stop, relative to its terms times the angles in their sines: a few units for the flow
of a block, its state and the sums (`RESPONSE_ROUNDOFF`), and as many for the coefficient that multiplies them."""

LEAST_CONTACT_CELL: Final = 1e-9
"""Length, relative to the time between impacts, below which a cell is not halved any more: a graze whose curvature is
zero too. Its distance is then known to the cube of this times the bound of its third derivative."""

# --- impacting orbits ---------------------------------------------------------------------------------------------

ORBIT_RESIDUAL: Final = 1e-12
"""Largest residual, relative to the terms that it is a sum of, with which an orbit counts as solved; round-off of an
orbit with tens of impacts is a hundredth of it."""

ORBIT_SETTLED: Final = 1e-8
"""Newton step, in radians of phase and in units of omega times length, behind which the next one is round-off."""

ORBIT_NEWTON_STEPS: Final = 40
"""Newton steps from a guess; from a close one three to five are used, far ones are shortened a few times."""

ORBIT_HALVINGS: Final = 12
"""Halvings of one Newton step that does not lower the residual, and steps that may be cut short by a neighbour."""

ORBIT_GAP: Final = 0.2
"""Share of the time between two impacts that one Newton step leaves of it."""

ORBIT_FLOOR: Final = 1e-6
"""Distance from a stop, in lengths, beyond which maxima are not looked for where only contacts are asked for; far above
round-off of the distance."""

SAME_ORBIT: Final = 1e-7
"""Relative difference of phases and velocities up to which two halves, or parts, of an orbit are the same. Orbits with
a broken symmetry or a doubled period differ by the root of the distance from where they were born: here 1e-14 of it."""

KANTOROVICH: Final = 0.5
"""Largest number of Newton and Kantorovich with which a solution is certain to exist, and to be one."""

ORBIT_NEARBY: Final = 100.0
"""Distance of impacts of an orbit from those of a trajectory, in units of what its returns extrapolate to, up to which
the trajectory goes to that orbit: stiff modes and slow impacts stretch it."""

APPARENT: Final = 8.0
"""Distance of impacts, in units of that of the orbit, up to which they count as the same ones a shorter time later: two
states at that distance from an orbit are at most twice as far apart. Where they are not the same, time is lost only."""

MOST_PROVEN_IMPACTS: Final = 128
"""Impacts of a motion up to which it is proven: the time that takes grows with their square."""

PROOF_STEPS: Final = 8
"""Newton steps from a trajectory to the motion that it is close to: three are used, more where an impact is slow."""

SURELY_STABLE: Final = 1.0 - 1e-6
"""Largest modulus of the multipliers of an orbit that is stable: two that meet are good to the root of round-off."""

# --- branches of orbits -------------------------------------------------------------------------------------------

PATH_NEWTON_STEPS: Final = 8
"""Newton steps from a predicted orbit; with more the step along the branch was too long."""

PATH_QUICK: Final = 4
"""Newton steps, that to round-off included, up to which the next step along the branch may be longer."""

PATH_GROWTH: Final = 1.5
"""Factor by which it is."""

PATH_STRAIGHT: Final = 0.95
"""Least cosine of the angle between the tangents of two neighbouring orbits; steps over a sharper turn are halved."""

PATH_LEAST_STEP: Final = 1e-9
"""Step along a branch, in its units, below which it is given up."""

PATH_FEWEST: Final = 10
"""Points behind which a branch may have come back to where it began."""

PATH_TEST: Final = 1e-9
"""What may be left of a test function at a special point, relative to its neighbours, for it to count as solved."""

PATH_UNIT_CIRCLE: Final = 1e-6
"""Distance from the unit circle at which a pair of multipliers is on it, where the test function vanishes."""

PATH_BESIDE: Final = 1e-4
"""Share of the step between two orbits, to either side of one with an impact of velocity 0, at which it is seen whether
its neighbours are admissible. It grazes, perhaps both stops at once, so at the orbit itself round-off would decide."""

CURVE_DIFFERENCE: Final = 1e-6
"""Step of the differences from which gradients of test functions are taken, in a path's units: their error of 1e-10
slows Newton's method down by as little, and is not in what it solves for."""

PATH_MERGED: Final = 1e-4
"""Relative difference of two halves, or parts, of an orbit where its branch turns, below which the branch ends on
another one: along it the difference is of first order, and the turn is found to about the root of round-off."""

SWITCH_STEPS: Final = (1e-2, 1e-3, 1e-4)
"""Distances from a special point, in a path's units, at which an orbit of another branch is looked for, one after the
other. The matrix, singular at the point, has a smallest singular value of about this at it, and a prediction errs by
its square, so that Newton's method converges; shorter ones serve where another special point, or impact, is as near."""

SAME_CURVE: Final = 5e-3
"""Distance from the polyline of a curve at which a special point of its type, all its impacts compared, is on it. Steps
of 0.05 over turns of up to `PATH_STRAIGHT` leave a fourth of it between a curve and its chords."""

# --- borders of maps ----------------------------------------------------------------------------------------------

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

# --- discontinuity mapping ----------------------------------------------------------------------------------------

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

# --- tangent flow -------------------------------------------------------------------------------------------------

QR_STEPS: Final = 60
"""QR steps after which an eigenvalue is given up; two or three are the rule, every tenth has an exceptional shift."""

RANK_ROUNDING: Final = 64.0 * EPSILON
"""A column of changes is spanned by the others when what is left of it, relative to it, is at most this: round-off."""

GROWTH_SKIPPED: Final = 20
"""Growth counts from the tenth of the half periods on in which it is measured: an even number, twice one in so many."""

MOST_GROWTH_PERIODS: Final = 2000
"""Forcing periods over which the growth of changes is measured, at most."""

EXPONENT_BLOCKS: Final = 32
"""Least number of block means that a standard error is taken from; it is then itself good to 1/sqrt(62) = 13 %."""

EXPONENT_MARGIN: Final = 5.0
"""Standard errors by which an exponent must differ from zero to have a sign: by chance once in two million."""

GROWTH_SURE: Final = 18.0
"""Growth of changes, in nats, over either half of a run from which on a motion is chaotic however uneven the growth is.
Over both halves it takes round-off to the size of the motion. Along a periodic motion or a torus the sum is bounded,
and not by so much however slow the impacts are."""

GROWTH_BOUND: Final = 1.5
"""Range of the summed growth over a whole run, in units of the least range over its eighths, up to which it is bounded:
1 for a bounded sum, above sqrt(8) = 2.8 for a random walk, 8 for a drift."""

GROWTH_DRIFT: Final = 0.05
"""Weighted growth over a whole run, in nats, up to which the largest exponent is zero. Of 39 motions of random chains
with bounded growth over 500 periods, 36 were tori still after 20,000: over 1,000 they were at 0.04 or less, the three
slow spirals at 0.16 or more."""

ORBIT_EXTENT: Final = 0.02
"""Relative change of the extent of a quasi-periodic orbit from the first half of the run to the second. Means over a
torus converge as one over the number of periods; a spiral that passes over a thousand shrinks by 4e-5 a period."""

ORBIT_LEAST_EXTENT: Final = 1e-6
"""Least extent of a quasi-periodic orbit in units of the clearance: well above where an orbit counts as closed."""
