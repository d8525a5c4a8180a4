"""Borders of an unfolding map: where two motions meet, and the bifurcation curve or the basins that separate them.

`map_borders` : every border of a map with its explanation.
`regions` : the orbit at every point of a map.
`region` : connected points with one family of orbits.
`motion_grid` : the grid of a map and the names of its motions.
`border_lines` : distances from a polyline, in steps of a map.
`progress` : how much of the work is done.
"""
