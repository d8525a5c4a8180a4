"""Periodic orbits with impacts: equations, Newton's method, error bounds, multipliers and contacts of single orbits.

`one_impact_branches`, `one_impact_curves` : motions with one impact a period, in closed form.
`window_curves` : their bifurcation curves in a window of the plane of frequency and clearance.
`impact_sequences` : the impacts of a period, which identify an orbit and start Newton's method.
`periodic_orbits` : one orbit with everything that is computed for it; `batches` : many orbits at once.
`simulated_orbits` : periodic motions that rest on a stop, from simulation.
`search` : a first guess for an orbit of which only period and stops are known.
`family`, `states` : equations at any frequency, states and multipliers; shared by the others.
"""
