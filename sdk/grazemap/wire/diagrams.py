"""The request for a bifurcation diagram: one parameter varies, the other is fixed."""

from __future__ import annotations

from collections.abc import Collection
from typing import Annotated, Literal

from pydantic import Field, model_validator

from grazemap.wire.base import Grid, Listable, Positive, invalid
from grazemap.wire.process import Count, MaxPeriod, Operation, ProcessRequest


class BifurcationDiagramsRequest(ProcessRequest):
    """Settled motions along clearance or omega: stroboscopic points, impact velocities and the name of each motion.

    `range` has the values of the parameter that varies; the other one is given by its name. Trajectories start at rest,
    or at the final state for the next smaller ("sweep-up") or larger ("sweep-down") value.
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
            }
        },
    )

    vary: Literal["clearance", "omega"]
    """The parameter that varies; the other one is given by its name."""
    range: Grid
    """The values of the parameter that varies: a range, or an increasing list."""
    omega: Positive | None = None
    """Forcing frequency, where clearance varies."""
    clearance: Positive | None = None
    """Distance of each stop from the middle, where omega varies."""
    policy: Literal["rest", "sweep-up", "sweep-down"] = "rest"
    """Where trajectories start: at rest, or at the final state for the next smaller (sweep-up) or larger value."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 300
    """Forcing periods of the transient at each value, before those that are shown."""
    periods: Count = 64
    """Forcing periods that are shown at each value."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""

    @model_validator(mode="after")
    def _one_is_fixed(self) -> BifurcationDiagramsRequest:
        other = "omega" if self.vary == "clearance" else "clearance"
        if getattr(self, other) is None:
            raise invalid(f"{other} is missing: it is the parameter that does not vary", "a finite number > 0", other)
        if getattr(self, self.vary) is not None:
            raise invalid(f"{self.vary} varies: its values are the range", "left out", self.vary)
        return self

    def unused(self) -> Collection[str]:
        """As `Request.unused`."""
        return (self.vary,)

    @property
    def fixed(self) -> float:
        """The value of the parameter that does not vary."""
        value = self.omega if self.vary == "clearance" else self.clearance
        assert value is not None  # as validated
        return value
