"""Tolerances and limits of branches of orbits, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF

PATH_EXACT: Final = 0.1 * RESPONSE_ROUNDOFF
"""Residual, relative to the sum of the moduli of its terms, below which a Newton step changes roundings only: a tenth
of the round-off that is allowed for."""

PATH_NEWTON_STEPS: Final = 8
"""Newton steps from a predicted orbit; if more are needed, the step along the branch was too long."""

PATH_LARGEST_STEP: Final = 1.0
"""Newton step, in a path's units, from which on Newton's method leaves the predicted orbit: a phase by a radian, or a
speed or parameter by its size. No step along a branch is longer (`pseudo_arclength.check_steps`)."""

FAST_NEWTON_STEPS: Final = 4
"""Number of Newton steps, the one to round-off included, up to which the next step along the branch may be longer."""

FIRST_STEP: Final = 0.2
"""First step along a branch, relative to the longest one: it grows while Newton's method converges fast."""

STEP_GROWTH: Final = 1.5
"""Factor by which the step grows after a fast convergence. Two such steps make up for a step that was halved."""

MIN_TANGENT_COSINE: Final = 0.95
"""Minimum cosine of the angle between the tangents of two neighbouring orbits; steps over a sharper turn are halved. It
is an angle of 18 degrees: an arc that turns by it is 4 % of its chord away from the chord."""

PATH_MIN_STEP: Final = 1e-9
"""Step along a branch, in its units, below which the branch is not followed further."""

MIN_CLOSED_POINTS: Final = 10
"""Minimum number of points of a closed curve: with fewer, a point near the first one may only be a short step away."""

SPECIAL_POINT_RESIDUAL: Final = 1e-9
"""Maximum of a test function at a special point that counts as solved, relative to its values at the neighbours."""

UNIT_CIRCLE_DISTANCE: Final = 1e-6
"""Distance from the unit circle at which a pair of multipliers is on it, where the test function vanishes."""

UNIT_CIRCLE_HALVINGS: Final = 24
"""Maximum number of halvings of a segment in which a complex and a real pair of multipliers have product 1. They are
distinguished where they are further from each other than the 2^-24th part of it."""

GRAZE_MARGIN: Final = 1e-4
"""Distance from an orbit with an impact of velocity 0, as a share of the step between two orbits, at which
admissibility is tested on either side. The orbit itself grazes, perhaps both stops at once, so round-off would decide
there."""

CURVE_DIFFERENCE: Final = 1e-6
"""Step of the differences that approximate gradients of test functions, in a path's units. Their error of 1e-10 hardly
slows Newton's method down, and its solution does not contain the error."""

END_REACHES: Final = (1.0, 0.1, 0.01)
"""Distances along the other branch, in lengths of the segment, to either side of the mean of the halves, within which
the end of a branch is looked for on it. The mean is off by about the square of the segment's length, so the shorter
distances are for points near which the other branch has another one."""

MERGED_ORBITS: Final = 1e-4
"""Relative difference of two halves, or parts, of an orbit at a special point, below which it is an orbit of the other
branch: where the branch ends they are equal to round-off, or to its square root in a point that another program
computed."""

SWITCH_STEPS: Final = (1e-2, 1e-3, 1e-4)
"""Distances from a special point, in a path's units, at which an orbit of another branch is looked for, one after the
other. At such a distance the smallest singular value of the matrix, which is singular at the point, is about the
distance, and the error of the prediction is about its square: Newton's method converges. The shorter distances are for
points that have another special point, or impact, nearby."""

SAME_CURVE: Final = 5e-3
"""Distance from the polyline of a curve, all impacts compared, up to which a special point of its type lies on it. With
steps of 0.05 and turns of up to `MIN_TANGENT_COSINE`, a curve is within a fourth of this from its chords."""

DIFFERENCE: Final = 6e-6
"""Step of central differences, relative to a parameter: the cube root of a rounding, where both errors are small."""

RECENT_EQUATIONS: Final = 4
"""Structures and frequencies of which a path keeps the equations: those of the orbit at which it is, and those of the
two of a difference beside it."""

LARGEST_MULTIPLIER: Final = 1e100
"""Modulus from which on a multiplier counts as this number in a test function: products of two stay below overflow."""

SEARCHED_SHARES: Final = (0.5, 0.25, 0.75)
"""Shares of a window's sides at which a motion is searched for; at each frequency, all clearances are tried. A motion
that exists nowhere on this grid is not found."""

MIRRORED_ORBITS: Final = 9
"""Orbits of a branch, from one end to the other, near whose mirror images another orbit is looked for. One of them on
the part of the branch over which the other one exists is enough."""

MOST_BRANCHES: Final = 4
"""Maximum number of further branches that are followed. A pitchfork unfolds into two; it bounds the work."""
