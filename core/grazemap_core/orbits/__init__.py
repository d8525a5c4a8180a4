"""Periodic orbits with impacts: equations, Newton's method, error bounds, multipliers and contacts of single orbits.

`single_impact` : motions with one impact a period, or one on each stop by symmetry, and their bifurcation curves.
`two_impact_orbits` : motions with one impact on each stop.
`impact_sequences` : the impacts of a period, which identify an orbit and start Newton's method.
`periodic_orbits` : one orbit with everything that is computed for it, and many orbits at once.
`simulated_orbits` : periodic motions that rest on a stop, from simulation.
`search` : a first guess for an orbit of which only period and stops are known.
`family` : a family of orbits, and the family at a frequency, which the others take.
`states` : states and multipliers of an orbit.
"""
