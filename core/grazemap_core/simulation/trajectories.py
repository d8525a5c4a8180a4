"""Recorded trajectories: all impacts and intervals of sticking, samples in closed form, and the motion at the end."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grazemap_core import codes
from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import forced_part
from grazemap_core.contact.kernels.half_period import reason_of_end
from grazemap_core.contact.kernels.runs import (
    EVENT_COLUMNS,
    EVENT_COUNT,
    HALF,
    NOT_FINITE,
    OK,
    RECORD_FULL,
    TIME,
    UNDECIDED,
    write_start,
)
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import RecordSizeError, checked_order
from grazemap_core.model.harmonic_response import hidden_by_rounding
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels import period_detection
from grazemap_core.simulation.kernels.period_detection import StroboscopicHistory
from grazemap_core.simulation.kernels.recorded_run import run_recorded
from grazemap_core.simulation.motion import Motion, motion_of, unresolved
from grazemap_core.simulation.record import EVENT_BYTES, Impacts, Record, Sticking, checked_times
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
    """State at the end of the record, with the phase in [-pi/p, pi/p]: a trajectory from it continues this one. During
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
    recorder = _Recorder(forced, periods, transient_periods, samples_per_period, max_period, times, most_bytes)
    return recorder.follow(initial_state(forced, displacement, velocity, phase))


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
    recorder = _Recorder(forced, periods, transient_periods, samples_per_period, max_period, times, most_bytes)
    checked = [
        initial_state(forced, state.displacement, state.velocity, state.phase, f"states[{k}].")
        for k, state in enumerate(states)
    ]
    return map(recorder.follow, checked)


class _Recorder:
    """Follows trajectories of one oscillator, which together have a maximum number of events."""

    def __init__(
        self,
        forced: ForcedOscillator,
        periods: int,
        transient_periods: int,
        samples_per_period: int,
        max_period: int,
        times: Floats | None,
        most_bytes: int,
    ) -> None:
        """Check the numbers; they are those of `trajectory`."""
        for name, value, minimum in (
            ("periods", periods, 1),
            ("transient_periods", transient_periods, 0),
            ("samples_per_period", samples_per_period, 1),
            ("max_period", max_period, 1),
        ):
            checked_order(name, value, minimum)
        self._forced, self._period = forced, 2.0 * math.pi / forced.omega
        self._end = periods * self._period
        self._first_half, self._last_half = 2 * transient_periods, 2 * (transient_periods + periods)
        self._max_period = max_period
        self._samples, self._samples_per_period = periods * samples_per_period + 1, samples_per_period
        self._times = None if times is None else checked_times(times, self._end)
        row_bytes = 8 * (EVENT_COLUMNS + 2 * forced.oscillator.size)
        self._most_bytes = most_bytes
        self._most_events = min(most_bytes // EVENT_BYTES, ROWS_OF_RESULT * most_bytes // row_bytes)
        self._events_left = self._most_events

    def follow(self, state: State) -> Trajectory:
        """Return the recorded trajectory from a state. Raises RecordSizeError."""
        forced, first_half = self._forced, self._first_half
        begun = start(forced, state)
        ring = period_detection.stroboscopic_history(forced.oscillator.size, self._max_period)
        period_detection.record_half_period(ring, 0, begun.run)
        if begun.status == OK:
            _run_transient(begun, first_half, ring)
        rows = np.empty((1, begun.run.events.shape[1]))
        write_start(rows[0], begun.run, first_half, 0.5 * begun.forced.free.cells * begun.forced.free.step)
        recorded = begun.status == OK
        if recorded:
            _run_record(begun, self._last_half, ring, self._events_left)
            if begun.status == RECORD_FULL or begun.run.cursor[EVENT_COUNT] > self._events_left:
                raise RecordSizeError(self._most_events, self._most_bytes)
            rows = np.concatenate([rows, begun.run.events[: begun.run.cursor[EVENT_COUNT]]])
            begun.run = begun.run._replace(events=np.empty((0, rows.shape[1])))  # they are in the rows
        self._events_left -= len(rows) - 1

        end = self._end
        if not recorded:
            end = -math.inf
        elif begun.status != OK:
            # the trajectory ended with its last event, or at the start of the half period if none was recorded
            half, since = (rows[-1, HALF], rows[-1, TIME]) if len(rows) > 1 else (begun.halves, 0.0)
            end = float((half - first_half) * (0.5 * self._period) + since)
        shape = forced.structure.models.free.shape
        record = Record(begun.forced, shape, begun.steady, forced.equilibrium, begun.stops, rows, first_half, end)
        if self._times is not None:
            time = self._times if begun.status == OK else self._times[self._times <= end]
            x, v = record.at(time)
        else:
            index = np.arange(self._samples if recorded else 0, dtype=np.int64)
            time = np.asarray(index * (self._period / self._samples_per_period), dtype=np.float64)
            if begun.status != OK:
                index, time = index[time <= end], time[time <= end]
            x, v = record.evenly(index, self._samples_per_period)
        return Trajectory(
            time=time,
            displacement=x,
            velocity=v,
            impacts=record.impacts(),
            sticking=record.sticking(),
            undecided=int(begun.run.tally[UNDECIDED]),
            motion=_motion(begun, ring, self._max_period),
            final=_final(forced, state, begun, rows) if recorded else None,
            record=record,
        )


def _run_transient(begun: Started, halves: int, ring: StroboscopicHistory) -> None:
    """Run the part that is not recorded, up to `halves` half periods, discarding its events."""
    most = TRANSIENT_EVENTS
    while begun.halves < halves and begun.status == OK:
        until = min(begun.halves + RECORD_BLOCK, halves)
        _run_record(begun, until, ring, most)
        while begun.status == RECORD_FULL:
            events, last = begun.run.events, int(begun.run.cursor[EVENT_COUNT]) - 1
            if last > 0:  # a graze may continue the last event
                events[0] = events[last]
                begun.run.cursor[EVENT_COUNT] = 1
            else:  # half a period has more
                most *= 4
            _run_record(begun, until, ring, most)
        begun.run.cursor[EVENT_COUNT] = 0


def _run_record(begun: Started, halves: int, ring: StroboscopicHistory, most: int) -> None:
    """Run to `halves` half periods, enlarging the record up to `most` events."""
    while True:
        begun.status, begun.halves = run_recorded(
            begun.forced, begun.stops, begun.run, begun.began, begun.halves, halves, ring
        )
        if begun.status != RECORD_FULL or len(begun.run.events) >= most:
            return
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


def _motion(begun: Started, ring: StroboscopicHistory, max_period: int) -> Motion:
    """Return the motion at the end of a trajectory."""
    if begun.status != OK:
        return unresolved(reason_of_end(begun.status))
    problem, stops = begun.forced.free, begun.stops
    if hidden_by_rounding(problem.steady_bound, np.array([stops.unit]))[0]:
        return unresolved(codes.HIDDEN_BY_ROUNDING)
    return motion_of(period_detection.motion_of_run(problem, stops, ring, begun.run, begun.halves, max_period))
