"""Branches and bifurcation curves of periodic orbits, by pseudo-arclength continuation.

`branches` : branches over clearance, frequency or restitution.
`branch_switching` : the branches that meet at a special point.
`bifurcation_curves` : curves of special points in the plane of frequency and clearance.
`motion_curves` : all such curves of one motion in a window.
`special_points` : special points between two orbits of a branch.
`branch_ends` : where a branch ends on another one.
`parameters`, `point_equations` : what may vary; the stops and the equations of orbits at any values of it.
`continuation_problem`, `pseudo_arclength` : the equations that are continued, and the predictor-corrector method.
"""
