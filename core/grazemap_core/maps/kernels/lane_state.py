"""Task of a column of trajectories, record of every lane while its trajectory runs, and results.

The arrays that `lane_scheduler` and `classification` share, and the meaning of their columns.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels.final_states import FinalStates
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.tolerances import APPROACH
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.tolerances import CLOSING_GOAL

# columns of `TrajectoryResults.codes`
REASON, PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC, SETTLED_AFTER, STICKING = 0, 1, 2, 3, 4, 5, 6
GROWTH = 7
"""What the growth of small changes implies for a motion that was not named; a code of `codes`."""
HALVES_RUN, IMPACTS = 8, 9
"""Half periods that were run, and impacts that were followed one by one."""
UNVERIFIED = 10
"""Why a named motion is not verified, a code of `codes`; RESOLVED if it is verified."""
SENSITIVE = 11
"""1 if a decision on the way to a named motion may be wrong by round-off (`lane_errors`)."""
CODES = 12

# columns of `TrajectoryResults.figures`
LEAST_VELOCITY, MULTIPLIER, LYAPUNOV = 0, 1, 2
MEAN_POSITION, MEAN_VELOCITY = 3, 4
"""As `period_detection.mean_section`, in units of the stops and of omega times it."""
LYAPUNOV_ERROR = 5
TRANSIENT_GROWTH = 6
"""As `lane_errors.transient_growth_of` where a verified motion captures the trajectory."""
FIGURES = 7

# states of a lane; `classification` has the diagram
SETTLING = 0
"""The lane's motion is not named yet."""
GROWING = 1
"""The lane's motion is not named yet, and the growth of small changes is measured."""
REPEATING = 2
"""The lane's motion is named but not verified; a basis of all changes is propagated for one more period."""
ENDING = 3
"""The lane's motion is known; the state at the end of the forcing period is the start of a sweep's next trajectory."""

ENDED_EARLY, MOVES, RESTS = 0, 1, 2
"""How a trajectory of a sweep ended: without a final state, so that the next one starts from rest; or with one."""

# columns of `LaneRecords.counts`
TRAJECTORY, STARTED, STATE, DEADLINE = 0, 1, 2, 3
"""Index of the lane's trajectory, -1 for none; half period at which it started; state; half period at which the lane is
classified in any case."""
EVENTS_FROM = 4
"""Half period from which on the lane's events hold all its impacts."""
NEAR_ORBIT = 5
"""Half periods after which a verified orbit repeats that does not capture the lane yet; 0 for none."""
COUNTS = 6

# columns of `LaneRecords.sizes`
FOLLOWED_IMPACTS, COUNTED_IMPACTS = 0, 1
"""Impacts that were followed one by one, and those that count toward SETTLING_IMPACTS."""
RETURN_GOAL = 2
"""Distance of a return, in units of the stops, below which the lane is classified."""
SIZES = 3


class LaneRecords(NamedTuple):
    """Records of the trajectories in all lanes."""

    counts: Integers
    """(LANES, COUNTS) Whole numbers, by the columns above; times are half periods since the column began."""
    sizes: Floats
    """(LANES, SIZES) Other numbers, by the columns above."""


class ColumnStarts(NamedTuple):
    """Where the trajectories of a column begin: at s states for each of n stops."""

    stops: Floats
    """(n, fields of Stops) The stops; trajectory i has those number i // s, with the unit b."""
    base: Floats
    """(n, N, 2) Trajectory i starts at base[i // s] + b * directions[i % s], from where it is moved by `offset`."""
    directions: Floats
    """(s, N, 2) Directions of the starts, in units of the stops."""
    offset: Floats
    """(n,) A multiple of `aside` that is added to the start, for every stops."""
    aside: Floats
    """(n, N, 2) Direction of `offset`."""
    on_stop: Integers
    """(n s,) Stop on which each trajectory starts without moving into it, +1 right or -1 left; 0: it starts between the
    stops."""


class ColumnTask(NamedTuple):
    """Trajectories of a column, and how long they run."""

    starts: ColumnStarts
    """Where they begin."""
    max_periods: int
    """Forcing periods that a trajectory runs at most."""
    max_period: int
    """Longest period that is looked for."""
    early: bool
    """Whether a trajectory stops once its motion can be named; otherwise all run for `max_periods`."""
    follow: bool
    """Whether every trajectory but the first starts at the final state of the one before it. Where that is outside the
    stops, the contact is put on the stop that it is beyond, with its velocity."""
    growth_halves: int
    """Half periods at the end in which the growth of small changes is measured; with 0 there are no exponents of
    motions that are not periodic, nor multipliers of those that are not verified."""
    growth_skipped: int
    """Number of these half periods, at the beginning, that do not count."""
    inherits: bool
    """Whether the first trajectory starts with the error that the last one of the previous run had at its end."""
    ended: int
    """Of a sweep that goes on: how the last trajectory of the previous run ended, ENDED_EARLY, MOVES or RESTS, which
    the first one follows; otherwise ENDED_EARLY."""


class TrajectoryResults(NamedTuple):
    """Motions of all trajectories of a column."""

    codes: Integers
    """(n s, CODES) Reason (a code of `codes`), period, impacts_right, impacts_left, symmetric, settled_after (forcing
    periods after which the orbit had closed, or was solved for, or after which no contact was possible any more; -1
    unless named), sticking, growth, half periods run, impacts followed, why the motion is not verified, and whether
    round-off may have decided it."""
    figures: Floats
    """(n s, FIGURES) Minimum impact velocity, NaN without impacts; largest modulus of the multipliers over one motion
    period and largest Lyapunov exponent per forcing period, NaN where they are not known; mean position and velocity of
    a periodic motion, NaN unless it was named; standard error of an exponent that was measured, else NaN; largest
    growth of a change before capture, NaN unless captured."""
    final: FinalStates
    """Final states of n s trajectories, or of none where final states are not wanted."""


def lane_records() -> LaneRecords:
    """Return records of lanes without a trajectory."""
    return LaneRecords(np.zeros((LANES, COUNTS), dtype=np.int64), np.zeros((LANES, SIZES)))


@kernel
def stops_in_row(table: Floats, row: int) -> Stops:
    """Return the stops in a row of `ColumnStarts.stops`."""
    return Stops(
        table[row, 0],
        table[row, 1],
        table[row, 2],
        table[row, 3],
        table[row, 4],
        table[row, 5],
        table[row, 6],
        table[row, 7] != 0.0,
    )


@kernel
def begin_record(records: LaneRecords, lane: int, trajectory: int, k: int, task: ColumnTask, verifiable: bool) -> None:
    """Begin the record of a trajectory that starts in a lane after k half periods."""
    counts, sizes = records.counts, records.sizes
    counts[lane] = 0
    counts[lane, TRAJECTORY] = trajectory
    counts[lane, STARTED] = k
    counts[lane, STATE] = SETTLING
    counts[lane, DEADLINE] = k + 2 * task.max_periods
    counts[lane, EVENTS_FROM] = k
    sizes[lane] = 0.0
    sizes[lane, RETURN_GOAL] = APPROACH if verifiable else CLOSING_GOAL
