"""The monodromy matrix and Floquet multipliers of a periodic motion."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core import codes
from grazemap_core.arrays import Complexes, Floats
from grazemap_core.checks import checked_order
from grazemap_core.contact.kernels.cells import reach_from
from grazemap_core.contact.kernels.half_period import is_free_for_ever
from grazemap_core.contact.kernels.runs import ANCHOR
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import LinearisationError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels import period_detection
from grazemap_core.simulation.linearised_run import LinearisedRun, linearised_run
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.tolerances import CLOSING_FLOOR, ROUND_OFF_RETURNS


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
    problem, stops, size = run.forced.free, run.stops, len(run.run.u)
    nothing = np.zeros((2 * size, 0))
    ring = period_detection.stroboscopic_history(size, max_period)
    period_detection.record_half_period(ring, 0, run.run)
    reason, period = codes.NOT_CLOSED, 0
    for _ in range(2 * max_periods):
        run.advance(1, nothing)
        period_detection.record_half_period(ring, run.halves, run.run)
        reach = reach_from(problem, stops, run.run.u, run.halves)
        if is_free_for_ever(problem, stops, reach, int(run.run.cursor[ANCHOR])):
            reason, period = codes.RESOLVED, 1
        else:
            halves = run.halves
            reason, period, *_ = period_detection.detect_period(
                problem, stops, ring, 0, halves, max_period, halves, reach
            )
        if reason == codes.RESOLVED and run.halves % 2 == 0:
            break
    else:
        raise LinearisationError(REASONS[reason] if reason != codes.RESOLVED else REASONS[codes.NOT_CLOSED])
    # until returns are small and have not decreased for some periods
    best, waited = np.inf, 0
    for _ in range(max_periods // period):
        before = run.run.u.copy()
        run.advance(2 * period, nothing)
        distance = _distance(run, before)
        waited = waited + 1 if distance >= best else 0
        best = min(best, distance)
        if distance == 0.0 or (best < CLOSING_FLOOR and waited >= ROUND_OFF_RETURNS):
            break
    return period
