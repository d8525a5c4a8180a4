"""The request for a bifurcation diagram; the base of requests in which one parameter varies and the other is fixed."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from grazemap.wire.base import CoordinateGrid, LeftOut, Listable, Positive
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.planes import Line, Varied, line_of
from grazemap.wire.process import Count, MaxPeriod, Operation, ProcessRequest
from grazemap.wire.structure import FixedClearance


class OneParameterRequest(ProcessRequest):
    """Base of requests along one parameter: `range` has its values; omega and clearance are given where fixed."""

    vary: Varied
    """The parameter that varies, as of an axis of an unfolding map."""
    range: CoordinateGrid
    """The values of the parameter that varies: a range, or an increasing list."""
    omega: Annotated[Positive | None, LeftOut] = None
    """Forcing frequency, where it does not vary."""
    clearance: Annotated[FixedClearance | None, LeftOut] = None
    """Distance of the stops from q = 0 where it does not vary: one number, or {"right": .., "left": ..}, null: none."""

    @model_validator(mode="after")
    def _is_a_line(self) -> Self:
        _ = self.line
        return self

    @cached_property
    def line(self) -> Line:
        """The parameter that varies, and the others."""
        return line_of(self.oscillator, self.omega, self.clearance, self.vary, self.range)


class BifurcationDiagramsRequest(OneParameterRequest, ObservedRequest):
    """Settled motions along one parameter: stroboscopic points, impact velocities and the name of each motion.

    `range` has the values of the parameter that varies; omega and clearance are given where they do not. Trajectories
    start at rest, or at the final state for the next smaller ("sweep-up") or larger ("sweep-down") value.
    """

    operation = Operation(
        "bifurcation-diagrams",
        "submit_bifurcation_diagrams",
        "Bifurcation diagram",
        "Compute stroboscopic points, impact velocities and the motion at every value of one parameter.",
        {
            "along the clearance": {
                "vary": "clearance",
                "range": {"start": 1.5, "stop": 2.0, "points": 51},
                "omega": 0.29,
            },
            "along the damping": {
                "vary": "damping",
                "range": {"start": 0.5, "stop": 1.5, "points": 41},
                "omega": 0.29,
                "clearance": 1.6,
            },
        },
    )

    policy: Literal["rest", "sweep-up", "sweep-down"] = "rest"
    """Where trajectories start: at rest, or at the final state for the next smaller (sweep-up) or larger value."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 300
    """Forcing periods of the transient at each value, before those that are shown."""
    periods: Count = 64
    """Forcing periods that are shown at each value."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""
