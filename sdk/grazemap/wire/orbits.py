"""The requests for a periodic orbit, for the branch that it belongs to, and for curves in the plane."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from grazemap.wire.base import Float, Listable, NonNegative, Positive, Request, invalid
from grazemap.wire.job import motion_label
from grazemap.wire.process import MaxPeriod, ProcessRequest
from grazemap.wire.ranges import Interval
from grazemap.wire.states import InitialState

MOST_IMPACTS = 256
Stop = Annotated[Literal[1, -1], Listable]


class OrbitMotion(Request):
    """A motion by its period and the stops of its impacts in order.

    Phases and velocities are where Newton's method begins: omega t of the impacts with the forcing f sin(omega t), in
    radians, and the signed velocities before them. Left out, an orbit in closed form is taken, or trajectories are
    tried that settle to such a motion. A `label` n-p_r-q_l adds nothing, and must be that of the period and the stops.
    """

    period: MaxPeriod
    """In forcing periods."""
    stops: Annotated[list[Stop], Field(min_length=1, max_length=MOST_IMPACTS, fail_fast=True), Listable]
    """The stops of a period's impacts in order: 1 is A (right), -1 is C (left)."""
    phases: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None
    """Of the impacts, omega t in radians, increasing: where Newton's method begins; with velocities or not at all."""
    velocities: Annotated[list[Float], Field(fail_fast=True), Listable] | None = None
    """Of mass 1 before each impact, signed; with phases or not at all."""
    label: Annotated[str, Field(max_length=64)] | None = Field(default=None, exclude=True)
    """The motion's name n-p_r-q_l; adds nothing, and must be that of the period and the stops."""

    @model_validator(mode="after")
    def _label_fits(self) -> OrbitMotion:
        right, left = (self.stops.count(stop) or -1 for stop in (1, -1))
        if self.label not in (None, motion_label(self.period, right, left)):
            detail = "the label is not that of the period and the stops"
            raise invalid(detail, "period-(stops 1)r-(stops -1)l, (-1) for none of them; or none", "label")
        return self

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
    """Forcing frequency."""
    clearance: Positive
    """Distance of each stop from the middle."""
    motion: OrbitMotion | None = None
    """The motion that is looked for; instead of initial."""
    initial: InitialState | None = None
    """Where a trajectory starts whose motion is solved for; left out, at rest."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 1000
    """Forcing periods in which that trajectory settles."""
    max_period: MaxPeriod = 32
    """The longest period looked for in it, in forcing periods."""

    @model_validator(mode="after")
    def _one_beginning(self) -> PeriodicOrbitsRequest:
        if self.motion is not None and self.initial is not None:
            raise invalid("motion and initial are two ways to say the same", "one of them", "initial")
        if self.motion is None:
            state = (self.initial or InitialState()).fitted(self.oscillator.size, self.clearance, ("initial",))
            # the model is frozen for others; this is still its validation
            object.__setattr__(self, "initial", state)
        return self


class BranchInterval(Request):
    """An interval of the parameter of a branch, both ends included; of restitution between 0 and 1."""

    start: NonNegative
    """The least value, included."""
    stop: Positive
    """The greatest value, included."""

    @model_validator(mode="after")
    def _ordered(self) -> BranchInterval:
        if not self.stop > self.start:
            raise invalid("stop must be greater than start", "stop > start >= 0")
        return self


class OrbitBranchesRequest(PeriodicOrbitsRequest):
    """The branch of a periodic orbit over clearance, omega or restitution, with its special points.

    `range` is the interval of the parameter that varies, and holds the value of the orbit.
    """

    vary: Literal["clearance", "omega", "restitution"] = "clearance"
    """The parameter along which the branch is followed."""
    range: BranchInterval
    """The interval of that parameter; it holds the value of the orbit."""
    max_points: Annotated[int, Field(ge=1, le=20_000), Listable] = 2000
    """Points of the branch at most, either way from the orbit."""

    @model_validator(mode="after")
    def _orbit_in_range(self) -> OrbitBranchesRequest:
        if self.vary == "restitution" and self.range.stop > 1.0:
            raise invalid("no restitution is greater than 1", "start >= 0, stop <= 1", "range", "stop")
        if self.vary != "restitution" and not self.range.start > 0.0:
            raise invalid(f"{self.vary} is greater than 0", "start > 0", "range", "start")
        value = self.oscillator.restitution if self.vary == "restitution" else getattr(self, self.vary)
        if not self.range.start <= value <= self.range.stop:
            raise invalid(f"the range does not hold {self.vary} of the orbit", "start <= value <= stop", "range")
        return self


class CurveMotion(OrbitMotion):
    """A motion whose curves are looked for, and where in the window an orbit of it is.

    Left out, omega and clearance are looked for too, at several places of the window. Phases and velocities are those
    of an orbit at some place, so they come with it.
    """

    omega: Positive | None = None
    """Where an orbit of the motion is, inside the window; left out, it is looked for."""
    clearance: Positive | None = None
    """Where an orbit of the motion is, inside the window; left out, it is looked for."""

    @model_validator(mode="after")
    def _phases_have_a_place(self) -> CurveMotion:
        for name in ("omega", "clearance"):
            if self.phases is not None and getattr(self, name) is None:
                raise invalid(f"phases are given, and {name} is missing", "that of the orbit", name)
        return self


class BifurcationCurvesRequest(ProcessRequest):
    """Curves of saddle-nodes, period doublings, symmetry breakings and grazes of impacting motions in a window.

    Of motions with one impact in up to `max_multiple` forcing periods, or one on either stop: those that leave the
    grazing curve at its resonant points, in closed form at `points` frequencies across the window. With `motions`
    those of these motions instead, Neimark-Sacker curves too, by continuation.
    """

    omega: Interval
    """The window's frequencies."""
    clearance: Interval
    """The window's clearances."""
    max_multiple: Annotated[int, Field(ge=1, le=100), Listable] = 2
    """Of curves in closed form: the longest period of their motions, in forcing periods."""
    points: Annotated[int, Field(ge=2, le=100_000), Listable] = 400
    """Of curves in closed form: frequencies across the window."""
    motions: Annotated[list[CurveMotion], Field(min_length=1, max_length=16, fail_fast=True), Listable] | None = None
    """The motions whose curves are looked for by continuation; left out, those in closed form are taken."""

    @model_validator(mode="after")
    def _motions_in_window(self) -> BifurcationCurvesRequest:
        for k, motion in enumerate(self.motions or ()):
            for name in ("omega", "clearance"):
                value, window = getattr(motion, name), getattr(self, name)
                if value is not None and not window.start <= value <= window.stop:
                    detail = f"{name} of a motion lies outside the window"
                    raise invalid(detail, f"within {name} of the request", "motions", str(k), name)
        return self

    @model_serializer(mode="wrap")
    def _one_kind_of_curves(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what is for the other kind of curves: no question has both."""
        fields: dict[str, Any] = dump(self)
        for name in ("motions",) if self.motions is None else ("max_multiple", "points"):
            fields.pop(name, None)
        return fields
