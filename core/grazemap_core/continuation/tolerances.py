"""Tolerances and limits of branches of orbits, each with the reason for its size."""

from __future__ import annotations

from typing import Final

PATH_NEWTON_STEPS: Final = 8
"""Newton steps from a predicted orbit; with more the step along the branch was too long."""

FAST_NEWTON_STEPS: Final = 4
"""Newton steps, that to round-off included, up to which the next step along the branch may be longer."""

STEP_GROWTH: Final = 1.5
"""Factor by which it is."""

MIN_TANGENT_COSINE: Final = 0.95
"""Least cosine of the angle between the tangents of two neighbouring orbits; steps over a sharper turn are halved."""

PATH_MIN_STEP: Final = 1e-9
"""Step along a branch, in its units, below which it is given up."""

MIN_CLOSED_POINTS: Final = 10
"""Points behind which a branch may have come back to where it began."""

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
