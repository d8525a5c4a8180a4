"""The process trajectories: one trajectory with its samples, impacts, intervals of sticking and motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from grazemap.codec import Document
from grazemap.models import TrajectoriesRequest, motion_label
from grazemap_worker.processes.core_objects import core_oscillator, record

# The unfolding map's default, so that the two agree on what a motion is called.
MAX_PERIOD = 32


def compute(request: TrajectoriesRequest, report: Callable[[int, int], object]) -> Document:
    """Return time, displacement and velocity [mass, time], impacts, sticking and motion. Raises CoreError."""
    from grazemap_core.trajectory import trajectory

    size = request.oscillator.size
    found = trajectory(
        core_oscillator(request.oscillator),
        request.omega,
        request.clearance,
        _state(request.initial.displacement, size),
        _state(request.initial.velocity, size),
        request.initial.phase,
        request.periods,
        request.transient_periods,
        request.samples_per_period,
        max_period=MAX_PERIOD,
    )
    motion = record(found.motion)
    named = (motion.get("period"), motion.get("impacts_right"), motion.get("impacts_left"))
    label = motion_label(*named) if None not in named else None
    return {
        "time": found.time,
        "displacement": found.displacement,
        "velocity": found.velocity,
        "impacts": {
            "time": found.impacts.time,
            "stop": found.impacts.stop,
            "velocity": found.impacts.velocity,
            "kind": found.impacts.kind,
        },
        "sticking": {
            "start": found.sticking.start,
            "stop_time": found.sticking.stop_time,
            "stop": found.sticking.stop,
        },
        "motion": {
            "kind": motion["kind"],
            "period": motion.get("period"),
            "impacts_right": motion.get("impacts_right"),
            "impacts_left": motion.get("impacts_left"),
            "symmetric": motion.get("symmetric"),
            "sticking": motion.get("sticking"),
            "label": label,
            "certified": motion.get("certified", False),
            "reason": motion.get("reason"),
        },
    }


def _state(values: list[float] | None, size: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.zeros(size) if values is None else np.array(values, dtype=np.float64)
