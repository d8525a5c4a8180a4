"""Borders of an unfolding map: where two motions meet, and the bifurcation curve or the basins that separate them.

`map_borders` : every border of a map with its explanation.
`region_orbits` : the orbit at every point of a map.
`border_lines` : distances from a polyline, in steps of a map.
`progress` : how much of the work is done.
"""
