"""Recorded trajectories: all impacts and intervals of sticking, samples in closed form, and the motion at the end."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grazemap_core import codes
from grazemap_core.arrays import Floats
from grazemap_core.checks import checked_order
from grazemap_core.contact.kernels.cells import forced_part, reach_from
from grazemap_core.contact.kernels.half_period import is_free_for_ever, reason_of_end
from grazemap_core.contact.kernels.runs import (
    ANCHOR,
    EVENT_COLUMNS,
    EVENT_COUNT,
    HALF,
    NOT_FINITE,
    OK,
    RECORD_FULL,
    TIME,
    UNDECIDED,
)
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import RecordSizeError
from grazemap_core.model.harmonic_response import hidden_by_rounding
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels import period_detection
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory
from grazemap_core.simulation.kernels.recorded_run import run_recorded
from grazemap_core.simulation.motion import Motion, motion_from_codes
from grazemap_core.simulation.record import EVENT_BYTES, Impacts, Record, Sticking, checked_times, first_row
from grazemap_core.simulation.start import (
    ForcedOscillator,
    Started,
    State,
    forced_oscillator,
    initial_state,
    longer_record,
    start,
    state_at,
    wrapped,
)
from grazemap_core.simulation.tolerances import MOST_RECORD_BYTES, RECORD_BLOCK, ROWS_OF_RESULT, TRANSIENT_EVENTS


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A recorded trajectory; time counts from the start of the recorded part."""

    time: Floats
    """(n,) Times of the samples."""
    displacement: Floats
    """(N, n) Displacements at these times."""
    velocity: Floats
    """(N, n) Velocities at these times."""
    impacts: Impacts
    """The impacts."""
    sticking: Sticking
    """The rests on a stop."""
    undecided: int
    """Number of events that round-off leaves undecided, from the start of the transient on: grazes, and moments at
    which the force on a resting contact is zero and may or may not release it (it is taken to stay)."""
    motion: Motion
    """Unresolved, with the reason, if the trajectory ended early; the arrays then end there too."""
    final: State | None
    """State at the end of the record, with the phase in (-pi/p, pi/p]: a trajectory from it continues this one. During
    the summed impacts before a rest it is the state at rest. None if the trajectory ended before the record began, or
    if a number is not finite."""
    record: Record
    """The events, from which all of this is derived."""
    divisor: int = 1
    """p: phases repeat after 2 pi/p."""

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return displacement and velocity, each (N, n), at any times (n,) of the record, in closed form.

        At the time of an impact the velocity is that after it.

        Raises
        ------
        ParameterError
            A time lies outside the record.
        """
        return self.record.at(times)


@dataclass(frozen=True, eq=False)
class Plan:
    """The recorded interval and the samples of a trajectory: the parameters of `trajectory` after the state.

    `most_events` follows from `most_bytes`, and is that of all trajectories of a list.
    """

    periods: int
    """As in `trajectory`."""
    transient_periods: int
    """As in `trajectory`."""
    samples_per_period: int
    """As in `trajectory`."""
    times: Floats | None
    """As in `trajectory`."""
    max_period: int
    """As in `trajectory`."""
    most_bytes: int
    """As in `trajectory`."""
    most_events: int
    """Follows from `most_bytes`, and is that of all trajectories of a list."""


@in_own_period
def trajectory(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    periods: int = 1,
    transient_periods: int = 0,
    samples_per_period: int = 200,
    max_period: int = 32,
    times: Floats | None = None,
    most_bytes: int = MOST_RECORD_BYTES,
) -> Trajectory:
    """Return a recorded trajectory: samples, impacts, sticking and motion.

    Parameters
    ----------
    omega : float
        Forcing frequency, > 0.
    clearance : float, or (float or None, float or None)
        Distance of both stops from q = 0, > 0; or of the right and the left one, None for an absent stop.
    displacement, velocity : (N,)
        State at t = 0, by default at rest in the static equilibrium.
    phase : float
        Forcing phase at t = 0, radians.
    periods, transient_periods : int
        Forcing periods that are recorded, and forcing periods before the record.
    samples_per_period : int
        Number of samples per forcing period, at equal intervals; both ends of the record are sampled.
    max_period : int
        Largest period of a motion that is looked for.
    times : (n,) or None
        Times of the samples, in the record, instead of equal intervals.
    most_bytes : int
        Maximum number of bytes of the impacts and rests in a result.

    Raises
    ------
    ParameterError
        A number is out of range, or the contact starts outside the stops.
    RecordSizeError
        The events take more than `most_bytes`.
    """
    forced = forced_oscillator(oscillator, omega, clearance)
    plan = _plan(forced, periods, transient_periods, samples_per_period, times, max_period, most_bytes)
    return _follow(forced, initial_state(forced, displacement, velocity, phase), plan, plan.most_events)


@in_own_period
def trajectories(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    states: Sequence[State],
    periods: int = 1,
    transient_periods: int = 0,
    samples_per_period: int = 200,
    max_period: int = 32,
    times: Floats | None = None,
    most_bytes: int = MOST_RECORD_BYTES,
) -> Iterator[Trajectory]:
    """Return an iterator of the trajectories from many states, each bitwise equal to that of `trajectory`.

    Parameters
    ----------
    states : sequence of State
        All of them are validated before the first trajectory is computed.

    Other parameters as in `trajectory`; `most_bytes` is that of all trajectories together.

    Raises
    ------
    ParameterError
        As `trajectory`; the name of a parameter of a state is, for example, states[3].velocity.
    RecordSizeError
        As `trajectory`, while the iterator is read.
    """
    forced = forced_oscillator(oscillator, omega, clearance)
    plan = _plan(forced, periods, transient_periods, samples_per_period, times, max_period, most_bytes)
    checked = [
        initial_state(forced, state.displacement, state.velocity, state.phase, f"states[{k}].")
        for k, state in enumerate(states)
    ]
    return _followed(forced, checked, plan)


def _followed(forced: ForcedOscillator, states: Sequence[State], plan: Plan) -> Iterator[Trajectory]:
    """Yield the recorded trajectories from states, which together have at most the events of the plan."""
    events = plan.most_events
    for state in states:
        trajectory = _follow(forced, state, plan, events)
        events -= len(trajectory.record.rows) - 1
        yield trajectory


def _plan(
    forced: ForcedOscillator,
    periods: int,
    transient_periods: int,
    samples_per_period: int,
    times: Floats | None,
    max_period: int,
    most_bytes: int,
) -> Plan:
    for name, value, minimum in (
        ("periods", periods, 1),
        ("transient_periods", transient_periods, 0),
        ("samples_per_period", samples_per_period, 1),
        ("max_period", max_period, 1),
    ):
        checked_order(name, value, minimum)
    if times is not None:
        times = checked_times(times, periods * (2.0 * math.pi / forced.omega))
    row_bytes = 8 * (EVENT_COLUMNS + 2 * forced.oscillator.size)
    events = min(most_bytes // EVENT_BYTES, ROWS_OF_RESULT * most_bytes // row_bytes)
    return Plan(periods, transient_periods, samples_per_period, times, max_period, most_bytes, events)


def _follow(forced: ForcedOscillator, state: State, plan: Plan, events: int) -> Trajectory:
    """Return the recorded trajectory from a state, which has at most a number of events. Raises RecordSizeError."""
    begun = start(forced, state)
    ring = period_detection.stroboscopic_history(forced.oscillator.size, plan.max_period)
    period_detection.record_half_period(ring, 0, begun.run)
    first_half, last_half = 2 * plan.transient_periods, 2 * (plan.transient_periods + plan.periods)
    done = 0
    if begun.status == OK:
        done = _run_transient(begun, first_half, ring)
    rows = first_row(begun.forced.free, begun.run, first_half)
    recorded = begun.status == OK
    if recorded:
        done = _run_record(begun, first_half, last_half, ring, events)
        if begun.status == RECORD_FULL or begun.run.cursor[EVENT_COUNT] > events:
            raise RecordSizeError(plan.most_events, plan.most_bytes)
        rows = np.concatenate([rows, begun.run.events[: begun.run.cursor[EVENT_COUNT]]])
        begun.run = begun.run._replace(events=np.empty((0, rows.shape[1])))  # they are in the rows

    period = 2.0 * math.pi / forced.omega
    end = plan.periods * period
    if not recorded:
        end = -math.inf
    elif begun.status != OK:
        # the trajectory ended with its last event, or at the start of the half period if none was recorded
        last = rows[-1]
        half, since = (last[HALF], last[TIME]) if len(rows) > 1 else (done, 0.0)
        end = float((half - first_half) * (0.5 * period) + since)
    shape = forced.structure.models.free.shape
    record = Record(begun.forced, shape, begun.steady, forced.equilibrium, begun.stops, rows, first_half, end)
    if plan.times is not None:
        time = plan.times if begun.status == OK else plan.times[plan.times <= end]
        x, v = record.at(time)
    else:
        count = plan.periods * plan.samples_per_period + 1 if recorded else 0
        index = np.arange(count, dtype=np.int64)
        time = np.asarray(index * (period / plan.samples_per_period), dtype=np.float64)
        if begun.status != OK:
            index, time = index[time <= end], time[time <= end]
        x, v = record.evenly(index, plan.samples_per_period)
    return Trajectory(
        time=time,
        displacement=x,
        velocity=v,
        impacts=record.impacts(),
        sticking=record.sticking(),
        undecided=int(begun.run.tally[UNDECIDED]),
        motion=_motion(begun, ring, done, plan.max_period),
        final=_final(forced, state, begun, rows) if recorded else None,
        record=record,
    )


def _run_transient(begun: Started, halves: int, ring: StroboscopicHistory) -> int:
    """Run the part that is not recorded, discarding its events, and return the number of half periods completed."""
    done, most = 0, TRANSIENT_EVENTS
    while done < halves and begun.status == OK:
        until = min(done + RECORD_BLOCK, halves)
        done = _run_record(begun, done, until, ring, most)
        while begun.status == RECORD_FULL:
            events, last = begun.run.events, int(begun.run.cursor[EVENT_COUNT]) - 1
            if last > 0:  # a graze may continue the last event
                events[0] = events[last]
                begun.run.cursor[EVENT_COUNT] = 1
            else:  # half a period has more
                most *= 4
            done = _run_record(begun, done, until, ring, most)
        begun.run.cursor[EVENT_COUNT] = 0
    return done


def _run_record(begun: Started, done: int, halves: int, ring: StroboscopicHistory, most: int) -> int:
    """Run to `halves` half periods, enlarging the record up to `most` events, and return the number completed."""
    while True:
        begun.status, done = run_recorded(begun.forced, begun.stops, begun.run, done, halves, ring)
        if begun.status != RECORD_FULL or len(begun.run.events) >= most:
            return done
        begun.run = longer_record(begun.run, most)


def _final(forced: ForcedOscillator, state: State, begun: Started, rows: Floats) -> State | None:
    """Return the state at the end of the record of a run."""
    phase = wrapped(state.phase)
    if begun.status == NOT_FINITE:
        return None
    if begun.status != OK:  # it ended at its last event
        half, time = int(rows[-1, HALF]), float(rows[-1, TIME])
        phase = wrapped(phase + half % 2 * math.pi + forced.omega * time)
        forced_part(begun.forced.free, begun.run.u, half, time, 1.0)
    return state_at(forced, begun.stops, begun.run, phase)


def _motion(begun: Started, ring: StroboscopicHistory, halves: int, max_period: int) -> Motion:
    """Return the motion at the end of a trajectory."""
    if begun.status != OK:
        return motion_from_codes(reason_of_end(begun.status), 0, 0, 0, False, False)
    problem, stops = begun.forced.free, begun.stops
    if hidden_by_rounding(problem.steady_bound, np.array([stops.unit]))[0]:
        return motion_from_codes(codes.HIDDEN_BY_ROUNDING, 0, 0, 0, False, False)
    reach = reach_from(problem, stops, begun.run.u, halves)
    if is_free_for_ever(problem, stops, reach, int(begun.run.cursor[ANCHOR])):
        return motion_from_codes(codes.RESOLVED, 1, -1, -1, stops.symmetric, False)
    reason, period, right, left, symmetric, _, sticking = period_detection.detect_period(
        problem, stops, ring, 0, halves, max_period, halves, reach
    )
    return motion_from_codes(reason, period, right, left, symmetric, sticking)
