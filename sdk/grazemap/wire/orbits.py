"""The requests for a periodic orbit, for the branch that it belongs to, and for curves in the plane."""

from __future__ import annotations

import math
from collections.abc import Collection
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from grazemap.constants import UNITS
from grazemap.wire.base import (
    Float,
    LeftOut,
    Listable,
    OptionalCount,
    Place,
    Places,
    Request,
    invalid,
    plain,
    without_nulls,
)
from grazemap.wire.job import impacts_on, motion_label
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.oscillator import Oscillator
from grazemap.wire.planes import (
    AXES,
    Parameters,
    PlaneRequest,
    WindowAxis,
    is_structural,
    require_values,
    structure_value,
    vary_of,
)
from grazemap.wire.process import Operation, PointRequest, ShortForms
from grazemap.wire.states import InitialState, MaxPeriod, Multiple, OtherStarts, Period
from grazemap.wire.structure import ClearancePair, as_pair, restitutions

MAX_IMPACTS = 256
MAX_CURVE_POINTS = 100_000
_LONG = "the phases must increase and span less than the period"
_ONE_PER_IMPACT = Field(min_length=1, max_length=MAX_IMPACTS, fail_fast=True)
Stop = Annotated[Literal[1, -1], Listable]


class OrbitMotion(Request):
    """A motion by its period and the stops of its impacts in order.

    Phases and velocities are the initial guess of Newton's method: omega t of the impacts with the forcing
    f sin(omega t), in radians, and the signed velocities before them. Left out, the guess is an orbit in closed form,
    or that of a trajectory that settles to such a motion. A `label` n-p_r-q_l must agree with the period and the stops.
    """

    period: Period
    """Period, in forcing periods."""
    stops: Annotated[list[Stop], _ONE_PER_IMPACT, Listable]
    """The stops of a period's impacts in order: 1 right, -1 left."""
    phases: Annotated[list[Float], _ONE_PER_IMPACT, Listable] | None = None
    """Phases omega t of the impacts in radians, increasing: initial guess of Newton's method; only with velocities."""
    velocities: Annotated[list[Float], _ONE_PER_IMPACT, Listable] | None = None
    """Velocities of the contact before each impact, signed; only with phases."""
    label: Annotated[str, Field(max_length=64)] | None = Field(default=None, exclude=True)
    """The name of the motion, such as 1-2r-2l; it must agree with the period and the stops."""

    @model_validator(mode="after")
    def _fields_agree(self) -> OrbitMotion:
        if self.label not in (None, motion_label(self.period, *impacts_on(self.stops))):
            detail = "the label does not agree with the period and the stops"
            raise invalid(detail, f"{motion_label(self.period, *impacts_on(self.stops))}, or no label", "label")
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
                raise invalid(_LONG, "increasing, over less than 2 pi period", "phases")
        return self

    def require_period_of(self, oscillator: Oscillator, *at: str) -> None:
        """Refuse phases that span a period of an oscillator whose forces repeat p times while omega t grows by 2 pi."""
        divisor = oscillator.common_divisor
        if self.phases is None or self.phases[-1] - self.phases[0] < 2.0 * math.pi / divisor * self.period:
            return
        raise invalid(_LONG, f"increasing, over less than 2 pi period/{divisor}", *at, "phases")

    def require_stops(self, clearance: ClearancePair, *at: str) -> None:
        """Refuse an impact on a stop that is absent."""
        for stop, distance in ((1, clearance.right), (-1, clearance.left)):
            if distance is None and stop in self.stops:
                raise invalid("an impact is on a stop that is absent", "stops that clearance gives", *at, "stops")


class OrbitRequest(PointRequest, ObservedRequest):
    """Base of the requests of a periodic motion with impacts.

    It is looked for near `motion`, or near the motion that the trajectory from `initial` settles to within
    `transient_periods`. Where both are left out, the trajectory starts at rest.
    """

    motion: OrbitMotion | None = None
    """The motion that is looked for; instead of initial."""
    initial: InitialState | None = None
    """Initial state of the trajectory whose motion is solved for; left out, at rest."""
    transient_periods: OptionalCount = 1000
    """Forcing periods in which the trajectory from the initial state settles; not used where a motion is given."""
    max_period: MaxPeriod = 32

    @model_validator(mode="after")
    def _one_guess(self) -> Self:
        if self.motion is not None and self.initial is not None:
            raise invalid("both motion and initial are given", "one of them", "initial")
        if self.motion is None:
            state = (self.initial or InitialState()).fitted(self.oscillator, self.clearance, ("initial",))
            self._replace("initial", state)
        else:
            self.motion.require_period_of(self.oscillator, "motion")
            self.motion.require_stops(as_pair(self.clearance), "motion")
        return self


class PeriodicOrbitsRequest(OrbitRequest):
    """A periodic motion with impacts, solved for by Newton's method from the equations of its impacts.

    It is looked for near `motion`, or near the motion that the trajectory from `initial` settles to within
    `transient_periods`. Where both are left out, the trajectory starts at rest.
    """

    operation = Operation(
        "periodic-orbits",
        "submit_periodic_orbits",
        "Compute the periodic orbit near given impacts, its multipliers, and whether it is admissible.",
        {
            "default oscillator": {"omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}},
            "of one stop": {"omega": 0.27, "clearance": {"right": 1.85}, "motion": {"period": 1, "stops": [1]}},
        },
    )

    other_starts: Annotated[OtherStarts, LeftOut] = 0

    @model_validator(mode="after")
    def _start_is_compared(self) -> PeriodicOrbitsRequest:
        if self.other_starts and self.motion is not None:
            detail = "other_starts are compared with the motion from an initial state"
            raise invalid(detail, "0, or no motion", "other_starts")
        return self


class OrbitBranchesRequest(OrbitRequest):
    """The branch of a periodic orbit over a parameter, with its special points.

    `vary` "clearance" or "restitution" is that of both stops, which must be equal; with "_right" or "_left" it is that
    of one stop. "bias", "forcing" and "damping" are factors, 1 at the orbit; "masses[i]", "stiffnesses[i]" and
    "dampings[i]" are values of a chain. The interval of the parameter that varies contains the orbit's value.
    """

    operation = Operation(
        "orbit-branches",
        "submit_orbit_branches",
        "Follow the branch of a periodic orbit over a parameter, with its special points and the branches from there.",
        {
            "default oscillator": {
                "omega": 0.27,
                "clearance": 1.85,
                "motion": {"period": 1, "stops": [1]},
                "axis": {"vary": "clearance", "values": {"start": 1.8, "stop": 1.9}},
            },
            "over restitution": {
                "omega": 0.29,
                "clearance": 1.6,
                "motion": {"period": 1, "stops": [1, 1, -1, -1]},
                "axis": {"vary": "restitution", "values": {"start": 0.5, "stop": 1.0}},
            },
            "over the clearance of one stop": {
                "omega": 0.29,
                "clearance": {"right": 1.6, "left": 1.61},
                "motion": {"period": 1, "stops": [1, 1, -1, -1]},
                "axis": {"vary": "clearance_right", "values": {"start": 1.58, "stop": 1.62}},
            },
        },
    )

    short = ShortForms(("axis",), {}, "clearance")

    axis: WindowAxis
    """The parameter along which the branch is followed, and its interval, which contains the orbit's value."""
    max_points: Annotated[int, Field(ge=1, le=20_000), Listable] = 2000
    """The maximum number of points in each direction from the orbit."""

    @model_validator(mode="after")
    def _orbit_in_range(self) -> OrbitBranchesRequest:
        value, vary, (start, stop) = self.value, self.axis.vary, self.axis.ends
        require_values(self.axis, "axis", "values")
        if not start <= value <= stop:
            unit = UNITS.get(vary, "") if self.oscillator.units == "SI" else ""
            detail = f"the range{unit and f', in {unit},'} does not contain the {vary} of the orbit"
            raise invalid(detail, f"start <= {vary} <= stop", "axis", "values", value=f"{value:g} {unit}".strip())
        return self

    @property
    def value(self) -> float:
        """The value of the parameter that varies, at the orbit. Raises where there is none."""
        return parameter_value(self.axis.vary, self.omega, self.oscillator, self.clearance)


def _short_name(axis: Any) -> str:
    """Return "omega" or "clearance" for an axis along which that varies, else "".

    A motion of `BifurcationCurvesRequest` may name its value on the axis so.
    """
    vary = vary_of(axis) or ""
    return "clearance" if vary.startswith("clearance") else vary if vary == "omega" else ""


def parameter_value(
    vary: str, omega: float, oscillator: Oscillator, clearance: float | ClearancePair, *at: str
) -> float:
    """Return the value of the parameter `vary` of a request, whose place is `at`. Raises where there is none."""
    both = as_pair(clearance)
    at = (*at, "axis", "vary")
    Parameters(oscillator, None, None, None).require(vary, *at)
    if vary in ("bias", "forcing"):
        return 1.0
    if is_structural(vary):
        return structure_value(oscillator, vary)
    if vary == "omega":
        return omega
    if vary.startswith("clearance"):
        value = both.left if vary == "clearance_left" else both.right
        if vary == "clearance" and both.right != both.left:
            raise invalid("vary is clearance, and the stops differ", "clearance_right or clearance_left", *at)
        if value is None:
            raise invalid(f"vary is {vary}, and there is no such stop", "the clearance of a stop", *at)
        return value
    right, left = restitutions(oscillator.restitution)
    if vary == "restitution" and right != left:
        raise invalid("vary is restitution, and the stops differ", "restitution_right or restitution_left", *at)
    return left if vary == "restitution_left" else right


_OfOrbit = Annotated[Float | None, Field(exclude_if=lambda value: value is None)]


class CurveMotion(OrbitMotion):
    """A motion whose curves are looked for, and the point of the window at which an orbit of it is known.

    Where the point is left out, an orbit is looked for at several points of the window. Phases and velocities are those
    of an orbit at one point, so they need it.
    """

    horizontal: _OfOrbit = None
    """Value of the horizontal parameter at an orbit of the motion, inside the window; left out: looked for."""
    vertical: _OfOrbit = None
    """Value of the vertical parameter at an orbit of the motion, inside the window; left out: looked for."""


# The window of the paper, for examples.
_PAPER = {
    "horizontal": {"vary": "omega", "values": {"start": 0.26, "stop": 0.3}},
    "vertical": {"vary": "clearance", "values": {"start": 1.3, "stop": 2.05}},
}
# The fields of a motion that say where it is, in both forms.
_PLACES = (*AXES, "omega", "clearance")


class BifurcationCurvesRequest(PlaneRequest):
    """Curves of saddle-nodes, period doublings, symmetry breakings and grazes of impacting motions in a window.

    The window is of omega and clearance, or of two other parameters, `horizontal` and `vertical`. Without `motions`:
    the curves of motions with one impact on one stop, and between symmetric stops of those with one on each, in up to
    `max_multiple` forcing periods; these curves start on the grazing curve, at its resonant points. Over omega and a
    clearance, the forces or the bias they are in closed form, at `points` frequencies; where the stops are not
    symmetric, the grazing curve of each stop is added. Over omega and a restitution they are continued. In other planes
    motions are required. With `motions`: the curves of these motions by continuation, with Neimark-Sacker curves.
    """

    operation = Operation(
        "bifurcation-curves",
        "submit_bifurcation_curves",
        "Compute the saddle-node (SN), period-doubling (PD), symmetry-breaking (SB), Neimark-Sacker (NS) and grazing "
        "(GR) curves of motions in a window of two parameters.",
        {
            "the paper's window": _PAPER,
            "of a motion": {
                **_PAPER,
                "motions": [{"period": 1, "stops": [1, 1, -1, -1], "horizontal": 0.28, "vertical": 1.5}],
            },
            "over the clearance of one stop": {
                **_PAPER,
                "vertical": {"vary": "clearance_right", "values": {"start": 1.3, "stop": 2.05}},
                "clearance": {"left": 2.1},
            },
            "over frequency and restitution": {
                **_PAPER,
                "vertical": {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9}},
                "clearance": 1.8,
                "max_multiple": 1,
            },
        },
    )

    horizontal: WindowAxis
    """The horizontal parameter of the window and its interval."""
    vertical: WindowAxis
    """The vertical parameter of the window and its interval."""
    max_multiple: Multiple = 2
    """Without `motions`: the maximum period of the motions whose curves are computed, in forcing periods."""
    points: Annotated[int, Field(ge=2, le=MAX_CURVE_POINTS), Listable] = 400
    """For curves in closed form: number of frequencies across the window; ends between two are solved for."""
    motions: Annotated[
        Annotated[list[CurveMotion], Field(min_length=1, max_length=16, fail_fast=True), Listable] | None, LeftOut
    ] = None
    """The motions whose curves are continued; left out: those with one impact, or one on each of symmetric stops."""

    @model_validator(mode="after")
    def _motions_in_window(self) -> BifurcationCurvesRequest:
        plane = self.plane
        over_restitution = "omega" in plane.names and any(name.startswith("restitution") for name in plane.names)
        if self.motions is None and not self.is_explicit and not over_restitution:
            detail = (
                "motions are missing: without them there are curves only over omega and one of clearance, forcing, "
                "bias and restitution"
            )
            raise invalid(detail, "the motions whose curves are continued", "motions")
        stops = plane.corners()[0].clearance
        for k, motion in enumerate(self.motions or ()):
            motion.require_period_of(self.oscillator, "motions", str(k))
            for name, axis in zip(AXES, (plane.horizontal, plane.vertical), strict=True):
                value, (start, stop) = getattr(motion, name), axis.ends
                if value is None and motion.phases is not None:
                    detail = f"phases are given, and {axis.vary} is missing"
                    raise invalid(detail, f"{axis.vary} of the orbit", "motions", str(k), name)
                if value is not None and not start <= value <= stop:
                    detail = f"{axis.vary} of a motion lies outside the window"
                    raise invalid(detail, f"within {axis.vary} of the request", "motions", str(k), name)
            motion.require_stops(stops, "motions", str(k))
        return self

    @classmethod
    def long_form(cls, values: Any) -> tuple[Any, Places]:
        """As `Request.long_form`; a motion may have omega and clearance instead of horizontal and vertical.

        Where both axes are clearances, "clearance" would name either of them: there it is no field of a motion.
        """
        body, places = super().long_form(values)
        motions = plain(body.get("motions")) if isinstance(body, dict) else None
        if not isinstance(motions, list):
            return body, places
        written = dict(places)
        short_names = [_short_name(body.get(axis)) for axis in AXES]
        pairs = zip(short_names, AXES, strict=True)
        names = {name: axis for name, axis in pairs if name and short_names.count(name) == 1}
        renamed = []
        for k, entry in enumerate(motions):
            # a value of the place may be null: not there
            motion = without_nulls(entry, _PLACES) if isinstance(entry, dict) else entry
            fields: list[str] = [*motion] if isinstance(motion, dict) else []
            here = {name: name if names.get(name) in fields else names.get(name, name) for name in fields}
            place: Place = ("motions", str(k))
            short = {axis: name for name, axis in names.items() if places or name in here}
            written |= {(*place, axis): (*place, name) for axis, name in short.items()}
            renamed.append({here[name]: value for name, value in motion.items()} if here else motion)
        return body | {"motions": renamed}, written

    @property
    def is_explicit(self) -> bool:
        """Whether the request is for curves in closed form."""
        others = [name for name in self.plane.names if name != "omega"]
        # these parameters change only how far the stops are from the motion
        return self.motions is None and len(others) == 1 and others[0].startswith(("bias", "clearance", "forcing"))

    @property
    def followed(self) -> list[CurveMotion]:
        """The motions whose curves are continued: `motions`, else those with one impact, or one on each stop.

        None where the curves are in closed form.
        """
        if self.motions is not None or self.is_explicit:
            return self.motions or []
        point = self.plane.corners()[0]
        ends: tuple[tuple[Stop, float | None], ...] = ((1, point.clearance.right), (-1, point.clearance.left))
        sides = [stop for stop, clearance in ends if clearance is not None]
        mirrors = self.plane.mirrors
        motions = []
        for period in range(1, self.max_multiple + 1):
            motions += [CurveMotion(period=period, stops=[stop]) for stop in (sides[:1] if mirrors else sides)]
            if mirrors and period % 2 == 1:
                motions.append(CurveMotion(period=period, stops=[1, -1]))
        return motions

    def unused(self) -> Collection[str]:
        """Return the names of the fields that these curves do not need."""
        if self.motions is not None:
            return ("max_multiple", "points")
        return () if self.is_explicit else ("points",)
