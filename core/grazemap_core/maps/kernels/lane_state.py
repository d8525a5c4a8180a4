"""A column of a map: the task, the record of every lane while its trajectory runs, and the results.

The arrays that `lane_scheduler` and `classification` share, and the meaning of their columns.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.contact.kernels.runs import Run
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.kernels.lane_tables import LANES, LaneModels
from grazemap_core.maps.kernels.lane_tangents import LaneTangents
from grazemap_core.maps.kernels.lanes import Lanes
from grazemap_core.maps.tolerances import APPROACH
from grazemap_core.numerics.jit.compiled import inlined_formula, kernel
from grazemap_core.numerics.jit.lane_values import record_of
from grazemap_core.orbits.kernels.verification import VerificationScratch
from grazemap_core.orbits.tolerances import MAX_VERIFIED_IMPACTS
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.period_detection import ReturnSearch, StroboscopicHistory
from grazemap_core.simulation.tolerances import CLOSING_GOAL

# columns of `TrajectoryResults.codes`
REASON, PERIOD, IMPACTS_RIGHT, IMPACTS_LEFT, SYMMETRIC = 0, 1, 2, 3, 4
"""RESOLVED, or the code of `codes` why the motion is not named; its name, as from `period_detection.detect_period`."""
SETTLED_AFTER = 5
"""Forcing periods after which the orbit had closed, or was solved for, or after which no contact was possible any more;
-1 unless the motion is named."""
STICKING = 6
"""1 if the contact rests on a stop during a part of the period."""
GROWTH = 7
"""What the growth of small changes implies for a motion that was not named; a code of `codes`."""
HALVES_RUN, IMPACTS = 8, 9
"""Half periods that were run, and impacts that were followed one by one."""
UNVERIFIED = 10
"""Why a named motion is not verified, a code of `codes`; RESOLVED if it is verified."""
SENSITIVE = 11
"""1 if a decision on the way to a named motion may be wrong by round-off (`lane_errors`)."""
CODES = 12

# columns of `TrajectoryResults.figures`; NaN where a number is not known
LEAST_VELOCITY = 0
"""Minimum impact velocity; NaN without impacts."""
MULTIPLIER, LYAPUNOV = 1, 2
"""Largest modulus of the multipliers over a period of the motion; largest Lyapunov exponent per forcing period."""
MEAN_POSITION, MEAN_VELOCITY = 3, 4
"""Of a motion that was named, as `period_detection.mean_section`, in units of the stops and of omega times it."""
LYAPUNOV_ERROR = 5
"""Standard error of an exponent that was measured."""
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

MAX_ORBIT_IMPACTS = 2 * MAX_VERIFIED_IMPACTS
"""Maximum number of impacts in a whole period of a verified orbit. A symmetric orbit is solved for over half its period
only, so its whole period may have twice MAX_VERIFIED_IMPACTS."""


class LaneRecords(NamedTuple):
    """Progress of the trajectory in every lane; times are half periods since the column began."""

    trajectory: Integers
    """(LANES,) Index of the lane's trajectory, -1 for none."""
    started: Integers
    """(LANES,) When it started."""
    state: Integers
    """(LANES,) SETTLING to ENDING."""
    deadline: Integers
    """(LANES,) When the lane is classified in any case."""
    events_from: Integers
    """(LANES,) Since when the lane's events hold all its impacts."""
    near_orbit: Integers
    """(LANES,) Half periods after which a verified orbit repeats that does not capture the lane yet; 0 for none."""
    followed: Floats
    """(LANES,) Impacts that were followed one by one."""
    counted: Floats
    """(LANES,) Those of them that count toward SETTLING_IMPACTS."""
    return_goal: Floats
    """(LANES,) Distance of a return, in units of the stops, below which the lane is classified."""


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


class FinalStates(NamedTuple):
    """Final states of n trajectories; with n = 0 nothing is kept."""

    states: Floats
    """(n, 2 N) State at phase 0 of the forcing. If a trajectory of a symmetric motion ended after an odd number of half
    periods, this is the mirror image of its state."""
    resting_stop: Floats
    """(n,) The stop on which the contact rests in this state, or 0."""
    impacts: Floats
    """(n, 3, MAX_ORBIT_IMPACTS) Stops, phases and signed velocities of the impacts in one period of the last orbit that
    was verified near the trajectory."""
    counts: Floats
    """(n,) Number of these impacts."""


class TrajectoryResults(NamedTuple):
    """Motions of all trajectories of a column."""

    codes: Integers
    """(n s, CODES) Whole numbers, by the columns above."""
    figures: Floats
    """(n s, FIGURES) Other numbers, by the columns above."""
    final: FinalStates
    """Final states of n s trajectories, or of none where final states are not wanted."""


class Column(NamedTuple):
    """A column of a map."""

    models: LaneModels
    """The models of the trajectories."""
    task: ColumnTask
    """What is computed."""
    results: TrajectoryResults
    """Receives the motions."""
    group: Lanes
    """Current states of all lanes."""
    history: StroboscopicHistory
    """Every lane's states at the ends of the last half periods."""
    tangents: LaneTangents
    """Small changes of the state along every lane, with the capacity for task.growth_halves."""
    records: LaneRecords
    """Progress of every lane's trajectory."""
    returns: ReturnSearch
    """Scratch of the search for returns."""
    run: Run
    """Scratch: a lane that goes through a cell by itself, with the capacity of the lanes for events."""
    verification: VerificationScratch
    """Scratch of verifications."""
    final_state: Floats
    """(N, 2) The state in which the last trajectory of a sweep ended."""


def return_search() -> ReturnSearch:
    """Return fresh scratch."""
    return ReturnSearch(*(np.zeros(LANES) for _ in ReturnSearch._fields))


def final_states(count: int, blocks: int) -> FinalStates:
    """Return new arrays for `count` trajectories of a structure of `blocks` blocks."""
    return FinalStates(
        states=np.zeros((count, 2 * blocks)),
        resting_stop=np.zeros(count),
        impacts=np.zeros((count, 3, MAX_ORBIT_IMPACTS)),
        counts=np.zeros(count),
    )


def lane_records() -> LaneRecords:
    """Return records of lanes without a trajectory."""
    return LaneRecords(
        trajectory=np.full(LANES, -1),
        started=np.zeros(LANES, dtype=np.int64),
        state=np.full(LANES, ENDING),
        deadline=np.zeros(LANES, dtype=np.int64),
        events_from=np.zeros(LANES, dtype=np.int64),
        near_orbit=np.zeros(LANES, dtype=np.int64),
        followed=np.zeros(LANES),
        counted=np.zeros(LANES),
        return_goal=np.zeros(LANES),
    )


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
def begin_record(column: Column, lane: int, trajectory: int, k: int) -> None:
    """Begin the record of a trajectory that starts in a lane after k half periods."""
    records = column.records
    records.trajectory[lane] = trajectory
    records.started[lane] = k
    records.state[lane] = SETTLING
    records.deadline[lane] = k + 2 * column.task.max_periods
    records.events_from[lane] = k
    records.near_orbit[lane] = 0
    records.followed[lane] = 0.0
    records.counted[lane] = 0.0
    records.return_goal[lane] = APPROACH if record_of(column.models, lane).blocks.verifiable else CLOSING_GOAL


@kernel
def move_record(records: LaneRecords, source: int, target: int) -> None:
    """Move the record of a lane to another lane."""
    records.trajectory[target] = records.trajectory[source]
    records.started[target] = records.started[source]
    records.state[target] = records.state[source]
    records.deadline[target] = records.deadline[source]
    records.events_from[target] = records.events_from[source]
    records.near_orbit[target] = records.near_orbit[source]
    records.followed[target] = records.followed[source]
    records.counted[target] = records.counted[source]
    records.return_goal[target] = records.return_goal[source]
    end_record(records, source)


@kernel
def end_record(records: LaneRecords, lane: int) -> None:
    """Note that a lane has no trajectory."""
    records.trajectory[lane] = -1
    records.state[lane] = ENDING


@inlined_formula
def is_captured(codes: Integers) -> bool:
    """Return whether an orbit captured the trajectory with these `TrajectoryResults.codes`: its end has no error."""
    return bool(codes[REASON] == RESOLVED and codes[UNVERIFIED] in (RESOLVED, ROUNDING_DECIDES))
