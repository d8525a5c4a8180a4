"""The measured rates from which estimates are computed, and the sizes of tiles."""

from __future__ import annotations

# `make estimates` prints, for random requests of every process, the processor seconds that they take on this machine
# and the seconds estimated from the figures below. Nine in ten estimates are correct within a factor of five. `python
# -m benchmarks.rates` fits the rates of trajectories. An estimate does not include the compilation of kernels.
#
# Forcing periods of the default oscillator that one core simulates in a second, with certified contacts: of a single
# trajectory, and of a map with the classification of the motion, in columns of FULL_COLUMN clearances. A shorter column
# fills fewer lanes, a longer one more, up to MAX_COLUMN: the time grows with the square root of the length.
PERIODS_PER_SECOND = 1.0e5
MAP_PERIODS_PER_SECOND = 8.0e5
FULL_COLUMN = 128
MAX_COLUMN = 512
# How much faster a preview is: it has no tangent flow.
PREVIEW_FASTER = 1.25
# Forcing periods in a second of a sweep, which computes the clearances of one omega one after the other.
SWEEP_PERIODS_PER_SECOND = 1.5e5
# Maximum number of clearances in a tile; a taller tile would not be computed faster.
MAX_TILE_ROWS = 1024
# Columns and maximum rows of a tile of an adaptive map. The tile is tall, because few clearances of each omega are
# computed, and wide, because all points along the sides of a tile are computed.
ADAPTIVE_COLUMNS = 64
ADAPTIVE_ROWS = 4096
# Number of strips whose seams take as long to close and to join as one strip takes to compute.
ADAPTIVE_STRIPS_CLOSED = 16
# The share of computed pixels was 0.26 in a map of 1024 x 1024 and 0.14 in one of 4096 x 4096 over the same window. It
# is taken as 1 up to the side ADAPTIVE_SIDE, and then as a power of the side, because borders are fractal. A computed
# pixel takes ADAPTIVE_PERIODS times as many periods as others, because it is near a border.
ADAPTIVE_SIDE = 60.0
ADAPTIVE_POWER = 0.45
ADAPTIVE_PERIODS = 1.6
# Periods that a pixel takes to settle: MIN_PERIODS_TO_SETTLE, plus the time in which the slowest free motion decays by
# a factor of e to the power of SETTLING_DECAYS. This time is left out where the clearance is at least FREE_FROM times
# the amplitude of the motion without stops. The share of other pixels that reach max_periods is MAX_UNSETTLED times a
# power of the restitution, but at least MIN_UNSETTLED.
MIN_PERIODS_TO_SETTLE = 8.0
SETTLING_DECAYS = 3.0
FREE_FROM = 1.5
MAX_UNSETTLED = 0.35
UNSETTLED_POWER = 4
MIN_UNSETTLED = 0.02
# Seconds for solving for the orbit of a trajectory that settles, per mass and per square of the orbit's impacts in a
# period, of which at most MAX_ORBIT_IMPACTS are counted; and seconds for the norm in which its return map contracts,
# per cube of the masses.
ORBIT_SECONDS = 1.0e-6
ORBIT_NORM_SECONDS = 1.3e-7
MAX_ORBIT_IMPACTS = 256
# Share of the unsettled trajectories that come so close to an orbit that the orbit is solved for.
ORBITS_TRIED = 0.25
# A sample of RUN_ON_SAMPLE chaotic trajectories is run on, RUN_ON_TOGETHER of them side by side in a map from rest, for
# RUN_ON times max_periods, but at most RUN_ON_PERIODS.
RUN_ON_SAMPLE = 20
RUN_ON_TOGETHER = 5
RUN_ON = 10
RUN_ON_PERIODS = 5.0e6
# Share of sensitive trajectories in a map with chaotic transients, and mean and maximum seconds for resolving one of
# them (`make resolve` prints the mean).
SENSITIVE = 0.02
RESOLUTION_SECONDS = 6.0
RESOLUTION_AT_WORST = 180.0
# Forcing periods in a second of the states of a basin, which run side by side; and the share of the states whose orbit
# must be solved for, because most states lead to an attractor that is known already.
BASIN_PERIODS_PER_SECOND = 3.0e5
BASIN_ORBITS = 0.1
# The core's MOST_SAMPLED_POINTS and MAP_POINTS_A_SAMPLE, of the sample of other starts in a map.
OTHER_STARTS_POINTS = 64
OTHER_STARTS_AMONG = 2000
# Maximum number of values of basin fractions: the result has figures of every attractor at every value.
FRACTION_VALUES = 2000
# Seconds of a trajectory, as `python -m benchmarks.rates` fits them to random ones: for a forcing period; for a cell,
# per mass; for an impact, and for an impact per mass; for finding the modes, and for this per square of the masses; for
# a sample, per mass and per square of the masses.
PERIOD_SECONDS = 2.0e-6
CELL_SECONDS = 2.5e-9
IMPACT_SECONDS = 1.0e-6
IMPACT_MASS_SECONDS = 1.0e-7
SETUP_SECONDS = 4.0e-3
SETUP_MASS_SECONDS = 1.2e-5
# The tables of a column of a map take this share of the time for finding the modes.
COLUMN_SETUPS = 0.25
SAMPLE_MASS_SECONDS = 6.0e-8
SAMPLE_SQUARE_SECONDS = 3.7e-9
# Minimum number of cells of a period, and the factor by which a cell costs more where the contact comes to rest,
# because its release is searched for.
MIN_CELLS = 16.0
HELD_CELLS = 16.0
# Factor by which a period costs more in the lanes of a map where the contact comes to rest: such lanes are computed one
# by one.
LANES_AT_REST = 2.0
# The speed of a flight between the stops under an acceleration a is FLIGHT_SPEED sqrt(a clearance). The damper takes
# the share 1 - 1/e of the speed of a bouncing mass in the time DRAG_OF_BOUNCES mass/damping; this effect is multiplied
# by a power of the restitution. A chatter is followed until the speed of its impacts has fallen to the share
# CHATTER_REST. The core ends a trajectory at MAX_PERIOD_IMPACTS impacts in a period.
FLIGHT_SPEED = 1.33
DRAG_OF_BOUNCES = 6.0
DRAG_POWER = 100
CHATTER_REST = 2.0e-5
# A chatter is taken to end in rest if it has at least this share of the impacts that lead to rest.
REST_SHARE = 0.25
MAX_PERIOD_IMPACTS = 1.0e5
# Forcing periods for which an undamped resonance is taken to grow.
GROWTH_PERIODS = 100.0
# Factor by which a trajectory of a map takes longer if it shares its tables with no other (`make planes`).
OWN_TABLES_SLOWER = 4.0
# Number of omegas, and of clearances, of a grid at which the cost of a period is computed.
SAMPLED_SIDE = 16
# Seconds of a tile: short enough for a small map to keep all workers busy. A compute process that has worked for so
# long takes no further tile; starting a process takes 1/30 s.
TILE_SECONDS = 0.6
# Maximum estimate of a tile in seconds; a tile that takes four times as long is stopped, after an hour.
MAX_TILE_SECONDS = 900.0
# Maximum seconds of a tile if none of its pixels settles before max_periods, because a tile has a time limit. Machines
# differ in speed, so a pixel is taken to be WORST_SLOWER times slower than the rates.
WORST_TILE_SECONDS = 900.0
WORST_SLOWER = 4.0
# Seconds for the linear properties of a structure: once, and per square of the masses of a chain or of matrices; for
# the response at a frequency: once, per mass of a chain, and per square of the masses of matrices; for the impulse
# response at a time: per mass.
STRUCTURE_SECONDS = 4.0e-3
CHAIN_MODES_SECONDS = 3.0e-6
MATRICES_MODES_SECONDS = 1.0e-5
RESPONSE_SECONDS = 5.0e-7
RESPONSE_MASS_SECONDS = 4.5e-7
RESPONSE_SQUARE_SECONDS = 5.0e-8
IMPULSE_SECONDS = 7.0e-8
# Seconds for a sample of a grazing curve, per mass; and for each order of its sequence, per mass.
CURVE_SECONDS = 2.2e-7
SEQUENCE_SECONDS = 5.5e-8
# Seconds for codimension-two points: for each stop; for each zero of the impulse response, or of its periodic sums,
# that is compared with the times of an order; for each point of recurrence, and for this per mass; for each resonant
# point, which has an unfolding, and for this per mass. Zeros are counted at ZERO_SAMPLES times, without the modes that
# have less than the share MIN_AMPLITUDE of the largest amplitude at the contact.
POINTS_SECONDS = 1.0e-3
ZERO_SECONDS = 2.0e-7
RECURRENCE_SECONDS = 7.0e-5
RECURRENCE_MASS_SECONDS = 2.0e-6
RESONANCE_SECONDS = 3.0e-4
RESONANCE_MASS_SECONDS = 2.5e-5
ZERO_SAMPLES = 256
MIN_AMPLITUDE = 1e-9
# Seconds that several harmonics add: at a sample of a grazing curve, for each harmonic and each order up to the
# highest; and for corners and double grazes in an interval of omega with ratio e, times the square root of the highest
# order. The number of these points, which is unknown in advance, changes the time by a factor of up to ten.
PEAK_SECONDS = 1.2e-6
PEAKS_SECONDS = 4.0e-2
# Seconds for a discontinuity mapping; for one of its overshoots, exact and to leading order; and for this per mass.
MAPPING_SECONDS = 0.25
OVERSHOOT_SECONDS = 4.0e-3
OVERSHOOT_MASS_SECONDS = 1.0e-4
# Forcing periods, beyond as many as pass before the record and in it, in which the motion at a value of a bifurcation
# diagram may settle; the core's EXPONENT_PERIODS.
DIAGRAM_SETTLING_PERIODS = 500
# Factor by which a forcing period takes longer with the growth of small changes.
GROWTH_FACTOR = 2.0
# Mean number of forcing periods of the trajectories that search for a motion with given stops; the maximum is 12,000.
SEARCH_PERIODS = 150.0
# Seconds for one frequency of the bifurcation curves of motions with one impact, for each family of motions and each
# period up to the longest, and seconds per mass. The second pair replaces the first one, for each
# harmonic, where grazes are looked for on a grid of phases.
EXPLICIT_POINT_SECONDS = 3.0e-5
EXPLICIT_POINT_MASS_SECONDS = 8.0e-6
GRIDDED_POINT_SECONDS = 2.5e-4
GRIDDED_POINT_MASS_SECONDS = 3.0e-5
# Seconds for one point of a branch; and for its multipliers, per cube of the masses. This is the time for few impacts;
# n impacts multiply it by 1 + n/BRANCH_IMPACTS.
BRANCH_SECONDS = 5.0e-4
MULTIPLIERS_SECONDS = 2.5e-8
BRANCH_IMPACTS = 16.0
# Number of structures for which modes are found at a point of a branch over a parameter of the structure: at every
# Newton step, and at two more values for the derivative; and seconds for the modes of each, besides those per square of
# the masses.
BRANCH_STRUCTURES = 12.0
BRANCH_MODES_SECONDS = 1.0e-3
# Number of points of a branch: BRANCH_POINTS of a short one, and BRANCH_POINTS_A_STEP for each step of BRANCH_STEP
# times the unit of the parameter. In a wide range these further points are at most BRANCH_POINTS_TURNING plus one for
# each step. The special points of a branch cost as much as BRANCH_SPECIAL_POINTS points. In a window, the number of
# points of two branches, and of all curves of a motion together.
BRANCH_POINTS = 60
BRANCH_STEP = 0.05
BRANCH_POINTS_A_STEP = 8
BRANCH_POINTS_TURNING = 100
BRANCH_SPECIAL_POINTS = 40
WINDOW_BRANCH_POINTS = 50
CURVES_POINTS = 100
CURVE_POINT_BRANCHES = 4.5
# Seconds for explaining the borders of a map, per mass: for each point, whose orbit is solved for; and for each point
# along a side, because borders are lines. The time depends on the number of motions, which is unknown in advance: it is
# a fifth of the estimate near the codimension-two point of the default oscillator, and up to eight times the estimate
# over all of Figure 8. The core stops at `tolerances.BORDERS_WORK`, and reports that.
BORDERS_POINT_SECONDS = 1.0e-4
BORDERS_SIDE_SECONDS = 0.1
# Maximum number of points times masses of a map whose borders are explained; each orbit is kept in memory.
MAX_BORDER_NUMBERS = 900_000
# Minimum number of steps of a job's progress for explaining borders, and maximum number of steps after the tiles.
BORDERS_STEPS = 100
MAX_STEPS_AFTER = 1000
# Seconds for reading observables and outputs: for each panel of a forcing period, which has half as many panels as
# cells and one for each impact; for each output in a panel; and for each motion. Then the mean number of forcing
# periods of a motion in a map, and the number for a motion that has not settled.
PANEL_SECONDS = 4.0e-7
PANEL_OUTPUT_SECONDS = 3.0e-7
OBSERVED_SECONDS = 2.0e-5
OBSERVED_PERIODS = 4.0
AVERAGED_PERIODS = 100.0
# Seconds for preparing an orbit.
OBSERVED_ORBIT_SECONDS = 1.5e-3
# Number of points of a window at which a motion is searched for.
CURVES_PLACES = 9
# Median seconds of a proof, by the kind of its statement.
PROOF_SECONDS = {"orbit": 0.25, "attraction": 1.5, "bifurcation": 0.5, "codimension-two": 0.2}
