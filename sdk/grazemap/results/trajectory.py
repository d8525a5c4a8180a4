"""Trajectories with every impact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from grazemap.codec import Document
from grazemap.models import Motion
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import FloatArray, Impacts, Sticking

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Result):
    """One trajectory with every impact.

    Attributes
    ----------
    time : ndarray of shape (time,)
        From the start of the recorded part; s in SI.
    displacement, velocity : ndarray of shape (N, time)
        m and m/s in SI.
    impacts : Impacts
    sticking : Sticking
    motion : Motion
        The motion it settled to, or "unresolved" with the reason.
    """

    process: ClassVar[str] = "trajectories"

    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    impacts: Impacts
    sticking: Sticking
    motion: Motion

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        impacts, sticking = document["impacts"], document["sticking"]
        return {
            **{name: floats(document[name]) for name in ("time", "displacement", "velocity")},
            "impacts": Impacts(
                floats(impacts["time"]),
                integers(impacts["stop"]),
                floats(impacts["velocity"]),
                np.asarray(impacts["kind"], dtype=np.str_),
            ),
            "sticking": Sticking(floats(sticking["start"]), floats(sticking["stop_time"]), integers(sticking["stop"])),
            "motion": Motion.model_validate(document["motion"]),
        }

    def plot(self, figure: Figure | None = None, *, mass: int = 1) -> tuple[Axes, Axes]:
        """Draw the time history of one mass with the stops, and its phase portrait; return both axes."""
        from grazemap.plots.trajectory import plot_trajectory

        return plot_trajectory(self, figure, mass)

    def _summary(self) -> str:
        return f"{len(self.impacts)} impacts, motion {self.motion.label or self.motion.kind}"
