"""The process trajectories: samples, impacts, intervals of sticking, motion and end of one trajectory, or of many."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import InitialState, TrajectoriesRequest, motion_label
from grazemap_worker.processes.conversion import core_oscillator, record
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap_core.simulation.motion import Motion
    from grazemap_core.simulation.start import State
    from grazemap_core.simulation.trajectories import Trajectory

# The unfolding map's default, so that the two agree on what a motion is called.
MAX_PERIOD = 32
# Times that progress is reported while a list of trajectories is computed.
REPORTS = 20


def compute(request: TrajectoriesRequest, report: Callable[[int, int], object]) -> Document:
    """Return the document of a trajectory or, for a list of initial states, their list. Raises CoreError."""
    from grazemap_core.simulation.trajectories import trajectories

    found = trajectories(
        core_oscillator(request.oscillator),
        request.omega,
        request.clearance,
        [_state(state) for state in request.states],
        request.periods,
        request.transient_periods,
        request.samples_per_period,
        MAX_PERIOD,
        None if request.times is None else np.array(request.times),
    )
    if isinstance(request.initial, InitialState):
        return _document(next(found))
    documents: list[Document] = []
    count = len(request.states)
    for trajectory in found:
        if len(documents) % -(-count // REPORTS) == 0:
            report(len(documents), count)
        documents.append(_document(trajectory))
    return {"trajectories": documents}


def _state(state: InitialState) -> State:
    from grazemap_core.simulation.start import State

    # the model has written out what was left out
    return State(np.array(state.displacement), np.array(state.velocity), state.phase)


def _document(found: Trajectory) -> Document:
    final = found.final
    return {
        "time": found.time,
        "displacement": found.displacement,
        "velocity": found.velocity,
        "impacts": {
            "time": found.impacts.time,
            "period": found.impacts.period,
            "phase_time": found.impacts.phase_time,
            "stop": found.impacts.stop,
            "velocity": found.impacts.velocity,
            "kind": found.impacts.kind,
        },
        "sticking": {
            "start": found.sticking.start,
            "stop_time": found.sticking.stop_time,
            "stop": found.sticking.stop,
        },
        "undecided": found.undecided,
        "motion": motion_document(found.motion),
        "final": None
        if final is None
        else {"displacement": final.displacement, "velocity": final.velocity, "phase": final.phase},
    }


def motion_document(found: Motion) -> Document:
    """Return a motion of the core as clients see it, with its label; what is not known is None."""
    motion: Any = record(found)
    named = [motion.get(name) for name in ("period", "impacts_right", "impacts_left")]
    return {
        "kind": motion["kind"],
        "period": motion.get("period"),
        "impacts_right": motion.get("impacts_right"),
        "impacts_left": motion.get("impacts_left"),
        "symmetric": motion.get("symmetric"),
        "sticking": motion.get("sticking"),
        "label": motion_label(*named) if None not in named else None,
        "verified": motion.get("verified", False),
        "reason": motion.get("reason"),
    }


PROCESS = Process(whole=compute)
