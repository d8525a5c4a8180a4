"""One column of a map: the models, the task, the results and the scratch that its kernels share."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.runs import Run
from grazemap_core.maps.kernels.lane_state import ColumnTask, LaneRecords, TrajectoryResults
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.kernels.lane_tangents import LaneTangents
from grazemap_core.maps.kernels.lockstep import Lanes
from grazemap_core.maps.kernels.separate_tables import LaneModels
from grazemap_core.orbits.kernels.verification import VerificationScratch
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.kernels.period_detection import ReturnSearch, StroboscopicHistory


class Column(NamedTuple):
    """A column of a map."""

    models: LaneModels
    """The models of the trajectories."""
    task: ColumnTask
    """What is computed."""
    results: TrajectoryResults
    """Receives the motions."""
    group: Lanes
    """Current states of all lanes."""
    history: StroboscopicHistory
    """Every lane's states at the ends of the last half periods."""
    tangents: LaneTangents
    """Small changes of the state along every lane, with the capacity for task.growth_halves."""
    records: LaneRecords
    """Progress of every lane's trajectory."""
    returns: ReturnSearch
    """Scratch of the search for returns."""
    run: Run
    """Scratch: a lane that goes through a cell by itself, with the capacity of the lanes for events."""
    verification: VerificationScratch
    """Scratch of verifications."""
    final_state: Floats
    """(N, 2) The state in which the last trajectory of a sweep ended."""


def return_search() -> ReturnSearch:
    """Return fresh scratch."""
    return ReturnSearch(*(np.zeros(LANES) for _ in ReturnSearch._fields))
