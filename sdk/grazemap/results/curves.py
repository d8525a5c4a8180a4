"""Bifurcation curves in the plane of omega and clearance, or of two other parameters."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from grazemap.results.base import Result, counted
from grazemap.results.common_records import BIFURCATIONS, Common
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, FloatArray, Record, field
from grazemap.wire import BifurcationCurvesRequest
from grazemap.wire.planes import Plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_CONTINUED = "of continued curves"
_ORBIT_FOUND = "where an orbit was found"
_RANGE_WINDOWS, _AXIS_WINDOWS = "of windows of omega and clearance", "of windows with axes"
_VARIED_CLEARANCE = "Clearance: of both stops, or of the stop that varies."
_ONE_VARIES = f"of continued curves {_RANGE_WINDOWS}, where the clearance of one stop varies"


class PlaneCurve(Record):
    """Base of the curves of a plane."""

    type: str = field("Saddle-node, period doubling, symmetry breaking, Neimark-Sacker or graze.", values=BIFURCATIONS)
    motion: str = field("Name n-p_r-q_l of the motion that ends there, as plain text, for example 1-2r-2l.")
    period: int = field(Common)
    impacts_right: int = field(Common)
    impacts_left: int = field(Common)
    symmetric: bool = field(Common)
    omega: FloatArray | None = field(Common, "point", when=_RANGE_WINDOWS)
    clearance: FloatArray | None = field(Common, "point", when=_RANGE_WINDOWS, description=_VARIED_CLEARANCE)
    horizontal: FloatArray | None = field("Values of the horizontal parameter.", "point", when=_AXIS_WINDOWS)
    vertical: FloatArray | None = field("Values of the vertical parameter.", "point", when=_AXIS_WINDOWS)
    ends: tuple[str, ...] = field(
        "The reason for each end: window, grazing (the curve meets the grazing curve), admissible (the admissibility "
        "changes), none (no such motions beyond), undecided (round-off hides whether the next orbit is admissible); "
        "for continued curves also closed, real (two multipliers become real), step (impacts coincide, or orbits are "
        "not smooth), singular (curves meet), points (their maximum number).",
        "end",
        variable=None,
    )

    @property
    def line(self) -> FloatArray:
        """The horizontal and the vertical values, shape (points, 2): omega and clearance unless there are axes."""
        names = ("omega", "clearance") if self.horizontal is None else ("horizontal", "vertical")
        return np.stack([getattr(self, name) for name in names], axis=1)


class BifurcationCurve(PlaneCurve):
    """A piece of a curve inside the window."""

    admissible: bool = field(
        Common, description="Whether the orbits are admissible; otherwise the piece borders no region of a motion."
    )
    stop: int = field("Stop of a graze: +1 right, -1 left; 0 for other types.")
    # fields of the base are declared again for their order
    omega: FloatArray | None = field(PlaneCurve)
    clearance: FloatArray | None = field(PlaneCurve)
    horizontal: FloatArray | None = field(PlaneCurve)
    vertical: FloatArray | None = field(PlaneCurve)
    impact_velocity: FloatArray = field("Lowest speed of the impacts, except of one that vanishes.", "point", "m/s")
    stable_beside: BoolArray = field(
        "Whether the motion is stable on one side of the curve: all multipliers but those of the type are inside the "
        "unit circle. At a graze, the motion without the contact.",
        "point",
    )
    ends: tuple[str, ...] = field(PlaneCurve)
    of_motion: int | None = field("Position of the motion in `motions`.", when=_CONTINUED)
    impact: int | None = field("Index, from 0, of the impact that vanishes.", when="of grazes where an impact vanishes")
    stops: tuple[int, ...] | None = field(
        "Stops of all impacts: +1 right, -1 left.", "impact", when=_CONTINUED, variable=None
    )
    clearance_right: FloatArray | None = field(
        "Clearance of the right stop, null if there is none.", "point", "m", when=_ONE_VARIES, null=True, variable=None
    )
    clearance_left: FloatArray | None = field(
        "Clearance of the left stop, null if there is none.", "point", "m", when=_ONE_VARIES, null=True, variable=None
    )
    phases: FloatArray | None = field(
        "Phases omega t of the impacts.", "point impact", "rad", when=_CONTINUED, variable=None
    )
    velocities: FloatArray | None = field(
        "Impact velocities, signed.", "point impact", "m/s", when=_CONTINUED, variable=None
    )

    def motion_at(self, index: int) -> dict[str, Any]:
        """Return the motion at a point of a continued curve, as `periodic_orbit` takes it.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases.
        """
        if self.stops is None or self.phases is None or self.velocities is None:
            raise ValueError("curves in closed form have no phases: name their motions in the request")
        lists = {"phases": self.phases[index].tolist(), "velocities": self.velocities[index].tolist()}
        return {"period": self.period, "stops": list(self.stops), **lists}

    def orbit(self, index: int) -> dict[str, Any]:
        """Return a point of a continued curve as the omega, clearance and motion of `periodic_orbit`.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases; or its window has axes.
        """
        motion = self.motion_at(index)
        if self.omega is None or self.clearance is None:
            raise ValueError(
                "other parameters than omega and clearance vary: use BifurcationCurves.orbit(curve, index)"
            )
        clearance: Any = float(self.clearance[index])
        if self.clearance_right is not None and self.clearance_left is not None:
            both = {"right": float(self.clearance_right[index]), "left": float(self.clearance_left[index])}
            clearance = {name: None if math.isnan(gap) else gap for name, gap in both.items()}
        return {"omega": float(self.omega[index]), "clearance": clearance, "motion": motion}


class FollowedMotion(Record):
    """A motion whose curves are continued, and the orbit from which the search started."""

    period: int = field(Common)
    stops: tuple[int, ...] = field("Stops of its impacts: +1 right, -1 left.", "impact", variable=None)
    omega: float | None = field(Common, when=f"{_RANGE_WINDOWS}, {_ORBIT_FOUND}")
    clearance: float | None = field(Common, when=f"{_RANGE_WINDOWS}, {_ORBIT_FOUND}", description=_VARIED_CLEARANCE)
    horizontal: float | None = field("Value of the horizontal parameter.", when=f"{_AXIS_WINDOWS}, {_ORBIT_FOUND}")
    vertical: float | None = field("Value of the vertical parameter.", when=f"{_AXIS_WINDOWS}, {_ORBIT_FOUND}")
    label: str | None = field("The name n-p_r-q_l as plain text.", when=_ORBIT_FOUND)
    admissible: bool = field(Common)
    reason: str | None = field("Why no orbit was found.", when="where no orbit was found")


class BifurcationCurves(Result, process="bifurcation-curves"):
    """Bifurcation curves in a window of omega and clearance, or of two other parameters."""

    curves: tuple[BifurcationCurve, ...] = field("The pieces inside the window.", "curve", prefix="curve_")
    motions: tuple[FollowedMotion, ...] = field(
        "The motions whose curves are continued, in order; none for curves in closed form.", "motion", variable=None
    )

    @property
    def plane(self) -> Plane:
        """The two parameters with the ends of their intervals, and the values of the fixed parameters."""
        return self._plane

    @cached_property
    def _plane(self) -> Plane:
        return BifurcationCurvesRequest.model_validate(self.meta["request"]).plane

    @property
    def parameters(self) -> tuple[str, str]:
        """The names of the horizontal and of the vertical parameter, for example "omega" and "clearance"."""
        return self.plane.names

    @property
    def varied_stop(self) -> str | None:
        """The stop whose clearance varies, "right" or "left"; None if the clearance of both varies, or of none."""
        varied = [name for name in self.parameters if name in ("clearance_right", "clearance_left")]
        return varied[0].removeprefix("clearance_") if len(varied) == 1 else None

    def orbit(self, curve: BifurcationCurve, index: int) -> dict[str, Any]:
        """Return a point of a continued curve as keywords of `periodic_orbit`, in any plane.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases.
        """
        motion = curve.motion_at(index)
        parameters = self.plane.parameters.at(dict(zip(self.parameters, curve.line[index].tolist(), strict=True)))
        place = {"omega": parameters.omega, "clearance": parameters.clearance.model_dump()}
        return {"oscillator": parameters.oscillator.model_dump(), **place, "motion": motion}

    @picture
    def plot(self, ax: Axes | None = None, *, admissible: bool = True, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the curves; with `admissible` only those of admissible motions."""
        return draw(self, ax, options, admissible=admissible)

    def _summary(self) -> str:
        not_found = [motion for motion in self.motions if motion.reason is not None]
        text = counted(self.curves, "piece") + " of curves"
        return text + (f", {counted(not_found, 'motion')} not found" if not_found else "")
