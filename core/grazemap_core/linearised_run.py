"""A trajectory that carries changes of its state along: what monodromy matrices and Lyapunov exponents are made from.

Numbers as a person gives them flow in; a run that can be taken on, half period by half period, flows out. It owns the
arrays of the kernels and makes the record of events longer when a half period needs it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from grazemap_core.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.errors import LinearisationError, ParameterError
from grazemap_core.kernels.cells import CellProblem
from grazemap_core.kernels.held import HeldProblem
from grazemap_core.kernels.simulate import RECORD_FULL, reason_of_end
from grazemap_core.kernels.tangent import GRAZED, HalfPeriod, half_period, run_half_linearised
from grazemap_core.kernels.workspace import OK, ROWS, Workspace, workspace
from grazemap_core.motion import REASONS
from grazemap_core.oscillator import Floats, Oscillator
from grazemap_core.steady import forced_response
from grazemap_core.tolerances import LARGEST_NUMBER, LEAST_NUMBER
from grazemap_core.trajectory import _start, _state


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
        rows, columns = self.work.events.shape
        self.work = self.work._replace(events=np.zeros((4 * rows, columns)))

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
    for name, value in (("omega", omega), ("clearance", clearance)):
        if not LEAST_NUMBER <= value <= LARGEST_NUMBER:
            raise ParameterError(name, f"must lie between {LEAST_NUMBER:g} and {LARGEST_NUMBER:g}")
    if not math.isfinite(phase):
        raise ParameterError("phase", "must be finite")
    x = _state("displacement", displacement, oscillator.size)
    v = _state("velocity", velocity, oscillator.size)
    if abs(x[0]) > clearance:
        raise ParameterError("displacement", "mass 1 starts outside the stops")
    models = trajectory_models(oscillator)
    steady = forced_response(oscillator, np.array([omega]))[0]
    problem, held = cell_problem(models, steady, omega, phase)
    turned = steady * np.exp(1j * phase)
    run = LinearisedRun(
        problem=problem,
        held=held,
        state=free_state(models.free, steady, omega, x, v, phase),
        steady=np.concatenate([turned.imag, omega * turned.real]),
        clearance=clearance,
        halves=0,
        work=workspace(oscillator.size, events=64),
        began=half_period(oscillator.size),
    )
    run.require(_start(problem, held, run.state, clearance, float(x[0]), float(v[0]), run.work))
    run.work.cursor[ROWS] = 0
    return run
