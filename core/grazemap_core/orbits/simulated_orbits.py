"""Periodic motions with rests on a stop or complete chatter, found by simulation.

Such a motion is not a finite sequence of impacts, so there are no equations of impact to solve. A trajectory that has
settled to it is followed until it closes to round-off. Its events over one period and the Floquet multipliers of the
tangent flow are returned. The orbit is not verified.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import ClassVar

import numpy as np

from grazemap_core.arrays import Complexes
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import LinearisationError, ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.motion import Motion
from grazemap_core.simulation.record import Impacts, Record, Sticking
from grazemap_core.simulation.start import State
from grazemap_core.simulation.trajectories import Trajectory, trajectory

FOUND_BY_SIMULATION = (
    "found by simulation, not from equations of impact: the contact rests on a stop; the multipliers are those of the "
    "linearised flow, and the residual is the distance between the start and the state a period later, in units of the "
    "distance of the stops"
)
"""Why the orbit is not verified."""


@dataclass(frozen=True, eq=False)
class SimulatedOrbit:
    """A periodic motion that rests on a stop, found by simulation."""

    omega: float
    """Forcing frequency."""
    clearance: Clearance
    """Clearances of the stops."""
    motion: Motion
    """Name of the motion; not verified, and `reason` says why."""
    start: State
    """State at forcing phase 0."""
    impacts: Impacts
    """Impacts of one period from `start`. A complete chatter has only the impacts that were computed one by one, the
    last with `kind` "chatter"; their number is not a property of the motion."""
    sticking: Sticking
    """Rests of one period from `start`; a rest that continues beyond its end is two intervals."""
    multipliers: Complexes
    """(2 N,) Floquet multipliers of the tangent flow, by decreasing modulus. A rest makes two of them 0, to
    round-off."""
    closing: float
    """Largest displacement, in units of the stops, between the start and the state a period later."""
    record: Record
    """The events of one period from `start`."""

    isolated: ClassVar[bool] = False
    """There are no equations of impact to which the Newton-Kantorovich theorem could be applied."""
    admissible: ClassVar[bool] = True
    """The simulation follows every contact: `impacts` and `sticking` are all of them."""
    verified: ClassVar[bool] = False
    """The orbit is not shown to be isolated."""

    @property
    def stable(self) -> bool:
        """Every multiplier has a modulus below 1."""
        return bool(np.all(np.abs(self.multipliers) < 1.0))


@in_own_period
def simulated_orbit(
    oscillator: Oscillator, omega: float, clearance: Clearance, run: Trajectory, max_period: int = 32
) -> SimulatedOrbit:
    """Return the motion with rests that a trajectory has settled to.

    Parameters
    ----------
    oscillator, omega, clearance
        Parameters of the trajectory.
    run : Trajectory
        Named as a periodic motion.
    max_period : int
        Longest period that is searched for.

    Raises
    ------
    ParameterError
        The trajectory has not settled to a periodic motion that rests on a stop.
    LinearisationError
        An impact is a graze, at which the flow has no derivative, or the motion does not close to round-off.
    """
    motion, final = run.motion, run.final
    if motion.kind != "periodic" or motion.period is None or not motion.sticking or final is None:
        raise ParameterError("trajectory", "has not settled to a periodic motion that rests on a stop")
    once = trajectory(
        oscillator,
        omega,
        clearance,
        final.displacement,
        final.velocity,
        final.phase,
        periods=motion.period,
        samples_per_period=1,
    )
    time = _in_flight(once, motion.period * (2.0 * math.pi / omega))
    x, v = once.at(np.array([time]))
    settled = monodromy(
        oscillator, omega, clearance, x[:, 0], v[:, 0], final.phase + omega * time, max_period=max_period
    )
    if settled.period != motion.period:
        raise LinearisationError("the motion has another period when it is followed until it closes to round-off")
    until = math.fmod(-settled.phase, 2.0 * math.pi) / omega
    section = np.array([until if until >= 0.0 else until + 2.0 * math.pi / omega])
    ahead = trajectory(
        oscillator, omega, clearance, settled.displacement, settled.velocity, settled.phase, periods=2, times=section
    )
    start = State(ahead.displacement[:, 0], ahead.velocity[:, 0], 0.0)
    period = trajectory(
        oscillator,
        omega,
        clearance,
        start.displacement,
        start.velocity,
        0.0,
        periods=settled.period,
        samples_per_period=1,
    )
    return SimulatedOrbit(
        omega=omega,
        clearance=clearance,
        motion=replace(motion, reason=FOUND_BY_SIMULATION),
        start=start,
        impacts=period.impacts,
        sticking=period.sticking,
        multipliers=settled.multipliers,
        closing=settled.closing,
        record=period.record,
    )


def _in_flight(run: Trajectory, end: float) -> float:
    """Return the middle of the longest time of a record without an impact or a rest on a stop."""
    marks = np.sort(np.concatenate([[0.0, end], run.impacts.time, run.sticking.start, run.sticking.stop_time]))
    middles, lengths = 0.5 * (marks[1:] + marks[:-1]), np.diff(marks)
    starts, stops = run.sticking.start[:, None], run.sticking.stop_time[:, None]
    resting = np.any((starts < middles) & (middles < stops), axis=0)
    # the other impacts of a chatter lie between the last one recorded and the rest
    chatters = run.impacts.time[run.impacts.kind == "chatter"]
    resting |= np.isin(marks[:-1], chatters)
    if np.all(resting):
        raise ParameterError("trajectory", "rests on a stop for ever")
    return float(middles[np.argmax(np.where(resting, -1.0, lengths))])
