"""Maps of motions over parameters and initial states, computed by many trajectories in lockstep.

`unfolding` : the motion at every point of a rectangle of frequency and clearance.
`adaptive_map`, `refinement` : the same, computed only where neighbours differ.
`basins` : the motion that every initial state leads to.
`bifurcation_diagrams` : settled motions along one parameter.
`chaotic_transients` : the chance that a chaotic motion settles later, from a sample that is run on.
`runner` : runs of many trajectories until their motions are classified.
`borders` : the bifurcation curves, or basin boundaries, that separate the motions of a map.
`kernels` : trajectories in lockstep and their classification.
"""
