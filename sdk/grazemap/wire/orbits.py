"""The requests for a periodic orbit, for the branch that it belongs to, and for curves in the plane."""

from __future__ import annotations

import math
from collections.abc import Collection
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field, model_validator

from grazemap.wire.base import BranchInterval, Float, Interval, Listable, Positive, Request, invalid
from grazemap.wire.error_texts import UNITS
from grazemap.wire.job import motion_label
from grazemap.wire.process import InitialState, MaxPeriod, Operation, PointRequest, ProcessRequest

MAX_IMPACTS = 256
MAX_CURVE_POINTS = 100_000
_ONE_PER_IMPACT = Field(min_length=1, max_length=MAX_IMPACTS, fail_fast=True)
Stop = Annotated[Literal[1, -1], Listable]


class OrbitMotion(Request):
    """A motion by its period and the stops of its impacts in order.

    Phases and velocities are the initial guess of Newton's method: omega t of the impacts with the forcing
    f sin(omega t), in radians, and the signed velocities before them. Left out, the guess is an orbit in closed form,
    or that of a trajectory that settles to such a motion. A `label` n-p_r-q_l must agree with the period and the stops.
    """

    period: MaxPeriod
    """Period, in forcing periods."""
    stops: Annotated[list[Stop], Field(min_length=1, max_length=MAX_IMPACTS, fail_fast=True), Listable]
    """The stops of a period's impacts in order: 1 is A (right), -1 is C (left)."""
    phases: Annotated[list[Float], _ONE_PER_IMPACT, Listable] | None = None
    """Phases omega t of the impacts in radians, increasing: initial guess of Newton's method; only with velocities."""
    velocities: Annotated[list[Float], _ONE_PER_IMPACT, Listable] | None = None
    """Velocities of mass 1 before each impact, signed; only with phases."""
    label: Annotated[str, Field(max_length=64)] | None = Field(default=None, exclude=True)
    """The motion's name n-p_r-q_l; it must agree with the period and the stops."""

    @model_validator(mode="after")
    def _label_fits(self) -> OrbitMotion:
        right, left = (self.stops.count(stop) or -1 for stop in (1, -1))
        if self.label not in (None, motion_label(self.period, right, left)):
            detail = "the label does not agree with the period and the stops"
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


class PeriodicOrbitsRequest(PointRequest):
    """A periodic motion with impacts, solved for by Newton's method from the equations of its impacts.

    It is looked for near `motion`, or near the motion that the trajectory from `initial` settles to within
    `transient_periods`. Where both are left out, the trajectory starts at rest.
    """

    operation = Operation(
        "periodic-orbits",
        "submit_periodic_orbits",
        "Periodic orbit",
        "Compute the periodic orbit near given impacts, its multipliers, and whether it is admissible.",
        {"default oscillator": {"omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}}},
    )

    motion: OrbitMotion | None = None
    """The motion that is looked for; instead of initial."""
    initial: InitialState | None = None
    """Initial state of the trajectory whose motion is solved for; left out, at rest."""
    transient_periods: Annotated[int, Field(ge=0), Listable] = 1000
    """Forcing periods in which that trajectory settles."""
    max_period: MaxPeriod = 32
    """The maximum period looked for, in forcing periods."""

    @model_validator(mode="after")
    def _one_guess(self) -> PeriodicOrbitsRequest:
        if self.motion is not None and self.initial is not None:
            raise invalid("both motion and initial are given", "one of them", "initial")
        if self.motion is None:
            state = (self.initial or InitialState()).fitted(self.oscillator.size, self.clearance, ("initial",))
            # the model is frozen, but this is still its validation
            object.__setattr__(self, "initial", state)
        return self


class OrbitBranchesRequest(PeriodicOrbitsRequest):
    """The branch of a periodic orbit over clearance, omega or restitution, with its special points.

    `range` is the interval of the parameter that varies; it contains the orbit's value.
    """

    operation = Operation(
        "orbit-branches",
        "submit_orbit_branches",
        "Branch of a periodic orbit",
        "Follow the branch of a periodic orbit over a parameter, with its special points and the branches from there.",
        {
            "default oscillator": {
                "omega": 0.27,
                "clearance": 1.85,
                "motion": {"period": 1, "stops": [1]},
                "range": {"start": 1.8, "stop": 1.9},
            },
            "over restitution": {
                "omega": 0.29,
                "clearance": 1.6,
                "motion": {"period": 1, "stops": [1, 1, -1, -1]},
                "vary": "restitution",
                "range": {"start": 0.5, "stop": 1.0},
            },
        },
    )

    vary: Literal["clearance", "omega", "restitution"] = "clearance"
    """The parameter along which the branch is followed."""
    range: BranchInterval
    """The interval of that parameter; it contains the orbit's value."""
    max_points: Annotated[int, Field(ge=1, le=20_000), Listable] = 2000
    """The maximum number of points in each direction from the orbit."""

    @model_validator(mode="after")
    def _orbit_in_range(self) -> OrbitBranchesRequest:
        if self.vary == "restitution" and self.range.stop > 1.0:
            raise invalid("restitution is at most 1", "start >= 0, stop <= 1", "range", "stop")
        if self.vary != "restitution" and not self.range.start > 0.0:
            raise invalid(f"{self.vary} is greater than 0", "start > 0", "range", "start")
        value = self.oscillator.equal_restitution if self.vary == "restitution" else getattr(self, self.vary)
        if not self.range.start <= value <= self.range.stop:
            unit = UNITS.get(self.vary, "") if self.oscillator.units == "SI" else ""
            detail = f"the range{unit and f', in {unit},'} does not contain the {self.vary} of the orbit"
            said = f"{value:g} {unit}".strip()
            raise invalid(detail, f"start <= {self.vary} <= stop", "range", value=said)
        return self


class CurveMotion(OrbitMotion):
    """A motion whose curves are looked for, and the point of the window at which an orbit of it is known.

    Where omega and clearance are left out, an orbit is looked for at several points of the window. Phases and
    velocities are those of an orbit at one point, so they need omega and clearance.
    """

    omega: Positive | None = None
    """Value at an orbit of the motion, inside the window; left out, an orbit is looked for."""
    clearance: Positive | None = None
    """Value at an orbit of the motion, inside the window; left out, an orbit is looked for."""

    @model_validator(mode="after")
    def _phases_have_a_place(self) -> CurveMotion:
        for name in ("omega", "clearance"):
            if self.phases is not None and getattr(self, name) is None:
                raise invalid(f"phases are given, and {name} is missing", f"{name} of the orbit", name)
        return self


class BifurcationCurvesRequest(ProcessRequest):
    """Curves of saddle-nodes, period doublings, symmetry breakings and grazes of impacting motions in a window.

    Without `motions`: the curves of motions with one impact, or one on each stop, in up to `max_multiple` forcing
    periods, in closed form at `points` frequencies; they bifurcate from the grazing curve at its resonant points.
    With `motions`: the curves of these motions by continuation, with Neimark-Sacker curves.
    """

    operation = Operation(
        "bifurcation-curves",
        "submit_bifurcation_curves",
        "Bifurcation curves",
        "Compute the curves SN, PD, SB, NS and GR of motions in a window of omega and clearance.",
        {
            "the paper's window": {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}},
            "of a motion": {
                "omega": {"start": 0.26, "stop": 0.3},
                "clearance": {"start": 1.3, "stop": 2.05},
                "motions": [{"period": 1, "stops": [1, 1, -1, -1], "omega": 0.28, "clearance": 1.5}],
            },
        },
    )

    omega: Interval
    """The window's frequencies."""
    clearance: Interval
    """The window's clearances."""
    max_multiple: Annotated[int, Field(ge=1, le=100), Listable] = 2
    """For curves in closed form: the maximum period of their motions, in forcing periods."""
    points: Annotated[int, Field(ge=2, le=MAX_CURVE_POINTS), Listable] = 400
    """For curves in closed form: number of frequencies across the window."""
    motions: Annotated[list[CurveMotion], Field(min_length=1, max_length=16, fail_fast=True), Listable] | None = None
    """The motions whose curves are continued; left out, the curves in closed form are computed."""

    @model_validator(mode="after")
    def _motions_in_window(self) -> BifurcationCurvesRequest:
        for k, motion in enumerate(self.motions or ()):
            for name in ("omega", "clearance"):
                value, window = getattr(motion, name), getattr(self, name)
                if value is not None and not window.start <= value <= window.stop:
                    detail = f"{name} of a motion lies outside the window"
                    raise invalid(detail, f"within {name} of the request", "motions", str(k), name)
        return self

    def unused(self) -> Collection[str]:
        """Return the names of the fields of the other kind of curves."""
        return ("motions",) if self.motions is None else ("max_multiple", "points")
