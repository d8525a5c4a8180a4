"""Bifurcation diagrams: settled motions along one parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from grazemap.results.base import Result, counted
from grazemap.results.records import ChanceToSettle, FloatArray, IntArray, Motion, described
from grazemap.schema.trajectories import SECTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.plots.axes import LegendPlace

QUANTITIES = ("displacement", "velocity", "impact_velocity")
"""The quantities that a diagram can show."""


@described(SECTION)
class Section:
    """The motion at one value of the parameter."""

    displacement: FloatArray
    velocity: FloatArray
    impact_velocity: FloatArray
    impact_stop: IntArray
    motion: Motion
    sensitive: bool | None = None
    transient_growth: float | None = None


class BifurcationDiagram(Result):
    """Settled motions along clearance or omega."""

    parameter: FloatArray
    sections: tuple[Section, ...]
    chance_to_settle: ChanceToSettle | None = None

    @property
    def vary(self) -> str:
        """Either "clearance" or "omega"."""
        return str(self.meta["request"]["vary"])

    def points(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return all points of the diagram, the parameter and a quantity of `Section`, each of shape (points,).

        Raises
        ------
        ValueError
            The quantity is not one of `QUANTITIES`.
        """
        if quantity not in QUANTITIES:
            raise ValueError(f"the quantity is one of {', '.join(QUANTITIES)}")
        columns = [getattr(section, quantity) for section in self.sections]
        return np.repeat(self.parameter, [len(column) for column in columns]), np.concatenate(columns)

    def labels(self) -> tuple[str, ...]:
        """Return the name of the motion at every value: n-p_r-q_l, or its kind."""
        return tuple(section.motion.label or section.motion.kind for section in self.sections)

    def plot(
        self,
        ax: Axes | None = None,
        quantity: str = "displacement",
        *,
        motions: int = 12,
        colours: Mapping[str, str] | None = None,
        legend: LegendPlace | None = None,
        labels: bool = True,
    ) -> Axes:
        """Draw a quantity of the sections over the parameter, in the colours of the motions.

        `quantity` is "displacement", "velocity" or "impact_velocity". `motions` is the number of motions with
        a colour. `colours` gives colours by label or kind. Ticks along the top show the values whose motion is
        sensitive.
        """
        from grazemap.plots.axes import drawing
        from grazemap.plots.diagrams import plot_bifurcation_diagram

        return plot_bifurcation_diagram(self, drawing(ax, legend, labels, 10.0, 5.5), quantity, motions, colours)

    def _summary(self) -> str:
        said = f"{counted(self.parameter, 'value')} of {self.vary}"
        sensitive = [section.sensitive for section in self.sections]
        if None not in sensitive:
            said += f", {sensitive.count(True)} sensitive"
        return said if self.chance_to_settle is None else f"{said}, {self.chance_to_settle}"
