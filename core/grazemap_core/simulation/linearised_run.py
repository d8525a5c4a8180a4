"""A trajectory that carries changes of its state along: what monodromy matrices and Lyapunov exponents are made from.

Numbers as a person gives them flow in; a run that can be taken on, half period by half period, flows out. It owns the
arrays of the kernels and makes the record of events longer when a half period needs it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.half_period import reason_of_end
from grazemap_core.contact.kernels.sticking_flow import HeldProblem
from grazemap_core.contact.kernels.workspace import OK, RECORD_FULL, ROWS, Workspace
from grazemap_core.errors import LinearisationError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.tangent import GRAZED, HalfPeriod, half_period, run_half_linearised
from grazemap_core.simulation.motion import REASONS
from grazemap_core.simulation.start import forced_chain, initial_state, longer_record, start


@dataclass(eq=False)
class LinearisedRun:
    """A trajectory in progress; `state` and the arrays of the kernels change as it goes on.

    Attributes
    ----------
    problem, held : CellProblem, HeldProblem
        The oscillator as the kernels read it.
    state : (N, 2)
        Where the run stands, in block coordinates and less the steady motion.
    steady : (2 N,)
        Displacements, then velocities, of the steady motion at the phase of the start.
    clearance : float
    halves : int
        Half periods done.
    work : Workspace
    began : HalfPeriod
    """

    problem: CellProblem
    held: HeldProblem
    state: Floats
    steady: Floats
    clearance: float
    halves: int
    work: Workspace
    began: HalfPeriod

    @property
    def period(self) -> float:
        """Time of a forcing period."""
        return self.problem.step * self.problem.cells

    @property
    def physical(self) -> Floats:
        """Displacements, then velocities, (2 N,), after a whole number of periods."""
        return np.asarray(self.held.from_free @ self.state.ravel() + self.steady)

    def advance(self, halves: int, tangent: Floats) -> None:
        """Go on for so many half periods, carrying the columns of tangent (2 N, k) along in place.

        Raises
        ------
        LinearisationError
        """
        for _ in range(halves):
            while True:
                status = run_half_linearised(
                    self.problem, self.held, self.state, self.clearance, self.halves, self.work, tangent, self.began
                )
                if status != RECORD_FULL:
                    break
                self.grow_record()
            self.require(status)
            self.halves += 1

    def grow_record(self) -> None:
        """Make room for four times as many events in half a period."""
        self.work = longer_record(self.work)

    @staticmethod
    def require(status: int) -> None:
        """Raise what a status stands for, unless it is OK.

        Raises
        ------
        LinearisationError
        """
        if status == GRAZED:
            raise LinearisationError("an impact is a graze to within round-off: the flow has no derivative there")
        if status != OK:
            raise LinearisationError(REASONS[reason_of_end(status)])


def linearised_run(
    oscillator: Oscillator,
    omega: float,
    clearance: float,
    displacement: Floats | None,
    velocity: Floats | None,
    phase: float,
) -> LinearisedRun:
    """Check a start and return the run that stands there. Parameters as in `trajectory.trajectory`.

    A start on a stop and moving into it is behind that impact: changes of it are changes of what follows.

    Raises
    ------
    ParameterError
        A number is out of range, or mass 1 starts outside the stops.
    LinearisationError
        Mass 1 rests on a stop, and the chain behind it has no closed form that keeps its digits.
    """
    chain = forced_chain(oscillator, omega, clearance)
    begun = start(chain, initial_state(chain, displacement, velocity, phase))
    run = LinearisedRun(
        problem=begun.problem,
        held=begun.held,
        state=begun.u,
        steady=np.concatenate([begun.steady.imag, omega * begun.steady.real]),
        clearance=clearance,
        halves=0,
        work=begun.work,
        began=half_period(oscillator.size),
    )
    run.require(begun.status)
    run.work.cursor[ROWS] = 0
    return run
