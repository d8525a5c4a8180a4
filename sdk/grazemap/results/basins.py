"""Basins of attraction: which motion every initial state of a rectangle leads to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.results.base import Result, counted, counted_points
from grazemap.results.records import BoolArray, ChanceToSettle, FloatArray, IntArray, MotionShare, Verifiable, described
from grazemap.schema.basins import ATTRACTOR

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.plots.axes import LegendPlace


@described(ATTRACTOR, comparable=True)
class Attractor(Verifiable):
    """A motion that initial states lead to."""

    kind: str
    states: int
    share: float
    label: str | None = None
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    mean_position: float | None = None
    mean_velocity: float | None = None
    multiplier: float | None = None
    lyapunov: float | None = None
    verified: bool = False

    @property
    def motion(self) -> MotionShare:
        """The motion and its share, for pictures and legends."""
        counts = (self.period, self.impacts_right, self.impacts_left)
        return MotionShare(self.label or self.kind, self.kind, *counts, self.states, self.share)


class Basins(Result):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance."""

    horizontal: FloatArray
    vertical: FloatArray
    label: IntArray
    attractors: tuple[Attractor, ...]
    settled_after: IntArray
    lyapunov: FloatArray
    reason: IntArray
    reasons: tuple[str, ...]
    verified: BoolArray | None = None
    sensitive: BoolArray | None = None
    transient_growth: FloatArray | None = None
    chance_to_settle: ChanceToSettle | None = None

    @property
    def unresolved(self) -> float:
        """Share of the states whose motion is unresolved."""
        return float((self.label < 0).mean())

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """As `Result.derived`."""
        named = [attractor.label or attractor.kind for attractor in self.attractors]
        every = np.where(self.label < 0, len(named), self.label)
        return {"motion": (every, [*named, "unresolved"]), "attractor_motion": (np.arange(len(named)), named)}

    def plot(
        self,
        ax: Axes | None = None,
        *,
        colours: Mapping[str, str] | None = None,
        legend: LegendPlace | None = None,
        labels: bool = True,
    ) -> Axes:
        """Draw the rectangle, every state in the colour of the motion that it leads to.

        `colours` gives colours by label or kind.
        """
        from grazemap.plots.axes import drawing
        from grazemap.plots.basins import plot_basins

        return plot_basins(self, drawing(ax, legend, labels, 9.0, 6.5), colours)

    def _summary(self) -> str:
        rows, columns = self.label.shape
        said = f"{rows} x {columns} states, {counted(self.attractors, 'attractor')}"
        said += "" if self.sensitive is None else f", {counted_points(self.sensitive, 'sensitive')}"
        return said if self.chance_to_settle is None else f"{said}, {self.chance_to_settle}"
