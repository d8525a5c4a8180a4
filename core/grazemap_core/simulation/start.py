"""Initial states: validation, conversion to the arrays of the kernels, and back to physical states."""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.checks import check_point
from grazemap_core.contact.cell_problem import at_phase, cell_problem, free_state, trajectory_models
from grazemap_core.contact.held_problem import HeldModel
from grazemap_core.contact.kernels.cells import CellProblem, reference_at
from grazemap_core.contact.kernels.event_loop import impact_at_stop
from grazemap_core.contact.kernels.sticking import rest_after_impact, start_on_stop
from grazemap_core.contact.kernels.sticking_flow import HeldProblem, held_motion
from grazemap_core.contact.kernels.workspace import ANCHOR, HELD, OK, ROOTS, Workspace, workspace
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import reference_response

EVENTS = 64
"""Initial capacity of the record of a run, in events."""


@dataclass(frozen=True, eq=False)
class State:
    """A state of the oscillator: displacement (N,), velocity (N,), and the phase of the forcing in radians."""

    displacement: Floats
    velocity: Floats
    phase: float = 0.0


@dataclass(frozen=True, eq=False)
class ForcedChain:
    """An oscillator at one forcing frequency and clearance.

    Attributes
    ----------
    oscillator : Oscillator
    omega, clearance : float
    models : HeldModel
    steady : complex (2, N)
        From `reference_response`.
    """

    oscillator: Oscillator
    omega: float
    clearance: float
    models: HeldModel
    steady: Complexes

    @cached_property
    def _at_phase_zero(self) -> tuple[CellProblem, HeldProblem]:
        return cell_problem(self.models, self.steady, self.omega)

    def problems(self, phase: float) -> tuple[CellProblem, HeldProblem]:
        """Return the arrays of the kernels for a forcing phase at t = 0; arrays that change in place are new."""
        return at_phase(*self._at_phase_zero, self.models, self.steady, phase)


@dataclass(eq=False)
class Start:
    """A trajectory at its start; if it starts by moving into a stop, after this impact.

    Attributes
    ----------
    problem, held : CellProblem, HeldProblem
    steady : complex (2, N)
        From `reference_response`, the initial phase included.
    u : (N, 2)
        Free state; the kernels change it in place, as well as `held` and `work`.
    work : Workspace
        Its record contains the impact at the start, if there is one.
    status : int
        OK, or the status with which the trajectory ends at its start.
    """

    problem: CellProblem
    held: HeldProblem
    steady: Complexes
    u: Floats
    work: Workspace = field(repr=False)
    status: int


def forced_chain(oscillator: Oscillator, omega: float, clearance: float) -> ForcedChain:
    """Return an oscillator with a forcing frequency and a clearance, both > 0.

    Raises
    ------
    ParameterError
        A number is out of range.
    ConditioningError
        The modal model is ill-conditioned.
    """
    check_point(omega, clearance)
    models = trajectory_models(oscillator)
    steady = reference_response(oscillator, models.free, np.array([omega]))[0]
    return ForcedChain(oscillator, omega, clearance, models, steady)


def initial_state(
    chain: ForcedChain, displacement: Floats | None, velocity: Floats | None, phase: float, where: str = ""
) -> State:
    """Return a validated state; None stands for zero displacement or velocity.

    `where` is put before the name of the parameter in an error.

    Raises
    ------
    ParameterError
        A number is not finite, there is not one per mass, or mass 1 is outside the stops.
    """
    if not math.isfinite(phase):
        raise ParameterError(f"{where}phase", "must be finite")
    count = chain.oscillator.size
    x = _one_per_mass(f"{where}displacement", displacement, count)
    v = _one_per_mass(f"{where}velocity", velocity, count)
    if abs(x[0]) > chain.clearance:
        raise ParameterError(f"{where}displacement", "mass 1 starts outside the stops")
    return State(x, v, phase)


def _one_per_mass(name: str, values: Floats | None, count: int) -> Floats:
    if values is None:
        return np.zeros(count)
    array = np.array(values, dtype=np.float64)
    if array.shape != (count,) or not np.all(np.isfinite(array)):
        raise ParameterError(name, "must be a list of finite numbers, one per mass")
    return array


def start(chain: ForcedChain, state: State) -> Start:
    """Return the trajectory that starts from a state of `initial_state`.

    If mass 1 starts on a stop, moving into it is an impact; at rest it stays there if it is accelerated toward the
    stop.
    """
    problem, held = chain.problems(state.phase)
    u = free_state(chain.models.free, chain.steady, chain.omega, state.displacement, state.velocity, state.phase)
    work = workspace(chain.oscillator.size, events=EVENTS)
    steady = chain.steady * np.exp(1j * state.phase)
    x1, v1 = float(state.displacement[0]), float(state.velocity[0])
    status = OK
    if abs(x1) == chain.clearance:
        status = _start_on_stop(problem, held, u, chain.clearance, x1, v1, work)
    return Start(problem, held, steady, u, work, status)


def _start_on_stop(
    problem: CellProblem, held: HeldProblem, u: Floats, clearance: float, x1: float, v1: float, work: Workspace
) -> int:
    stop = 1 if x1 > 0.0 else -1
    if v1 == 0.0:
        return start_on_stop(problem, held, u, clearance, stop, work)
    if v1 * stop > 0.0:
        if impact_at_stop(problem, u, stop, v1, reference_at(problem, 0, 0.0)[2], 0, 0.0, work):
            return int(rest_after_impact(problem, held, u, clearance, 0, 0.0, 0, work))
        return OK
    work.cursor[ANCHOR], work.cursor[ROOTS] = stop, 1
    work.near[:2] = 0.0, abs(v1)
    return OK


def longer_record(work: Workspace, most: int = sys.maxsize) -> Workspace:
    """Return a workspace whose record is four times as long, with the same events; it has at most `most`."""
    rows, columns = work.events.shape
    events = np.zeros((min(4 * rows, most), columns))
    events[:rows] = work.events
    return work._replace(events=events)


def state_at(chain: ForcedChain, run: Start, phase: float) -> State:
    """Return the current state of a run as an initial state at this forcing phase.

    At rest, and during the summed impacts before it, mass 1 is exactly on its stop; near a stop that it has left, its
    gap and speed are those of the workspace; round-off never places it beyond a stop.
    """
    count = chain.oscillator.size
    anchor, resting = int(run.work.cursor[ANCHOR]), int(run.work.cursor[HELD])
    if resting != 0:
        physical = np.empty(2 * count)
        x1 = resting * chain.clearance
        held_motion(run.held, run.held.state, x1, chain.omega, math.cos(phase), math.sin(phase), physical)
        return State(physical[:count], physical[count:], phase)
    at_phase = chain.steady * np.exp(1j * phase)
    steady = np.concatenate([at_phase[0].imag, chain.omega * at_phase[1].real])
    physical = np.asarray(run.held.from_free @ run.u.ravel() + steady)
    x, v = physical[:count], physical[count:]
    if anchor != 0:
        gap, rate = run.work.near[:2]
        x[0], v[0] = anchor * (chain.clearance - gap), -anchor * rate
    x[0] = min(max(x[0], -chain.clearance), chain.clearance)
    return State(x, v, phase)


def wrapped(phase: float) -> float:
    """Return a phase modulo 2 pi, in (-pi, pi]; a phase in this range is returned unchanged."""
    return phase if abs(phase) <= math.pi else math.atan2(math.sin(phase), math.cos(phase))
