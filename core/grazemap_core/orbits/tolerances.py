"""Tolerances and limits of periodic orbits, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.tolerances import EPSILON

ORBIT_RESIDUAL: Final = 1e-12
"""Maximum residual, relative to the sum of the moduli of its terms, of an orbit that counts as solved. The round-off of
an orbit with tens of impacts is a hundredth of it."""

ORBIT_SETTLED: Final = 1e-8
"""Newton step, in radians of phase and in units of omega times length, after which the next one is round-off."""

ORBIT_EXACT: Final = 0.01 * RESPONSE_ROUNDOFF
"""Residual, relative to the sum of the moduli of its terms, at which Newton's method stops at once. It is a hundredth
of the round-off that is allowed for. Only a guess that is a solution already has so small a residual."""

ORBIT_NEARLY_SOLVED: Final = 1e-8
"""Residual, relative to the sum of the moduli of its terms, below which a guess is an orbit except for its last digits.
Newton's method is stuck there only where the equations are singular: elsewhere a step lowers the residual."""

ORBIT_NEWTON_STEPS: Final = 40
"""Maximum number of Newton steps. A close guess takes three to five; steps from a far one are shortened a few times."""

ORBIT_HALVINGS: Final = 12
"""Maximum number of halvings of a Newton step that does not lower the residual. Also the maximum number of steps, on
the way to one orbit, that are shortened because two impacts come too close."""

MIN_SPACING_RATIO: Final = 0.2
"""A Newton step leaves at least this share of the time between two impacts."""

ORBIT_FLOOR: Final = 1e-6
"""Distance from a stop, in units of `OrbitProblem.length`. Where only contacts are asked for, maxima of the
displacement that are farther from the stop are not searched for. It is far above the round-off of the distance."""

CONTACT_CELLS: Final = 8
"""Initial number of cells per half forcing period in the search for a further contact; the search halves them."""

MIN_CONTACT_CELL: Final = 1e-9
"""Length, relative to the time between impacts, below which a cell is not halved further, as at a graze with zero
curvature. The error of the distance is then the cube of this times the bound of its third derivative."""

CELL_STACK: Final = 256
"""Maximum number of cells that wait to be searched. A cell that is halved adds one; 30 halvings lead from the time
between impacts to MIN_CONTACT_CELL, so this many never wait."""

STEPS_TO_MAXIMUM: Final = 60
"""Maximum number of steps in the search for a maximum of the displacement between two impacts. Newton's method takes a
few; bisection, which replaces a step that leaves the cell, reaches round-off in fewer than 60."""

MAXIMUM_ACCURACY: Final = 4.0 * EPSILON
"""The search for such a maximum ends at a step of this, relative to the angle between the impacts: it is round-off."""

MAXIMUM_AT_IMPACT: Final = 64.0 * EPSILON
"""Distance of such a maximum from an impact, relative to the angle between the impacts, up to which the maximum is the
impact itself, with a vanishing velocity. It is a multiple of MAXIMUM_ACCURACY."""

SAME_ORBIT: Final = 1e-7
"""Relative difference of phases and velocities up to which two parts of an orbit are the same. The parts of an orbit
whose symmetry is broken, or whose period is doubled, differ by the square root of the distance from the bifurcation:
orbits that count as the same are within 1e-14 of the bifurcation."""

MAX_KANTOROVICH: Final = 0.5
"""Maximum of the Newton-Kantorovich quantity with which exactly one solution exists near the numbers: the bound of the
theorem."""

ORBIT_NEARBY: Final = 100.0
"""Maximum distance between the impacts of an orbit and those of a trajectory that is taken to converge to it. The unit
is the distance of the trajectory from its limit, extrapolated from its returns. Stiff modes and slow impacts increase
the distance."""

MAX_VERIFIED_IMPACTS: Final = 128
"""Maximum number of impacts of a motion that is verified: the time taken grows with the square of the number."""

VERIFICATION_STEPS: Final = 8
"""Maximum number of Newton steps from a trajectory to the orbit near it: three are used, more for slow impacts."""

REPEATED_RADII: Final = 4.0
"""Difference between two parts of an orbit, in units of the radius within which the orbit lies, up to which the parts
may be the same. Each part may be off by one radius, which makes two; twice that allows for round-off."""

MAX_STABLE_MODULUS: Final = 1.0 - 1e-6
"""Maximum modulus of the multipliers of an orbit that is verified to be stable. Two multipliers that coincide are
accurate only to the square root of round-off, 1e-8, and the bound leaves a hundred times that."""

CAPTURE_MARGIN: Final = 0.35
"""The norm in which a trajectory is captured contracts by m + CAPTURE_MARGIN (1 - m), with the largest modulus m of a
multiplier. What remains up to 1 is left to terms of second order; a smaller share of 1 - m distorts the norm."""

NORM_DOUBLINGS: Final = 40
"""Maximum number of doublings of the sum that defines this norm. Powers decay after about log2(10 / (1 - m)) doublings,
which is 24 for the largest multiplier that counts as stable; matrices far from normal need some more."""

SECOND_ORDER: Final = 16.0
"""The time by which an impact may move, times the stiffest block's rate, is below the inverse of this. The terms of
third order are then a few percent of those of second order, which are enlarged by as much."""

CAPTURE_TRIALS: Final = 8
"""Maximum number of radii for which a ball is carried over a return. The ratio of `capture.capture_ratio` is
proportional to the radius, so the second radius or the third captures."""

CAPTURE_SHARE: Final = 0.9
"""The next radius, as a share of the radius that captures to leading order."""

ON_UNIT_CIRCLE: Final = 1e-6
"""Distance from the unit circle at which a root of a polynomial in exp(i phase) is taken for a phase. Simple roots are
accurate to round-off, double ones, at saddle-nodes, to its square root."""

PHASE_POLISHING_STEPS: Final = 3
"""Newton steps from a root near the unit circle to the phase: one step reaches round-off."""

SAME_ZERO: Final = 64.0 * EPSILON
"""Distance on the circle, radians, within which two polished zeros of a trigonometric polynomial are one that was found
twice: a few roundings of a phase. Two zeros that are so close differ in no result."""

LAG_ACCURACY: Final = 1e-13
"""Accuracy, radians, of the lag between the two impacts of a guess; Newton's method then makes the lag exact."""

FREQUENCY_ACCURACY: Final = 1e-300
"""Absolute accuracy of the frequency of a line; the relative one, a few roundings, is what counts at any frequency."""

LAG_STEPS: Final = 128
"""Lags per forcing period at which orbits with two impacts are looked for. Two orbits whose lags are closer meet at a
saddle-node nearby, and next to a lag at which phases of the first impact end an orbit has no neighbour on the grid.
Beside a grid eight times as fine, 7 of 359 orbits of fifty random systems are missed, 1 for the first reason and 6 for
the second; none of the 7 is admissible, as 56 of all are (`make tolerance-sizes`)."""

GRAZE_PHASES: Final = 48
"""Phases, for every harmonic, between two zeros of the impact speed at which further contacts are looked for. An
interval of admissible phases between two of them is missed. Beside a grid eight times as fine, 3 of 416 such intervals
of fifty random systems are missed; the narrowest has 0.11 of a step (`make tolerance-sizes`)."""

GRAZE_OFFSET: Final = 1e-6
"""The first and the last of these phases are this share of the distance between the zeros away from them. The excess at
a further contact is proportional to the offset there, and far above round-off."""

STEPS_TO_ADMISSIBLE: Final = 128
"""Maximum number of steps to the phase at which admissible orbits begin. Five to eight are usual. After an impact of
little restitution the contact that excludes most may be close to the impact; each step then divides the distance by
1.5 only, and 90 of these reach round-off."""

PHASE_HALVINGS: Final = 64
"""Maximum number of bisection steps between two phases: 53 reach round-off."""

SLOW_SHARE: Final = 10.0 * GRAZE_OFFSET
"""Speed of an impact at or below which a curve that ends has come to a graze, as a share of the greatest derivative of
the speed with the phase: 2 pi GRAZE_OFFSET, up to which grids of phases reach, with a margin."""

RANDOM_STATES: Final = 24
"""Number of initial states from which a motion with given stops is looked for, besides rest. A motion whose basin is a
tenth of the states is missed by all of them with a chance of 8 percent."""

TRANSIENT_PERIODS: Final = 400
"""Number of forcing periods in which these trajectories must settle: the slowest multiplier of the motion then shrinks
a difference to 1e-6 if its modulus over a period is below 0.966."""

RECORDED_PERIODS: Final = 64
"""Number of forcing periods recorded after these: twice the longest period that `trajectory` recognises, 32."""

SAME_CURVE_PHASE: Final = 0.5
"""Maximum change, radians, of the phase less that of the steady motion, from one point of a curve to the next. A curve
that leaves a graze or ends at another one turns by about a radian in all."""
