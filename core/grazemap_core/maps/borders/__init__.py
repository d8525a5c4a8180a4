"""Borders of an unfolding map: where two motions meet, and the bifurcation curve or the basins that separate them.

`map_borders` : every border of a map with its explanation.
`regions` : connected points with one family of orbits, and the orbit at each of them.
`motion_grid` : the grid of a map, and the names of its motions.
"""
