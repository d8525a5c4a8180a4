"""The record of a trajectory: its events with the states after them, and the results derived from them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.kernels import runs
from grazemap_core.contact.kernels.cells import Forced
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.errors import ParameterError
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels.recorded_run import Moments, events_before, sample_motion, split_times
from grazemap_core.simulation.tolerances import END_ROUNDING


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of a trajectory.

    To avoid the rounding of long times, each time is also given as a number of forcing periods and a time within the
    last one.
    """

    time: Floats
    """(n,) Time since the start of the record."""
    period: Integers
    """(n,) Number of forcing periods since the start of the record."""
    phase_time: Floats
    """(n,) Time since the start of that period."""
    stop: NDArray[np.int8]
    """(n,) +1 right or -1 left."""
    velocity: Floats
    """(n,) Signed velocity before the impact."""
    kind: NDArray[np.str_]
    """(n,) "impact"; "chatter": infinitely many impacts follow until the start of the next interval of sticking, and
    are not listed; or "graze": the contact comes so near the stop that round-off hides whether it touches it. A graze
    is taken as a touch at zero velocity, which changes nothing."""


EVENT_BYTES = 4 * 8 + 1 + 4 * len("chatter")
"""Bytes of an impact in a result; a rest and its release together take less."""


@dataclass(frozen=True, eq=False)
class Sticking:
    """Intervals at rest on a stop."""

    start: Floats
    """(n,) Where the impacts of a complete chatter accumulate, at the impact itself if the restitution is 0, or the
    start of the record."""
    stop_time: Floats
    """(n,) The release, or the end of the record."""
    stop: NDArray[np.int8]
    """(n,) +1 right or -1 left."""


@dataclass(frozen=True, eq=False)
class Record:
    """The events of a trajectory; time counts from the start of the record."""

    forced: Forced
    """The structure under its forces, for the kernels."""
    shape: Floats
    """(N, N, 2) As in `ModalModel`."""
    steady: Complexes
    """(H, 2, N + 1) From `reference_response`, the initial phase included."""
    equilibrium: Floats
    """(N,) Static displacements, from which the kernels measure."""
    stops: Stops
    """The stops."""
    rows: Floats
    """(1 + events, EVENT_COLUMNS + 2 N) Start of the record, then every event, as in `recorded_run.sample_motion`."""
    first_half: int
    """The half period with which the record begins, even."""
    end: float
    """Duration of the record; minus infinity if the trajectory ended before the record began."""

    @property
    def period(self) -> float:
        """Duration of a forcing period."""
        return 2.0 * math.pi / self.forced.free.omega

    @property
    def event_time(self) -> Floats:
        """Times of the rows, (1 + events,)."""
        return (self.rows[:, runs.HALF] - self.first_half) * (0.5 * self.period) + self.rows[:, runs.TIME]

    def impacts(self) -> Impacts:
        """Return the impacts among the events."""
        rows, time = self.rows[1:], self.event_time[1:]
        there = rows[:, runs.KIND] != runs.RELEASE
        half = rows[there, runs.HALF].astype(np.int64) - self.first_half
        return Impacts(
            time=time[there],
            period=half // 2,
            phase_time=(half % 2) * (0.5 * self.period) + rows[there, runs.TIME],
            stop=rows[there, runs.STOP].astype(np.int8),
            velocity=rows[there, runs.VELOCITY],
            kind=np.select(
                [rows[there, runs.KIND] == runs.CHATTER, rows[there, runs.KIND] == runs.GRAZE],
                ["chatter", "graze"],
                "impact",
            ),
        )

    def sticking(self) -> Sticking:
        """Return the intervals of rest.

        A contact that is released in the moment in which it would come to rest has none.
        """
        rows = self.rows
        start = self.event_time + rows[:, runs.DELAY]
        until = np.append(self.event_time[1:], self.end)  # the event after a rest is its release
        ends = np.append(rows[1:, runs.KIND] == runs.RELEASE, False)
        begins = runs.rests(rows[:, runs.KIND]) & (start <= self.end) & ~(ends & (until <= start))
        return Sticking(
            start=start[begins],
            stop_time=until[begins],
            stop=rows[begins, runs.STOP].astype(np.int8),
        )

    def evenly(self, index: Integers, samples_per_period: int) -> tuple[Floats, Floats]:
        """Return displacement and velocity, each (N, n), at increasing multiples of 1/n of the forcing period."""
        part = index % samples_per_period  # of its forcing period
        half = self.first_half + 2 * (index // samples_per_period)
        half_time = math.pi / self.forced.free.omega
        within = 2.0 * half_time * part / samples_per_period
        row = events_before(self.rows, half, within, half_time)
        return self._sampled(row, half, within, 2.0 * math.pi * part / samples_per_period)

    def at(self, times: Floats) -> tuple[Floats, Floats]:
        """Return displacement and velocity, each (N, n), at times (n,) in any order.

        Raises
        ------
        ParameterError
            A time lies outside the record, or the times are not a list of numbers.
        """
        times = checked_times(times, self.end)
        whole, within = split_times(times, self.forced.free.omega)
        # compared with the rounded times that users see: a sample at the time of an impact shows the state after it
        row = np.searchsorted(self.event_time[1:], times, side="right").astype(np.int64)
        return self._sampled(row, self.first_half + 2 * whole, within, self.forced.free.omega * within)

    def _sampled(self, row: Integers, half: Integers, within: Floats, angle: Floats) -> tuple[Floats, Floats]:
        moments = Moments(row, half, within, angle)
        x, v = sample_motion(self.forced, self.shape, self.steady, self.rows, self.stops, moments)
        return x + self.equilibrium[:, None], v


def checked_times(times: Floats, end: float) -> Floats:
    """Return times of a record as a new array. Raises ParameterError unless they are numbers from 0 to its end."""
    values = np.array(times, dtype=np.float64)
    if values.ndim != 1 or not np.all((values >= 0.0) & (values <= end * END_ROUNDING)):
        raise ParameterError("times", "must be a list of numbers from 0 to the end of the record")
    return values
