"""Runs of many trajectories until their motions can be named; common to maps, basins and borders."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.codes import HIDDEN_BY_ROUNDING, RESOLVED
from grazemap_core.contact.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.contact.kernels.workspace import workspace
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.column import Column, return_search
from grazemap_core.maps.kernels.lane_scheduler import settle_column
from grazemap_core.maps.kernels.lane_state import ColumnTask, TrajectoryResults, lane_records
from grazemap_core.maps.kernels.lane_tables import LaneModel, lane_tables
from grazemap_core.maps.kernels.lane_tangents import RECORDED_IMPACTS, lane_tangents
from grazemap_core.maps.kernels.lanes import LANES
from grazemap_core.maps.kernels.lockstep import lanes
from grazemap_core.maps.tolerances import GROWTH_SHARE, GROWTH_SKIPPED, MOST_GROWTH_PERIODS
from grazemap_core.model.harmonic_response import hidden_by_rounding
from grazemap_core.model.impulse_response import impulse_response
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import reference_response
from grazemap_core.orbits.kernels.verification import ImpulseBlocks, verification_scratch
from grazemap_core.simulation.kernels.period_detection import stroboscopic_history
from grazemap_core.simulation.start import State


class Settling(NamedTuple):
    """Settings of a run.

    Attributes
    ----------
    max_periods, max_period : int
        As in `unfolding.unfolding_map_tile`.
    early : bool
        Whether a trajectory stops once its motion is verified, or named by its returns where it cannot be verified.
        Otherwise all run for `max_periods` and are named by their returns alone.
    linearised : bool
        Whether exponents of motions that are not periodic are computed, and multipliers of those that are not verified.
    follow : bool
        Whether a trajectory starts at the final state of the trajectory at the previous clearance.
    starts : (s, 2, N) or None
        Initial displacements in clearances and velocities in clearances times omega; at rest when None.
    """

    max_periods: int
    max_period: int
    early: bool = True
    linearised: bool = True
    follow: bool = False
    starts: Floats | None = None


class Settler:
    """Settings and scratch for runs of one oscillator."""

    def __init__(self, oscillator: Oscillator, task: Settling) -> None:
        """Allocate lanes, histories and tangents; nothing is run."""
        size = oscillator.size
        self._models = trajectory_models(oscillator)
        self._blocks = _impulse_blocks(self._models.free, task.early)
        self._task = task
        growth_periods = min(math.ceil(GROWTH_SHARE * task.max_periods), MOST_GROWTH_PERIODS)
        self._growth_halves = 2 * growth_periods if task.linearised else 0
        events = RECORDED_IMPACTS if task.linearised or self._blocks.verifiable else 0
        free = self._models.free
        self._masses = (0,) * size
        self._scratch: dict[str, Any] = {
            "group": lanes(size, events),
            "history": stroboscopic_history(size, task.max_period, LANES),
            "tangents": lane_tangents(free.decay, free.frequency_squared, self._growth_halves),
            "records": lane_records(),
            "returns": return_search(),
            "work": workspace(size, events),
            "verification": verification_scratch(size),
            "u": np.zeros((size, 2)),
            "final_state": np.zeros((size, 2)),
        }

    def steady(self, omega: Floats) -> Complexes:
        """Return the amplitudes of the reference motions at frequencies (m,), shape (m, 2, N)."""
        return reference_response(self._models.oscillator, self._models.free, omega)

    def run(
        self,
        omega: float,
        steady: Complexes,
        clearances: Floats,
        states: Floats,
        scaled: Floats,
        phase: float = 0.0,
        inherits: bool = False,
    ) -> tuple[Integers, Floats]:
        """Run one trajectory for each clearance and initial state.

        Parameters
        ----------
        steady : complex (2, N)
            `Settler.steady` at omega.
        clearances : (n,)
        states, scaled : (2, N) and (s, 2, N)
            Trajectories of clearance b begin at the displacements and velocities ``states + b scaled``, with mass 1
            between the stops. A single trajectory may begin on a stop; if mass 1 moves into it, this is an impact.
        phase : float
            Phase of the forcing at the start.
        inherits : bool
            Whether a single trajectory begins with the error that the previous single one had at its end.

        Returns
        -------
        codes, figures : (n, s, CODES) and (n, s, FIGURES)
        """
        free = self._models.free
        problem, held = cell_problem(self._models, steady, omega, phase)
        stop, states = _on_stop(states, clearances, problem.restitution)
        count = len(clearances) * len(scaled)
        results = TrajectoryResults(
            codes=np.empty((count, lane_state.CODES), dtype=np.int64), figures=np.empty((count, lane_state.FIGURES))
        )
        task = ColumnTask(
            clearances=np.ascontiguousarray(clearances, dtype=np.float64),
            base=free_state(free, steady, omega, states[0], states[1], phase),
            directions=_in_blocks(free, scaled),
            max_periods=self._task.max_periods,
            max_period=self._task.max_period,
            early=self._task.early,
            follow=self._task.follow,
            growth_halves=self._growth_halves,
            growth_skipped=2 * (self._growth_halves // GROWTH_SKIPPED),
            stop=stop,
            inherits=inherits,
        )
        model = LaneModel(problem, held, lane_tables(problem, held.viscous_term))
        settle_column(self._masses, Column(model, self._blocks, task, results, **self._scratch))
        shape = (len(clearances), len(scaled))
        codes, figures = (
            results.codes.reshape(*shape, lane_state.CODES),
            results.figures.reshape(*shape, lane_state.FIGURES),
        )
        hidden = hidden_by_rounding(problem.steady_bound, np.asarray(clearances))
        codes[hidden, :, : lane_state.HALVES_RUN], figures[hidden] = 0, np.nan
        codes[hidden, :, lane_state.REASON], codes[hidden, :, lane_state.SETTLED_AFTER] = HIDDEN_BY_ROUNDING, -1
        codes[hidden, :, lane_state.UNVERIFIED] = RESOLVED
        return codes, figures

    def run_from(self, omega: float, clearance: float, start: State, inherits: bool = False) -> tuple[Integers, Floats]:
        """Run one trajectory from a state; return its codes (CODES,) and figures (FIGURES,). `inherits` as in `run`."""
        steady = self.steady(np.array([omega]))[0]
        states, nothing = np.stack([start.displacement, start.velocity]), np.zeros((1, 2, len(self._masses)))
        codes, figures = self.run(omega, steady, np.array([clearance]), states, nothing, start.phase, inherits)
        return codes[0, 0], figures[0, 0]


def _impulse_blocks(model: ModalModel, wanted: bool) -> ImpulseBlocks:
    """Return the oscillator's blocks, with the response of mass 1 to an impulse on it."""
    blocks = impulse_response(model)
    return ImpulseBlocks(
        decay=np.ascontiguousarray(blocks.decay),
        discriminant=np.ascontiguousarray(blocks.discriminant),
        frequency_squared=np.ascontiguousarray(blocks.frequency_squared),
        frequency=np.sqrt(blocks.frequency_squared),
        unit_impulse=np.stack([blocks.value, blocks.slope], axis=1),
        verifiable=wanted and not bool(np.any(model.undamped)),
    )


def _on_stop(states: Floats, clearances: Floats, restitution: float) -> tuple[int, Floats]:
    """Return the stop on which mass 1 is, 0 for none, and the state (2, N) after the impact if it moves into it."""
    stop = int(np.sign(states[0, 0])) if np.array_equal(np.abs(states[0, :1]), clearances) else 0
    if stop * states[1, 0] <= 0.0:
        return stop, states
    after = states.copy()
    after[1, 0] *= -restitution
    return stop, after


def _in_blocks(model: ModalModel, states: Floats) -> Floats:
    """Return physical states (s, 2, N) in block coordinates, (s, N, 2)."""
    count, _, size = states.shape
    flat = states.reshape(count, 2 * size)
    result = np.zeros((count, 2 * size))
    for c in range(2 * size):  # term by term: the roundings of a product of matrices depend on the number of states
        result += flat[:, c : c + 1] * model.to_modal[:, c]
    return result.reshape(count, size, 2)


def settle_grid(oscillator: Oscillator, omega: Floats, clearance: Floats, task: Settling) -> tuple[Integers, Floats]:
    """Return codes and figures of every trajectory of a grid, shapes (CODES, n, m, s) and (FIGURES, n, m, s).

    m frequencies, n clearances in the order in which they are to be followed, s initial states.
    """
    settler = Settler(oscillator, task)
    steady = settler.steady(omega)
    at_rest = np.zeros((2, oscillator.size))
    starts = np.zeros((1, 2, oscillator.size)) if task.starts is None else task.starts
    shape = (len(clearance), len(omega), len(starts))
    codes = np.empty((lane_state.CODES, *shape), dtype=np.int64)
    figures = np.empty((lane_state.FIGURES, *shape))
    for i, w in enumerate(omega):
        scaled = starts * np.array([1.0, float(w)])[:, None]
        of_column = settler.run(float(w), steady[i], clearance, at_rest, scaled)
        codes[:, :, i], figures[:, :, i] = (np.moveaxis(part, 2, 0) for part in of_column)
    return codes, figures
