"""The measured rates that estimates are made of, and the sizes of tiles."""

from __future__ import annotations

# `python -m benchmarks.estimates` prints, for each process in a few sizes, the seconds of one core that it takes on
# the machine it runs on, and those that come from the figures below: within a factor of three, that of borders within
# ten, because what a motion takes depends on which one it is.
#
# Forcing periods of the default oscillator that one core simulates in a second, with certified contacts: of a single
# trajectory, and of a map with the classification of the motion, in columns of FULL_COLUMN clearances. Shorter columns
# fill fewer lanes, longer ones more, up to LONGEST_COLUMN: the time goes with the root of their length.
PERIODS_PER_SECOND = 1.0e5
MAP_PERIODS_PER_SECOND = 4.0e5
FULL_COLUMN = 128
LONGEST_COLUMN = 512
# A preview verifies nothing and carries no small changes along.
PREVIEW_FASTER = 1.6
# The same of a sweep, in which the clearances of one omega are followed one after the other.
SWEEP_PERIODS_PER_SECOND = 1.5e5
# Clearances in a tile at most: more would not run faster.
TALLEST_TILE = 1024
# Columns and most rows of a tile of an adaptive map: tall, because few clearances of each omega are computed, and wide
# enough for the computed lines along its sides to be few.
ADAPTIVE_COLUMNS = 64
ADAPTIVE_ROWS = 4096
# Number of strips whose seams take as long to close and to join as one strip takes to compute.
ADAPTIVE_STRIPS_CLOSED = 16
# Its share of computed pixels was 0.26 and 0.14 in maps of 1024 x 1024 and 4096 x 4096 over one window: all of a
# map this long and wide, times a power of its size, for borders are fractal. Pixels near them take longer.
ADAPTIVE_SIDE = 60.0
ADAPTIVE_POWER = 0.45
ADAPTIVE_PERIODS = 1.6
# Periods that a pixel takes on average to settle, and the share of pixels that go on to max_periods.
PERIODS_TO_SETTLE = 45
UNSETTLED = 0.1
# The same of the states of a basin, which run side by side and mostly to few attractors.
BASIN_PERIODS_PER_SECOND = 8.0e5
BASIN_UNSETTLED = 0.02
# |lambda| T of a period that costs as much as one of the default oscillator near omega = 0.29.
REFERENCE_STIFFNESS = 33.0
# Short enough for a small map to keep all workers busy; to begin a tile takes a thirtieth of a second.
TILE_SECONDS = 0.6
# And no more than this when none of its pixels settles before max_periods: a tile has a time limit. Machines differ, so
# that is counted at a quarter of a map's speed.
WORST_TILE_SECONDS = 900.0
WORST_SLOWER = 4.0
# One sample of a grazing curve, per order looked at and mass.
CURVE_SECONDS = 5.0e-8
# The codimension-two points per unit of omega and mass; their number grows with the square of the orders looked at.
POINTS_SECONDS = 1.0e-5
# One overshoot of a discontinuity mapping, exact and leading order.
MAPPING_SECONDS = 1.0e-2
# Of a bifurcation diagram: exponents where the motion has not closed, as a mean over values in periods without them.
DIAGRAM_EXPONENT_PERIODS = 300
# Trajectories that are followed at most to find a motion with given stops.
SEARCH_PERIODS = 1.2e4
# One frequency of the bifurcation curves in closed form, per mass, for each period up to the longest.
CURVE_POINT_SECONDS = 4.0e-5
# One point of a branch, per mass, for few impacts; it goes with the square of those over BRANCH_IMPACTS.
BRANCH_SECONDS = 5.0e-4
BRANCH_IMPACTS = 16.0
# Points that a branch has as a rule; in a window those of two branches, and of all curves of a motion together.
BRANCH_POINTS = 150
WINDOW_BRANCH_POINTS = 100
CURVES_POINTS = 200
CURVE_POINT_BRANCHES = 2.0
# Explaining the borders of a map, per mass: for each point, whose orbit is solved for, and for each of the points along
# a side, for borders are lines. What counts is how many motions there are, which is not known before: a seventh of it
# round the codimension-two point of the default oscillator, up to five times as much over all of Figure 8. The core
# ends it at `tolerances.BORDERS_WORK`, and says so.
BORDERS_POINT_SECONDS = 1.0e-4
BORDERS_SIDE_SECONDS = 0.25
# Points times masses of a map whose borders are explained, at most: each keeps its orbit in memory.
MOST_BORDER_NUMBERS = 900_000
# The least number of steps of a job's progress that explaining borders counts.
BORDERS_STEPS = 100
MOST_STEPS_AFTER = 1000
# Places of a window at which a motion is looked for.
CURVES_PLACES = 9
