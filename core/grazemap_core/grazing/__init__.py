"""The grazing curve, its codimension-two points, and the motion near a graze.

The package computes where the steady motion grazes the stops, all codimension-two points of that curve and the curves
that leave them, the discontinuity mapping of a grazing point, and the Poincare map near it.

- `grazing_curve`: the maxima of the steady motion; clearance, phase and first recurrence along the grazing curve.
- `point`: one grazing point, with accurate deviations from it.
- `recurrence`: the sequence xi_m, stability at grazing, and the next contact below the curve.
- `codimension_two`: all codimension-two points in an interval of forcing frequencies.
- `coincident_grazes`: where two maxima of the steady motion are equal, or both stops are grazed.
- `resonant_unfoldings`: the curve that leaves the grazing curve at a resonant point.
- `one_impact_family`: periodic sums of the impulse response for motions with one impact per period.
- `discontinuity_mapping`: the discontinuity mapping, to leading order and exact.
- `poincare_map`: the Poincare map of a grazing motion, its Jacobians, and its comparison with simulation.
- `kernels`: root isolation.
"""
