"""Sequences of impacts: the stops, forcing phases and velocities of the impacts of one period.

A sequence identifies a periodic motion and is the guess from which Newton's method starts. It is taken from a
trajectory that has settled, or given by the user.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.tolerances import SAME_ORBIT
from grazemap_core.records import dataclass
from grazemap_core.simulation.trajectories import Trajectory


@dataclass(frozen=True, eq=False)
class ImpactSequence:
    """The impacts of one period of a motion, in order. Build it with `create`, which checks the numbers."""

    period: int
    """n, forcing periods."""
    stops: Integers
    """(k,) +1 (right stop) or -1 (left)."""
    phases: Floats
    """(k,) ``omega t`` with the forcing ``f sin(omega t)``, radians, increasing, the first in [0, 2 pi n)."""
    velocities: Floats
    """(k,) Velocity of the contact before the impact. It has the sign of the stop; for a virtual impact, the opposite
    sign."""
    symmetric: bool = False
    """Whether these are the impacts of half the period; those of the other half are their mirror images."""
    divisor: int = 1
    """p: a period is ``2 pi/p`` in the phases."""

    @classmethod
    def create(
        cls,
        period: int,
        stops: Sequence[int] | Integers,
        phases: Sequence[float] | Floats,
        velocities: Sequence[float] | Floats,
        symmetric: bool = False,
    ) -> ImpactSequence:
        """Check the numbers and return the sequence, its first phase brought into [0, 2 pi n).

        Raises
        ------
        ParameterError
            There are no impacts; the numbers of stops, phases and velocities differ; a stop is not 1 or -1; phases do
            not increase, or span a period (half of it for symmetric motions); the period is below 1, or even for a
            symmetric motion.
        """
        checked_order("period", period, 1)
        if symmetric and period % 2 == 0:
            raise ParameterError("period", "must be odd for symmetric motions")
        which = np.array(stops)
        if which.ndim != 1 or which.size == 0:
            raise ParameterError("stops", "must be a list of at least one stop")
        if not np.all(np.isin(which, (1, -1))):
            raise ParameterError("stops", "every stop must be 1 or -1")
        numbers = []
        for name, values in (("phases", phases), ("velocities", velocities)):
            array = np.array(values, dtype=np.float64)
            if array.shape != which.shape or not np.all(np.isfinite(array)):
                raise ParameterError(name, "must be a list of finite numbers, one per stop")
            numbers.append(array)
        times, speeds = numbers
        whole = 2.0 * math.pi * period
        turn = 0.5 * whole if symmetric else whole
        if not (np.all(np.diff(times) > 0.0) and times[-1] - times[0] < turn):
            raise ParameterError("phases", "must increase, and span less than the time after which impacts repeat")
        shift = math.floor(times[0] / whole) * whole
        return cls(period, which.astype(np.int64), times - shift, speeds, symmetric)

    @property
    def turn(self) -> float:
        """Phase after which the impacts repeat, or repeat on the opposite stops."""
        return (self.period if self.symmetric else 2 * self.period) * math.pi / self.divisor

    @property
    def whole(self) -> ImpactSequence:
        """The impacts of the whole period; of a symmetric motion, the mirror images included."""
        if not self.symmetric:
            return self
        return replace(
            self,
            stops=np.concatenate([self.stops, -self.stops]),
            phases=np.concatenate([self.phases, self.phases + self.turn]),
            velocities=np.concatenate([self.velocities, -self.velocities]),
            symmetric=False,
        )

    def repeats_after(self, tolerance: float = SAME_ORBIT) -> int:
        """Return the minimum period of the sequence, in forcing periods: `period`, or a divisor of it."""
        whole = self.whole
        for period in range(1, self.period):
            parts, rest = divmod(self.period, period)
            if rest or len(whole.stops) % parts:
                continue
            if _repeats(whole, len(whole.stops) // parts, period, 1, tolerance):
                return period
        return self.period

    def mirrors(self, tolerance: float = SAME_ORBIT) -> bool:
        """Return whether the second half of the motion is the mirror image of the first."""
        if self.symmetric:
            return True
        count = len(self.stops)
        odd = self.period % 2 == 1 and count % 2 == 0
        return odd and _repeats(self, count // 2, 0.5 * self.period, -1, tolerance)

    def half(self) -> ImpactSequence:
        """Return half of a motion that is its own mirror image."""
        if self.symmetric:
            return self
        count = len(self.stops) // 2
        return replace(
            self,
            stops=self.stops[:count],
            phases=self.phases[:count],
            velocities=self.velocities[:count],
            symmetric=True,
        )


def _repeats(sequence: ImpactSequence, count: int, periods: float, sign: int, tolerance: float) -> bool:
    """Return whether the impacts repeat after `count` impacts and `periods` forcing periods, mirrored for sign -1."""
    once, turn = 2.0 * math.pi / sequence.divisor, sequence.turn
    later = np.roll(sequence.phases, -count)
    later[len(later) - count :] += turn
    speed = np.max(np.abs(sequence.velocities))
    return bool(
        np.all(np.roll(sequence.stops, -count) == sign * sequence.stops)
        and np.all(np.abs(later - sequence.phases - once * periods) <= tolerance * turn)
        and np.all(np.abs(np.roll(sequence.velocities, -count) - sign * sequence.velocities) <= tolerance * speed)
    )


@in_own_period
def impacts_of(run: Trajectory) -> ImpactSequence:
    """Return the impacts of the last period of a trajectory that has settled to a periodic motion.

    Raises
    ------
    ParameterError
        The motion is not periodic, has no impacts, or has chatter, rests or grazes; or the record is too short.
    """
    motion = run.motion
    if motion.kind != "periodic" or motion.period is None or run.final is None:
        raise ParameterError("trajectory", "has not settled to a periodic motion")
    if motion.sticking or np.any(run.impacts.kind != "impact"):
        raise ParameterError("trajectory", "has chatter, rest or grazes, so there is no sequence of impacts")
    record, period = run.record, motion.period
    length = record.period
    periods = round(record.end / length)
    if periods < period:
        raise ParameterError("trajectory", "must be recorded for a period of its motion")
    chosen = run.impacts.period >= periods - period
    if not np.any(chosen):
        raise ParameterError("trajectory", "has settled to a motion without impacts")
    # whole forcing periods leave the phase as it was
    phases = run.final.phase + (run.impacts.period[chosen] - (periods - period)) * (2.0 * math.pi)
    phases = phases + record.forced.free.omega * run.impacts.phase_time[chosen]
    velocities = run.impacts.velocity[chosen]
    sequence = ImpactSequence.create(period, run.impacts.stop[chosen].astype(np.int64), phases, velocities)
    return sequence.half() if motion.symmetric and sequence.mirrors() else sequence
