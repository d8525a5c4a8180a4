"""A trajectory with the linearised flow along it, from which monodromy matrices and Lyapunov exponents are computed.

A run advances by half periods. It owns the arrays of the kernels and enlarges the record of events when necessary.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import Forced
from grazemap_core.contact.kernels.half_period import reason_of_end
from grazemap_core.contact.kernels.runs import EVENT_COUNT, OK, RECORD_FULL, Run
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import LinearisationError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels.recorded_run import HalfPeriod, half_period
from grazemap_core.simulation.kernels.tangent import GRAZED, run_half_linearised
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.start import forced_oscillator, initial_state, longer_record, start


@dataclass(eq=False)
class LinearisedRun:
    """A trajectory in progress; `advance` changes `run`."""

    forced: Forced
    """The structure under its forces from the initial phase on, for the kernels."""
    reference_at_start: Floats
    """(2 N,) Displacements, then velocities, of the reference motion at the start's phase, with the equilibrium."""
    stops: Stops
    """The stops."""
    halves: int
    """Number of half periods completed."""
    run: Run
    """The trajectory."""
    began: HalfPeriod
    """Copy of the state at the start of the half period, which is run again if the record of events was too short."""

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
                status = run_half_linearised(self.forced, self.stops, self.run, self.halves, tangent, self.began)
                if status != RECORD_FULL:
                    break
                self.run = longer_record(self.run)
            self.require(status)
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

    If the contact starts on a stop and moves into it, the run starts after that impact.

    Raises
    ------
    ParameterError
        A number is out of range, or the contact starts outside the stops.
    LinearisationError
        The contact starts at rest on a stop, and the motion of the held structure has no accurate closed form.
    """
    forced = forced_oscillator(oscillator, omega, clearance)
    begun = start(forced, initial_state(forced, displacement, velocity, phase))
    run = LinearisedRun(
        forced=begun.forced,
        reference_at_start=forced.structure.reference_state(phase)
        + np.concatenate([forced.equilibrium, np.zeros(oscillator.size)]),
        stops=begun.stops,
        halves=0,
        run=begun.run,
        began=half_period(oscillator.size),
    )
    run.require(begun.status)
    run.run.cursor[EVENT_COUNT] = 0  # events of the start belong to no half period
    return run
