"""Many trajectories of one oscillator at one forcing frequency side by side: their first impacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.kernels.cells import CellProblem
from grazemap_core.contact.kernels.runs import (
    EVENT_COUNT,
    FOLLOWED,
    HALF,
    KIND,
    OK,
    STOP,
    TIME,
    VELOCITY,
    new_run,
)
from grazemap_core.contact.stops import Clearance, both_clearances, stops_table
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels.first_pass import LANE_BLOCK
from grazemap_core.maps.kernels.lane_state import stops_in_row
from grazemap_core.maps.kernels.lane_tables import LANES, SHARED_TABLES, LaneModel, lane_tables
from grazemap_core.maps.kernels.lanes import Lanes, lanes, start_lane
from grazemap_core.maps.kernels.lockstep import Engine, run_half
from grazemap_core.maps.runner import impulse_blocks, shared_model
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import reference

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@kernel
def _run_halves(engine: Engine, halves: int, used: int) -> None:
    """Carry lanes that have just started over several half periods; parameters as `lockstep.run_half`."""
    engine = reference(engine)
    for half in range(halves):
        run_half(engine, half, used)


@kernel
def _start_lanes(group: Lanes, problem: CellProblem, stops: Floats, u: Floats) -> None:
    """Start a trajectory in each of the first lanes, from rows of `stops_table` and one state (N, 2)."""
    group, problem = reference(group), reference(problem)
    for lane in range(stops.shape[0]):
        start_lane(group, lane, problem, stops_in_row(stops, lane), u)


class Ensemble(NamedTuple):
    """Trajectories of n clearances.

    Attributes
    ----------
    half : int32, shape (n, first)
        Index of the half forcing period in which an event falls; -1 where there are no more.
    time : (n, first)
        Time of the event since the start of that half period; NaN where there are no more.
    stop : int8, shape (n, first)
        +1 at the right stop, -1 at the left stop, 0 where there are no more.
    velocity : (n, first)
        Velocity of mass 1 before it; 0 at a release, NaN where there are no more.
    kind : int8, shape (n, first)
        What it is, a code of `kernels.runs`: IMPACT, CHATTER, IMPACT_AND_REST or RELEASE; -1 where there are no
        more.
    impacts : int64, shape (n,)
        Impacts followed one by one.
    whole : bool, shape (n,)
        Whether the trajectory was followed to its end.
    """

    half: NDArray[np.int32]
    time: Floats
    stop: NDArray[np.int8]
    velocity: Floats
    kind: NDArray[np.int8]
    impacts: NDArray[np.int64]
    whole: NDArray[np.bool_]


class Trajectories:
    """Trajectories of one oscillator at one forcing frequency, one per clearance, that have all they need to run.

    Parameters
    ----------
    oscillator : Oscillator
    omega : float
        Forcing frequency, > 0.
    clearance : (n,)
        Each with the initial state between its stops.
    first : int
        Events to report of each; later impacts are counted only.
    displacement, velocity : (N,)
        Initial state; equilibrium unless given.
    phase : float
        Forcing phase at the start.

    Raises
    ------
    ParameterError
        A state that is not between the stops.
    """

    def __init__(
        self,
        oscillator: Oscillator,
        omega: float,
        clearance: Floats | Sequence[Clearance],
        first: int,
        displacement: Floats | None = None,
        velocity: Floats | None = None,
        phase: float = 0.0,
    ) -> None:
        """Make tables, stops and room for events; nothing runs yet."""
        self.size, self.first = oscillator.size, first
        static = equilibrium(oscillator)
        x = static if displacement is None else np.asarray(displacement, dtype=np.float64)
        v = np.zeros(self.size) if velocity is None else np.asarray(velocity, dtype=np.float64)
        right, left = np.array([both_clearances(distance) for distance in clearance]).T
        place = float(oscillator.contact @ x)
        if not np.all((-left < place) & (place < right)):
            raise ParameterError("clearance", "must have the initial state between the stops")
        models = trajectory_models(oscillator)
        (structure,) = forced_structures(models, np.array([omega]))
        forced = structure.at_phase(phase)
        self._model = shared_model(LaneModel(forced, lane_tables(forced), impulse_blocks(models.free, False)))
        self._start, self._problem = structure.free_state(x - static, v, phase), forced.free
        at_rest = float(oscillator.contact @ static)
        gaps = np.stack([right - at_rest, left + at_rest], axis=1)
        restitution = np.broadcast_to([oscillator.restitution_of(1), oscillator.restitution_of(-1)], gaps.shape)
        stops = stops_table(oscillator, gaps, restitution, self._problem.cells, self._problem.steady_bound)
        self._stops = [np.ascontiguousarray(stops[low : low + LANES]) for low in range(0, len(clearance), LANES)]
        self._groups = [lanes(self.size, first) for _ in self._stops]
        self._run = new_run(self.size, len(structure.orders), first)

    def run(self, periods: int) -> None:
        """Run all of them from their start, for so many forcing periods."""
        for group, stops in zip(self._groups, self._stops, strict=True):
            _start_lanes(group, self._problem, stops, self._start)
            used = (len(stops) + LANE_BLOCK - 1) // LANE_BLOCK * LANE_BLOCK
            _run_halves(Engine(self.size, self._model, SHARED_TABLES, group, self._run), 2 * periods, used)

    def impacts(self) -> Integers:
        """Return the impacts of the last run, shape (n,)."""
        return self._of_all(lambda group: group.tally[FOLLOWED].astype(np.int64))

    def ensemble(self) -> Ensemble:
        """Return what happened in the last run."""
        events = self._of_all(lambda group: group.events)
        beyond = np.arange(self.first) >= self._of_all(lambda group: group.contacts.cursor[:, EVENT_COUNT])[:, None]
        return Ensemble(
            half=np.where(beyond, -1, events[:, :, HALF]).astype(np.int32),
            time=np.where(beyond, np.nan, events[:, :, TIME]),
            stop=np.where(beyond, 0, events[:, :, STOP]).astype(np.int8),
            velocity=np.where(beyond, np.nan, events[:, :, VELOCITY]),
            kind=np.where(beyond, -1, events[:, :, KIND]).astype(np.int8),
            impacts=self.impacts(),
            whole=self._of_all(lambda group: group.status) == OK,
        )

    def _of_all(self, part: Callable[[Lanes], NDArray[Any]]) -> NDArray[Any]:
        """Return a part of every trajectory in use."""
        pairs = zip(self._groups, self._stops, strict=True)
        return np.concatenate([part(group)[: len(stops)] for group, stops in pairs])


def first_impacts(
    oscillator: Oscillator,
    omega: float,
    clearance: Floats | Sequence[Clearance],
    periods: int,
    first: int,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
) -> Ensemble:
    """Run one trajectory per clearance in lockstep for so many forcing periods; parameters as `Trajectories`."""
    trajectories = Trajectories(oscillator, omega, clearance, first, displacement, velocity, phase)
    trajectories.run(periods)
    return trajectories.ensemble()
