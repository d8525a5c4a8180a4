"""Branches and bifurcation curves of periodic orbits, by pseudo-arclength continuation.

`branches` : branches over clearance, frequency or restitution.
`branch_switching` : the branches that meet at a special point.
`bifurcation_curves` : curves of special points in the plane of frequency and clearance.
`motion_curves` : all such curves of one motion in a window.
`special_points` : special points between two orbits of a branch.
`continuation_problem`, `pseudo_arclength` : the equations that are continued, and the predictor-corrector method.
"""
