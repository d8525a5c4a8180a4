"""Codes that kernels return and several packages read; `simulation.motion.REASONS` holds a sentence for each reason."""

from __future__ import annotations

# why a motion is unresolved
RESOLVED = 0
"""No reason: the motion is periodic, and its period, impacts and symmetry are known; or it is verified."""
NOT_CLOSED = 1
"""The stroboscopic orbit did not return to itself within the periods simulated and the largest period looked for."""
SLOW_CONVERGENCE = 2
"""The orbit returns, but contracts too slowly for its limit to be resolved."""
NEAR_GRAZING = 3
"""The orbit returns, but an impact is so slow that the limit motion may not contain it."""
NO_STICKING_FLOW = 4
"""The contact comes to rest on a stop, and the motion of the structure held there has no accurate closed form."""
TOO_MANY_IMPACTS = 5
"""Too many impacts, in half a period or before the motion settled."""
OVERFLOW = 6
"""A number overflowed."""
HIDDEN_BY_ROUNDING = 7
"""The round-off of the steady motion is too large against the clearance."""

# why a periodic motion is not verified
NOT_VERIFIED = 8
"""Verification was not asked for, or the structure has an undamped mode or ill-conditioned modes."""
STICKS = 9
"""The contact rests on a stop or chatters: there is no finite sequence of impacts."""
SEQUENCE_UNKNOWN = 10
"""There are more impacts than verification handles, or a graze or a rest among them."""
NOT_SOLVED = 11
"""Newton's method finds no orbit close to the trajectory."""
NOT_ISOLATED = 12
"""It is not certain that the orbit is the only one nearby."""
GRAZE_UNRESOLVED = 13
"""An impact, or a passage near a stop, is so close to a graze that round-off hides which of the two it is."""
NOT_STABLE = 14
"""A multiplier lies on the unit circle or too close to it."""
NOT_DISTINCT = 15
"""The orbit is too close to one of a smaller period, or to its mirror image."""
NOT_CAPTURED = 16
"""The orbit is verified, but it is not shown that the trajectory converges to it."""

ROUNDING_DECIDES = 17
"""The orbit is verified and captures the computed trajectory, but that is sensitive: by round-off it may have missed an
impact, or made one, that the exact trajectory has not."""

INFINITE = -2
"""In place of a number of impacts: infinitely many."""

# what the Lyapunov exponents say about a motion
GROWTH_UNDECIDED = 0
"""The exponents do not decide the kind of the motion."""
CHAOTIC = 1
"""The largest exponent exceeds 0 by EXPONENT_MARGIN standard errors, over the run and over each half of it; or
perturbations grow by more than GROWTH_SURE in each half, whatever the standard error."""
QUASI_PERIODIC = 2
"""The largest exponent is zero: growth is bounded, without drift. The second exponent is negative."""
