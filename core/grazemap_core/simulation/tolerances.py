"""Tolerances and limits of trajectories, period detection and growth, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

END_ROUNDING: Final = 1.0 + 4.0 * EPSILON
"""Factor on the end of a record up to which a time lies in it: its end has three roundings, a given time its own."""

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

APPROACH_RATE: Final = 0.99
"""Contraction per return above which a trajectory cannot be said to come closer."""

SPEED_APART: Final = 4.0
"""A trajectory cannot be taken to an orbit whose slowest impact, its speed squared in units of omega * clearance, is at
most this many times its distance: it might touch the stop there, or not."""

RANK_ROUNDING: Final = 64.0 * EPSILON
"""A column of changes is spanned by the others when what is left of it, relative to it, is at most this: round-off."""

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
