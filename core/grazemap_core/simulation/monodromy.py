"""The linearised flow along a trajectory, and the monodromy matrix and Floquet multipliers of a periodic motion."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core import codes
from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.half_period import reason_of_end
from grazemap_core.contact.kernels.runs import EVENT_COUNT, OK, RECORD_FULL
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import LinearisationError, checked_order
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels.period_detection import motion_of_run, record_half_period, stroboscopic_history
from grazemap_core.simulation.kernels.tangent import GRAZED, run_half_linearised
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.start import Started, forced_oscillator, initial_state, longer_record, start
from grazemap_core.simulation.tolerances import CLOSING_FLOOR, ROUND_OFF_RETURNS


@dataclass(eq=False)
class LinearisedRun(Started):
    """A trajectory in progress with the linearised flow along it, half period by half period."""

    reference_at_start: Floats
    """(2 N,) Displacements, then velocities, of the reference motion at the start's phase, with the equilibrium."""

    @property
    def period(self) -> float:
        """Duration of a forcing period."""
        return self.forced.free.step * self.forced.free.cells

    @property
    def physical_state(self) -> Floats:
        """Displacements, then velocities, (2 N,); wrong except after a whole number of periods."""
        return np.asarray(self.forced.held.from_free @ self.run.u.ravel() + self.reference_at_start)

    def advance(self, halves: int, tangent: Floats) -> None:
        """Advance by a number of half periods; the linearised flow is applied to tangent (2 N, k) in place.

        Raises
        ------
        LinearisationError
            The trajectory ends early, or an impact is a graze.
        """
        for _ in range(halves):
            while True:
                self.status = run_half_linearised(self.forced, self.stops, self.run, self.halves, tangent, self.began)
                if self.status != RECORD_FULL:
                    break
                self.run = longer_record(self.run)
            self.require(self.status)
            self.halves += 1

    @staticmethod
    def require(status: int) -> None:
        """Raise LinearisationError with the reason of a status, unless it is OK."""
        if status == GRAZED:
            raise LinearisationError("an impact is a graze to within round-off, where the flow has no derivative")
        if status != OK:
            raise LinearisationError(REASONS[reason_of_end(status)])


def linearised_run(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    displacement: Floats | None,
    velocity: Floats | None,
    phase: float,
) -> LinearisedRun:
    """Return a run from the given initial state. Parameters as in `trajectories.trajectory`.

    Raises
    ------
    ParameterError
        A number is out of range, or the contact starts outside the stops.
    LinearisationError
        The contact starts at rest on a stop, and the motion of the held structure has no accurate closed form.
    """
    forced = forced_oscillator(oscillator, omega, clearance)
    begun = start(forced, initial_state(forced, displacement, velocity, phase))
    equilibrium = np.concatenate([forced.equilibrium, np.zeros(oscillator.size)])
    run = LinearisedRun(**vars(begun), reference_at_start=forced.structure.reference_state(phase) + equilibrium)
    run.require(run.status)
    run.run.cursor[EVENT_COUNT] = 0  # events of the start belong to no half period
    return run


@dataclass(frozen=True, eq=False)
class Monodromy:
    """The linearised flow over n forcing periods, at one point of a motion."""

    matrix: Floats
    """(2 N, 2 N) Maps a perturbation of (x_1 .. x_N, v_1 .. v_N) to that n periods later. The phase of the forcing is
    not perturbed, so no multiplier is 1 because of a shift in time."""
    multipliers: Complexes
    """(2 N,) Its eigenvalues, by decreasing modulus. Those below about 1e-15 of the norm of the matrix are
    round-off."""
    period: int
    """Number n of forcing periods."""
    time: float
    """Duration of n forcing periods."""
    phase: float
    """Forcing phase at which the matrix is taken, radians."""
    displacement: Floats
    """(N,) Displacements at which the matrix is taken."""
    velocity: Floats
    """(N,) Velocities there."""
    closing: float
    """Largest displacement, in units of the stops, between that state and the state n periods later. The eigenvalues
    are Floquet multipliers if this is round-off."""

    @property
    def exponent(self) -> float:
        """Largest Lyapunov exponent of the periodic motion, ln|multiplier|/time.

        Minus infinity if the matrix is zero: the motion is then superstable, and neighbouring motions join it exactly
        within a period, as for a single mass that rests on a stop.
        """
        largest = abs(self.multipliers[0])
        return math.log(largest) / self.time if largest > 0.0 else -math.inf


@in_own_period
def monodromy(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
    period: int | None = None,
    max_periods: int = 1000,
    max_period: int = 32,
) -> Monodromy:
    """Return the linearised flow over a period of a motion.

    Parameters
    ----------
    omega, clearance, displacement, velocity, phase
        As in `trajectories.trajectory`.
    period : int or None
        Forcing periods n; the given state is a point of the motion. None: the trajectory is followed until the period
        of the motion is detected and its orbit closes to round-off; n is its minimal period.
    max_periods, max_period : int
        Forcing periods followed, and largest period looked for, if `period` is None.

    Raises
    ------
    ParameterError
        A number is out of range.
    LinearisationError
        The trajectory ends early, an impact is a graze, or the motion did not settle to a periodic one.
    """
    for name, value in (("period", period), ("max_periods", max_periods), ("max_period", max_period)):
        if value is not None:
            checked_order(name, value, 1)
    run = linearised_run(oscillator, omega, clearance, displacement, velocity, phase)
    count = oscillator.size
    if period is None:
        period = _settle(run, max_periods, max_period)
    start, here = run.run.u.copy(), run.physical_state
    tangent = np.eye(2 * count)
    run.advance(2 * period, tangent)
    # eigenvalues are computed in the energy norm, in which all entries of the matrix have the same unit
    weight = np.stack([run.forced.free.frequency, np.ones(count)], axis=1).ravel()
    multipliers = np.linalg.eigvals(tangent * weight[:, None] / weight).astype(np.complex128)
    order = np.argsort(-np.abs(multipliers), kind="stable")
    return Monodromy(
        matrix=run.forced.held.from_free @ tangent @ run.forced.held.to_free,
        multipliers=multipliers[order],
        period=period,
        time=period * run.period,
        phase=phase,
        displacement=here[:count],
        velocity=here[count:],
        closing=_distance(run, start),
    )


def _distance(run: LinearisedRun, state: Floats) -> float:
    """Return the distance of the run from a state, in units of the stops."""
    return float(np.max(np.abs(run.run.u - state) * run.forced.free.displacement_scale)) / run.stops.unit


def _settle(run: LinearisedRun, max_periods: int, max_period: int) -> int:
    """Advance a run until its period is detected and it closes to round-off, and return the minimal period."""
    size = len(run.run.u)
    nothing = np.zeros((2 * size, 0))
    ring = stroboscopic_history(size, max_period)
    record_half_period(ring, 0, run.run)
    for _ in range(2 * max_periods):
        run.advance(1, nothing)
        record_half_period(ring, run.halves, run.run)
        motion = motion_of_run(run.forced.free, run.stops, ring, run.run, run.halves, max_period)
        if motion.reason == codes.RESOLVED and run.halves % 2 == 0:
            break
    else:
        raise LinearisationError(REASONS[motion.reason if motion.reason != codes.RESOLVED else codes.NOT_CLOSED])
    # until returns are small and have not decreased for some periods
    best, waited = np.inf, 0
    for _ in range(max_periods // motion.period):
        before = run.run.u.copy()
        run.advance(2 * motion.period, nothing)
        distance = _distance(run, before)
        waited = waited + 1 if distance >= best else 0
        best = min(best, distance)
        if distance == 0.0 or (best < CLOSING_FLOOR and waited >= ROUND_OFF_RETURNS):
            break
    return motion.period
