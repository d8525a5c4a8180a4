"""The measured rates that estimates are made of, and the sizes of tiles."""

from __future__ import annotations

# `make estimates` prints, for random requests of every process, the seconds of one core that they take on this machine,
# and those estimated from the figures below: nine in ten differ by less than a factor of five. `python -m
# benchmarks.rates` fits those of trajectories. Compiling kernels is not part of an estimate: it comes before.
#
# Forcing periods of the default oscillator that one core simulates in a second, with certified contacts: of a single
# trajectory, and of a map with the classification of the motion, in columns of FULL_COLUMN clearances. Shorter columns
# fill fewer lanes, longer ones more, up to LONGEST_COLUMN: the time grows with the square root of their length.
PERIODS_PER_SECOND = 1.0e5
MAP_PERIODS_PER_SECOND = 4.0e5
FULL_COLUMN = 128
LONGEST_COLUMN = 512
# How much faster a preview is: it has no tangent flow.
PREVIEW_FASTER = 1.25
# The same for a sweep, which computes the clearances of one omega one after the other.
SWEEP_PERIODS_PER_SECOND = 1.5e5
# Maximum number of clearances in a tile: more would not be faster.
TALLEST_TILE = 1024
# Columns and maximum rows of a tile of an adaptive map: tall, because few clearances of each omega are computed, and
# wide, because all points along its sides are computed.
ADAPTIVE_COLUMNS = 64
ADAPTIVE_ROWS = 4096
# Number of strips whose seams take as long to close and to join as one strip takes to compute.
ADAPTIVE_STRIPS_CLOSED = 16
# The share of computed pixels was 0.26 and 0.14 in maps of 1024 x 1024 and 4096 x 4096 over one window: 1 up to this
# side, then a power of the side, because borders are fractal. Pixels near them take longer.
ADAPTIVE_SIDE = 60.0
ADAPTIVE_POWER = 0.45
ADAPTIVE_PERIODS = 1.6
# Periods that a pixel takes to settle: LEAST_PERIODS_TO_SETTLE and the time in which the slowest free motion decays by
# a factor of e to the power of SETTLING_DECAYS. Where the clearance is FREE_FROM times the amplitude of the motion
# without stops or more, it takes the first alone. The share of other pixels that reach max_periods is MOST_UNSETTLED
# times a power of the restitution, but not less than LEAST_UNSETTLED.
LEAST_PERIODS_TO_SETTLE = 8.0
SETTLING_DECAYS = 3.0
FREE_FROM = 1.5
MOST_UNSETTLED = 0.35
UNSETTLED_POWER = 4
LEAST_UNSETTLED = 0.02
# The orbit of a trajectory that settles, per mass and square of its impacts in a period, of which it has no more than
# are given; and the norm in which its return map contracts, per cube of the masses.
ORBIT_SECONDS = 1.0e-6
ORBIT_NORM_SECONDS = 1.3e-7
# The share of trajectories that do not settle, but come close enough to an orbit for it to be solved for.
ORBITS_TRIED = 0.25
MOST_ORBIT_IMPACTS = 256
# Number of chaotic trajectories that are run on, how many of a map from rest are run side by side, for how many times
# the periods, and the maximum of these.
RUN_ON_SAMPLE = 20
RUN_ON_TOGETHER = 5
RUN_ON = 10
RUN_ON_PERIODS = 5.0e6
# The share of sensitive trajectories in a map with chaotic transients, and the mean and maximum seconds in which one of
# them is resolved (`make resolve` prints the mean).
SENSITIVE = 0.02
RESOLUTION_SECONDS = 6.0
RESOLUTION_AT_WORST = 180.0
# The same for the states of a basin, which run side by side, and the share of them whose orbit is not known already, as
# they mostly lead to few attractors.
BASIN_PERIODS_PER_SECOND = 8.0e5
BASIN_ORBITS = 0.1
# The maximum number of values of basin fractions: their result has figures of every attractor at every value.
FRACTION_VALUES = 2000
# Seconds of a trajectory, as `python -m benchmarks.rates` fits them to random ones: of a forcing period, of a cell per
# mass, of an impact, and of an impact per mass; of finding the modes, and of the same per square of the masses; of a
# sample per mass, and per square of the masses.
PERIOD_SECONDS = 2.0e-6
CELL_SECONDS = 2.5e-9
IMPACT_SECONDS = 1.0e-6
IMPACT_MASS_SECONDS = 1.0e-7
SETUP_SECONDS = 4.0e-3
SETUP_MASS_SECONDS = 1.2e-5
# The tables of a column of a map take this share of it.
COLUMN_SETUPS = 0.25
SAMPLE_MASS_SECONDS = 6.0e-8
SAMPLE_SQUARE_SECONDS = 3.7e-9
# The minimum number of cells of a period, and how much more cells cost where the contact comes to rest, as its
# release is looked for.
LEAST_CELLS = 16.0
HELD_CELLS = 16.0
# How much more a period costs in the lanes of a map where the contact comes to rest: such lanes are computed one
# by one.
LANES_AT_REST = 8.0
# The speed of a flight between the stops under an acceleration a is FLIGHT_SPEED sqrt(a clearance). The damper takes
# the share 1 - 1/e of the speed of a bouncing mass in DRAG_OF_BOUNCES mass/damping; how much that matters is a power of
# the restitution. A chatter is followed until its impacts have CHATTER_REST of the speed. The core ends a trajectory at
# MOST_PERIOD_IMPACTS.
FLIGHT_SPEED = 1.33
DRAG_OF_BOUNCES = 6.0
DRAG_POWER = 100
CHATTER_REST = 2.0e-5
# The share of the impacts of a chatter that ends in rest from which on it is taken to do so.
REST_SHARE = 0.25
MOST_PERIOD_IMPACTS = 1.0e5
# Forcing periods in which a resonance without damping is taken to grow.
GROWTH_PERIODS = 100.0
# A trajectory of a map that shares its tables with no other one takes so many times as long (`make planes`).
ALONE_SLOWER = 4.0
# Number of omegas, and of clearances, of a grid at which the cost of a period is computed.
SAMPLED_SIDE = 16
# Seconds of a tile: short enough for a small map to keep all workers busy. A process that has worked so long takes no
# further tile; starting one takes 1/30 s.
TILE_SECONDS = 0.6
# Maximum estimate of a tile: one that takes four times as long is stopped after an hour.
MOST_TILE_SECONDS = 900.0
# Maximum seconds of a tile when none of its pixels settles before max_periods, because a tile has a time limit.
# Machines differ, so a quarter of a map's speed is assumed.
WORST_TILE_SECONDS = 900.0
WORST_SLOWER = 4.0
# The linear properties of a structure: once, and per square of the masses; a response at a frequency, once and per mass
# of a chain or square of the masses of matrices; the impulse response at a time, per mass.
STRUCTURE_SECONDS = 4.0e-3
CHAIN_MODES_SECONDS = 2.0e-5
MATRICES_MODES_SECONDS = 1.2e-4
RESPONSE_SECONDS = 2.5e-6
RESPONSE_MASS_SECONDS = 6.0e-7
RESPONSE_SQUARE_SECONDS = 5.0e-7
IMPULSE_SECONDS = 7.0e-8
# One sample of a grazing curve, per mass, and of each order of its sequence.
CURVE_SECONDS = 2.2e-7
SEQUENCE_SECONDS = 5.5e-8
# The codimension-two points: once for each stop; for each zero of the impulse response, or of its periodic sums, that
# is compared with the times of an order; and for each point of recurrence and each resonant one, which has an
# unfolding, and the same per mass. The zeros are counted at so many times, without the modes that the contact hardly
# has.
POINTS_SECONDS = 1.0e-3
ZERO_SECONDS = 2.0e-7
RECURRENCE_SECONDS = 7.0e-5
RECURRENCE_MASS_SECONDS = 2.0e-6
RESONANCE_SECONDS = 3.0e-4
RESONANCE_MASS_SECONDS = 2.5e-5
ZERO_SAMPLES = 256
LEAST_AMPLITUDE = 1e-9
# What several harmonics add: at a sample of a grazing curve, for each harmonic and each order of the highest one; and
# for corners and double grazes where omega grows by a factor of e, times the root of the highest order. Their number,
# which is unknown before, changes the time by a factor of up to ten.
PEAK_SECONDS = 1.2e-6
PEAKS_SECONDS = 4.0e-2
# A discontinuity mapping; one of its overshoots, exact and leading order, and the same per mass.
MAPPING_SECONDS = 0.25
OVERSHOOT_SECONDS = 4.0e-3
OVERSHOOT_MASS_SECONDS = 1.0e-4
# Forcing periods after the recorded ones until which the motion at a value of a bifurcation diagram may settle.
DIAGRAM_SETTLING_PERIODS = 500
# How much more a forcing period takes with the growth of small changes.
GROWTH_SLOWER = 2.0
# Mean number of forcing periods of the trajectories that search for a motion with given stops; their maximum is 12,000.
SEARCH_PERIODS = 150.0
# One frequency of the bifurcation curves in closed form, for each period up to the longest, and the same per mass.
CURVE_POINT_SECONDS = 8.0e-5
CURVE_POINT_MASS_SECONDS = 2.0e-5
# The same for motions with one impact on one stop whose curves are explicit in the phase, for each harmonic.
EXPLICIT_POINT_SECONDS = 8.0e-4
EXPLICIT_POINT_MASS_SECONDS = 1.0e-4
# One point of a branch, and its multipliers, per cube of the masses, for few impacts; the time grows with their number
# over BRANCH_IMPACTS.
BRANCH_SECONDS = 1.0e-3
MULTIPLIERS_SECONDS = 5.0e-8
BRANCH_IMPACTS = 16.0
# The structures of a point of a branch over one of their parameters, each with modes of its own: at every Newton step,
# and at two more for the derivative. The seconds of each, besides those per square of the masses.
BRANCH_STRUCTURES = 12.0
BRANCH_MODES_SECONDS = 1.0e-3
# The number of points of a branch: of a short one, and for each step of BRANCH_STEP times the parameter's unit, with a
# maximum beyond one for each step; and the number of points that its special points cost. In a window, the number of
# points of two branches, and of all curves of a motion together.
BRANCH_POINTS = 60
BRANCH_STEP = 0.05
BRANCH_POINTS_A_STEP = 8
BRANCH_POINTS_TURNING = 300
BRANCH_SPECIAL_POINTS = 40
WINDOW_BRANCH_POINTS = 50
CURVES_POINTS = 100
CURVE_POINT_BRANCHES = 2.0
# Explaining the borders of a map, per mass: for each point, whose orbit is solved for, and for each of the points along
# a side, for borders are lines. The time depends on the number of motions, which is unknown before: a fifth of the
# estimate near the codimension-two point of the default oscillator, up to eight times as much over all of Figure 8. The
# core stops at `tolerances.BORDERS_WORK`, and reports it.
BORDERS_POINT_SECONDS = 1.0e-4
BORDERS_SIDE_SECONDS = 0.1
# Maximum of points times masses of a map whose borders are explained: each orbit is kept in memory.
MOST_BORDER_NUMBERS = 900_000
# Minimum number of steps of a job's progress for explaining borders; maximum number after the tiles.
BORDERS_STEPS = 100
MOST_STEPS_AFTER = 1000
# Reading quantities off a forcing period, for each of its panels, which are half of its cells and its impacts, and for
# each output in a panel; and for each motion. The forcing periods of a motion in a map on average, and of one that has
# not settled.
PANEL_SECONDS = 4.0e-7
PANEL_OUTPUT_SECONDS = 3.0e-7
OBSERVED_SECONDS = 2.0e-5
OBSERVED_PERIODS = 4.0
AVERAGED_PERIODS = 100.0
# Preparing an orbit of a branch.
OBSERVED_ORBIT_SECONDS = 1.5e-3
# Number of points of a window at which a motion is looked for.
CURVES_PLACES = 9
# Median time of a proof, by the kind of its statement.
PROOF_SECONDS = {"orbit": 0.25, "attraction": 1.5, "bifurcation": 0.5, "codimension-two": 0.2}
# Seconds in which one core compiles the kernels of a step of `grazemap_core.warmup`, roughly; and what trajectories
# that share no tables add.
COMPILING_SECONDS = {"curves": 5.0, "trajectories": 9.0, "orbits": 8.0, "maps": 40.0, "diagrams": 45.0}
COMPILING_SECONDS |= {"observables": 25.0, "map_observables": 65.0}
APART_SECONDS = 20.0
