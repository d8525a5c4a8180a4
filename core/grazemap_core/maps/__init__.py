"""Maps of motions over parameters and initial states, computed by many trajectories in lockstep.

`map_settings` : where trajectories begin, under which conditions, and for how long they run.
`runner` : runs of many trajectories until their motions are classified.
`planes` : the plane of two parameters, and the runs at its points.
`unfolding` : the motion at every point of a plane.
`adaptive_map`, `refinement` : the same, computed only where neighbours differ.
`sensitive_points` : the motions of sensitive points, decided in multi-precision arithmetic.
`map_observables` : what is read off the motions of a map.
`plane_grazes` : the grazing curves of a plane.
`basins`, `basin_fractions`, `basin_boundary` : the motions that initial states lead to, and the boundary between them.
`bifurcation_diagrams` : settled motions along one parameter.
`chaotic_transients`, `samples` : the chance that a chaotic motion settles later, from a sample that is run on.
`borders` : the bifurcation curves, or basin boundaries, that separate the motions of a map.
`kernels` : trajectories in lockstep and their classification.
"""
