"""Bifurcation diagrams: settled motions along one parameter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Unpack

import numpy as np

from grazemap.results.base import Result, counted
from grazemap.results.common_records import CHANCE, STOPS, ChanceToSettle, Common, Motion
from grazemap.results.observables import Observed, quantity_of, variables_of
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import FloatArray, IntArray, Record, field

if TYPE_CHECKING:
    from matplotlib.axes import Axes

QUANTITIES = ("displacement", "velocity", "impact_velocity")
"""The quantities that a diagram can show."""


class Section(Record):
    """The motion at one value of the parameter."""

    displacement: FloatArray = field("Contact coordinate once per forcing period, at phase 0.", "point", "m")
    velocity: FloatArray = field("Its velocity at the same times.", "point", "m/s")
    impact_velocity: FloatArray = field("Velocity before every impact, signed.", "impact", "m/s")
    impact_stop: IntArray = field("Stop of every impact: +1 right, -1 left.", "impact", dtype="int8", values=STOPS)
    motion: Motion = field(
        "The motion to which the trajectory settles within transient_periods + periods + 500 periods. It is "
        "verified if its orbit is verified and captures the trajectory, which is not sensitive.",
        variable="motion",
    )
    sensitive: bool = field(Common)
    transient_growth: float = field(Common)


class BifurcationDiagram(
    Observed, Result, process="bifurcation-diagrams", dimensions="parameter", outputs="OutputOfDiagram"
):
    """Settled motions along one parameter."""

    parameter: FloatArray = field("Values of the parameter that varies, increasing.", "parameter")
    sections: tuple[Section, ...] = field("The sections, one for each value.", "parameter")
    chance_to_settle: ChanceToSettle | None = field(CHANCE, when="of diagrams with chaotic motions")

    @property
    def vary(self) -> str:
        """The parameter that varies, for example "clearance" or "omega"."""
        return str(self.meta["request"]["axis"]["vary"])

    def points(self, quantity: str) -> tuple[FloatArray, FloatArray]:
        """Return all points of the diagram, the parameter and a quantity of `Section`, each of shape (points,).

        An observable or an output has one point for each value of the parameter.

        Raises
        ------
        ValueError
            The quantity is none of `QUANTITIES`, and was not asked for.
        """
        if quantity not in QUANTITIES:
            observed = dict(self._observed())
            if quantity not in observed:
                raise ValueError(f"the quantity is one of {', '.join((*QUANTITIES, *observed))}")
            return self.parameter, observed[quantity]
        columns = [getattr(section, quantity) for section in self.sections]
        return np.repeat(self.parameter, [len(column) for column in columns]), np.concatenate(columns)

    def labels(self) -> tuple[str, ...]:
        """Return the name of the motion at every value: n-p_r-q_l, or its kind."""
        return tuple(section.motion.label or section.motion.kind for section in self.sections)

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        quantity: str = "displacement",
        *,
        motions: int = 12,
        colours: Mapping[str, str] | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw a quantity of the sections over the parameter, in the colours of the motions.

        `quantity` is "displacement", "velocity" or "impact_velocity", an observable such as "dissipated_power", or an
        output such as "spring_rms". `motions` is the number of motions with a colour. `colours` gives colours by
        label or kind. Ticks along the top show the values whose motion is sensitive.
        """
        observed = quantity_of(self, quantity) if quantity in dict(self._observed()) else None
        return draw(self, ax, options, quantity=quantity, observed=observed, motions=motions, colours=colours)

    def _observed(self) -> Iterator[tuple[str, FloatArray]]:
        return ((variable.name, values) for variable, values in variables_of(self))

    def _summary(self) -> str:
        sensitive = sum(section.sensitive for section in self.sections)
        summary = f"{counted(self.parameter, 'value')} of {self.vary}, {sensitive} sensitive"
        return summary if self.chance_to_settle is None else f"{summary}, {self.chance_to_settle}"
