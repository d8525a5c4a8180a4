"""Many trajectories of one oscillator at one forcing frequency side by side: their first impacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.contact.cell_problem import cell_problem, free_state, trajectory_models
from grazemap_core.contact.kernels.workspace import FOLLOWED, HALF, KIND, OK, ROWS, STOP, TIME, VELOCITY, workspace
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels.lane_tables import LaneModel, lane_tables
from grazemap_core.maps.kernels.lanes import LANE_BLOCK, LANES
from grazemap_core.maps.kernels.lockstep import LANE_EVENT_COLUMNS, lanes, run_halves, start_lane
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import reference_response

Floats = NDArray[np.float64]


class Ensemble(NamedTuple):
    """Trajectories of n clearances.

    Attributes
    ----------
    half : int32, shape (n, first)
        Index of the half forcing period in which an event falls; -1 where there are no more.
    time : (n, first)
        Time of the event since the start of that half period; NaN where there are no more.
    stop : int8, shape (n, first)
        +1 at stop A, -1 at stop C, 0 where there are no more.
    velocity : (n, first)
        Velocity of mass 1 before it; 0 at a release, NaN where there are no more.
    kind : int8, shape (n, first)
        What it is, a code of `kernels.workspace`: IMPACT, CHATTER, IMPACT_AND_REST or RELEASE; -1 where there are no
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


def first_impacts(
    oscillator: Oscillator,
    omega: float,
    clearance: Floats,
    periods: int,
    first: int,
    displacement: Floats | None = None,
    velocity: Floats | None = None,
    phase: float = 0.0,
) -> Ensemble:
    """Run one trajectory per clearance in lockstep, all from one state between the stops (at rest unless given).

    Parameters
    ----------
    oscillator : Oscillator
    omega : float
        Forcing frequency, > 0.
    clearance : (n,)
        Each greater than the first displacement in size.
    periods : int
        Forcing periods to run.
    first : int
        Events to report of each; later impacts are counted only.
    displacement, velocity : (N,)
        Initial state.
    phase : float
        Forcing phase at the start.

    Raises
    ------
    ParameterError
        A state that is not between the stops.
    """
    size = oscillator.size
    x = np.zeros(size) if displacement is None else np.asarray(displacement, dtype=np.float64)
    v = np.zeros(size) if velocity is None else np.asarray(velocity, dtype=np.float64)
    clearance = np.asarray(clearance, dtype=np.float64)
    if not np.all(abs(x[0]) < clearance):
        raise ParameterError("clearance", "must be greater than the first displacement in size")
    models = trajectory_models(oscillator)
    steady = reference_response(oscillator, models.free, np.array([omega]))[0]
    problem, held = cell_problem(models, steady, omega, phase)
    model = LaneModel(problem, held, lane_tables(problem, held.viscous_term))
    u = free_state(models.free, steady, omega, x, v, phase)
    masses = (0,) * size
    n = len(clearance)
    events = np.zeros((n, first, LANE_EVENT_COLUMNS))
    seen, status = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    impacts = np.zeros(n, dtype=np.int64)
    scratch, work = np.empty_like(u), workspace(size, first)
    for low in range(0, n, LANES):
        count = min(LANES, n - low)
        group = lanes(size, first)
        for lane in range(count):
            start_lane(group, lane, problem, u, clearance[low + lane])
        used = (count + LANE_BLOCK - 1) // LANE_BLOCK * LANE_BLOCK
        run_halves(masses, model, group, 2 * periods, used, scratch, work)
        events[low : low + count] = group.events[:count]
        seen[low : low + count] = group.cursor[:count, ROWS]
        impacts[low : low + count] = group.tally[FOLLOWED, :count]
        status[low : low + count] = group.status[:count]
    beyond = np.arange(first) >= seen[:, None]
    return Ensemble(
        half=np.where(beyond, -1, events[:, :, HALF]).astype(np.int32),
        time=np.where(beyond, np.nan, events[:, :, TIME]),
        stop=np.where(beyond, 0, events[:, :, STOP]).astype(np.int8),
        velocity=np.where(beyond, np.nan, events[:, :, VELOCITY]),
        kind=np.where(beyond, -1, events[:, :, KIND]).astype(np.int8),
        impacts=impacts,
        whole=status == OK,
    )
