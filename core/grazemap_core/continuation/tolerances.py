"""Tolerances and limits of branches of orbits, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF

PATH_EXACT: Final = 0.1 * RESPONSE_ROUNDOFF
"""Residual, relative to the terms that it is a sum of, after which a Newton step changes nothing but round-off: a tenth
of the round-off that is allowed for."""

PATH_NEWTON_STEPS: Final = 8
"""Newton steps from a predicted orbit; if more are needed, the step along the branch was too long."""

FAST_NEWTON_STEPS: Final = 4
"""Newton steps, that to round-off included, up to which the next step along the branch may be longer."""

FIRST_STEP: Final = 0.2
"""First step along a branch, relative to the longest one: it grows fast where the branch allows."""

STEP_GROWTH: Final = 1.5
"""Factor by which the step grows after a fast convergence."""

MIN_TANGENT_COSINE: Final = 0.95
"""Minimum cosine of the angle between the tangents of two neighbouring orbits; steps over a sharper turn are halved."""

PATH_MIN_STEP: Final = 1e-9
"""Step along a branch, in its units, below which it is given up."""

MIN_CLOSED_POINTS: Final = 10
"""Minimum number of points of a closed curve: before that, a point near the first one is a short step away from it."""

SPECIAL_POINT_RESIDUAL: Final = 1e-9
"""What may be left of a test function at a special point, relative to its neighbours, for it to count as solved."""

UNIT_CIRCLE_DISTANCE: Final = 1e-6
"""Distance from the unit circle at which a pair of multipliers is on it, where the test function vanishes."""

GRAZE_MARGIN: Final = 1e-4
"""Share of the step between two orbits, to either side of one with an impact of velocity 0, at which it is seen whether
its neighbours are admissible. It grazes, perhaps both stops at once, so at the orbit itself round-off would decide."""

CURVE_DIFFERENCE: Final = 1e-6
"""Step of the differences from which gradients of test functions are taken, in a path's units: their error of 1e-10
slows Newton's method down by as little, and is not in what it solves for."""

MERGED_ORBITS: Final = 1e-4
"""Relative difference of two halves, or parts, of an orbit where its branch turns, below which the branch ends on
another one: along it the difference is of first order, and the turn is found to about the root of round-off."""

SWITCH_STEPS: Final = (1e-2, 1e-3, 1e-4)
"""Distances from a special point, in a path's units, at which an orbit of another branch is looked for, one after the
other. The matrix, singular at the point, has a smallest singular value of about this at it, and a prediction errs by
its square, so that Newton's method converges; shorter ones serve where another special point, or impact, is as near."""

SAME_CURVE: Final = 5e-3
"""Distance from the polyline of a curve at which a special point of its type, all its impacts compared, is on it. Steps
of 0.05 over turns of up to `MIN_TANGENT_COSINE` leave a fourth of it between a curve and its chords."""
