"""Codes that kernels return and several packages read: how a motion is named, or why not; what its growth says."""

from __future__ import annotations

NAMED = 0
"""The motion is periodic; period, impacts and symmetry are known."""
NOT_CLOSED = 1
"""The orbit has not returned to itself within the periods and the longest period looked at."""
SLOW = 2
"""It returns, but contracts too slowly for the limit to be told."""
GRAZES = 3
"""It returns, but an impact is so slow that it may be none in the limit."""
NOT_HELD = 4
"""Mass 1 comes to rest on a stop, and the chain behind it has no closed form that keeps its digits."""
BUDGET = 5
"""Too many impacts, in half a period or without settling."""
OVERFLOWS = 6
"""A number overflowed."""

HIDDEN = 7
"""Round-off of the steady motion hides what happens between the stops."""

# why a motion that was named is not verified (`orbits.kernels.verification`)
NOT_SOUGHT = 8
"""Verification was not requested, or the chain has an undamped mode or ill-conditioned ones."""
RESTS = 9
"""Mass 1 rests on a stop or chatters: no finite sequence of impacts."""
SEQUENCE_UNKNOWN = 10
"""There are more impacts than are verified, or a graze or a rest among them."""
NOT_SOLVED = 11
"""Newton's method finds no orbit close to the trajectory."""
NOT_ISOLATED = 12
"""The orbit is not certain to be the only one nearby."""
TOUCHES_OR_NOT = 13
"""An impact, or a passage of a stop, is so close to a graze that round-off hides which it is."""
NOT_STABLE = 14
"""A multiplier is on the unit circle or too close to it."""
NOT_DISTINCT = 15
"""The orbit is too close to one of a shorter period, or to its mirror image."""

INFINITE = -2
"""In place of a number of impacts: infinitely many."""

# what the growth of small changes says about a motion
GROWTH_UNDECIDED = 0
"""Neither: what the exponents say does not decide the kind of the motion."""
CHAOTIC = 1
"""The largest exponent is positive by EXPONENT_MARGIN standard errors, in either half of the run too; or changes grow
by more than GROWTH_SURE in either half, whatever the error of the mean."""
QUASI_PERIODIC = 2
"""The largest exponent is zero: growth stays bounded and does not drift; the next is negative, and the orbit lasts."""
