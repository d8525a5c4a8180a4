"""The requests for a periodic orbit, and for the branch that it belongs to."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from grazemap.models.base import Float, Listable, Positive, Request, invalid
from grazemap.models.process import MaxPeriod, ProcessRequest
from grazemap.models.ranges import Interval
from grazemap.models.states import InitialState

Stop = Annotated[Literal[1, -1], Listable]


class OrbitMotion(Request):
    """A motion by its period and the stops of its impacts in order.

    Phases and velocities are where Newton's method begins: omega t of the impacts with the forcing f sin(omega t), in
    radians, and the signed velocities before them. Left out, an orbit in closed form is taken, or trajectories are
    tried that settle to such a motion.
    """

    period: MaxPeriod
    stops: Annotated[list[Stop], Field(min_length=1, max_length=256, fail_fast=True), Listable]
    phases: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None
    velocities: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None

    @model_validator(mode="after")
    def _impacts_fit(self) -> OrbitMotion:
        count = len(self.stops)
        for name in ("phases", "velocities"):
            values = getattr(self, name)
            other = "velocities" if name == "phases" else "phases"
            if values is None and getattr(self, other) is not None:
                raise invalid(f"{other} are given, and {name} are missing", "both, or neither", name)
            if values is not None and len(values) != count:
                raise invalid(f"{name} has {len(values)} numbers and there are {count} stops", "one per stop", name)
        if self.phases is not None:
            rises = all(b > a for a, b in pairwise(self.phases))
            if not (rises and self.phases[-1] - self.phases[0] < 2.0 * math.pi * self.period):
                detail = "the phases must increase and span less than the period"
                raise invalid(detail, "increasing, over less than 2 pi period", "phases")
        return self


class PeriodicOrbitsRequest(ProcessRequest):
    """A periodic motion with impacts, solved for by Newton's method from the equations of its impacts.

    It is looked for near `motion`, or near what the trajectory from `initial` settles to within `transient_periods`;
    left out both, near what the one from rest does.
    """

    omega: Positive
    clearance: Positive
    motion: OrbitMotion | None = None
    initial: InitialState | None = None
    transient_periods: Annotated[int, Field(ge=0), Listable] = 1000
    max_period: MaxPeriod = 32

    @model_validator(mode="after")
    def _one_beginning(self) -> PeriodicOrbitsRequest:
        if self.motion is not None and self.initial is not None:
            raise invalid("motion and initial are two ways to say the same", "one of them", "initial")
        if self.motion is None:
            state = (self.initial or InitialState()).fitted(self.oscillator.size, self.clearance, ("initial",))
            # the model is frozen for others; this is still its validation
            object.__setattr__(self, "initial", state)
        return self


class OrbitBranchesRequest(PeriodicOrbitsRequest):
    """The branch of a periodic orbit over clearance or omega, with its special points.

    `range` is the interval of the parameter that varies, and holds the value of the orbit.
    """

    vary: Literal["clearance", "omega"] = "clearance"
    range: Interval
    max_points: Annotated[int, Field(ge=1, le=20_000), Listable] = 2000

    @model_validator(mode="after")
    def _orbit_in_range(self) -> OrbitBranchesRequest:
        value = self.clearance if self.vary == "clearance" else self.omega
        if not self.range.start <= value <= self.range.stop:
            raise invalid(f"the range does not hold {self.vary} of the orbit", "start <= value <= stop", "range")
        return self
