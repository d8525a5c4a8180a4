"""Bifurcation curves in the plane of omega and clearance, or of two other parameters."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from grazemap.results.base import Result, counted
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import FloatArray, described
from grazemap.schema.curves import CURVE, FOLLOWED_MOTION
from grazemap.wire import BifurcationCurvesRequest
from grazemap.wire.planes import Plane

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class PlaneCurve:
    """Base of the curves of a plane."""

    __slots__ = ()

    @property
    def line(self) -> FloatArray:
        """The horizontal and the vertical values, shape (points, 2): omega and clearance unless there are axes."""
        names = ("omega", "clearance") if self.horizontal is None else ("horizontal", "vertical")  # type: ignore[attr-defined]
        return np.stack([getattr(self, name) for name in names], axis=1)


@described(CURVE)
class BifurcationCurve(PlaneCurve):
    """A piece of a curve inside the window."""

    type: str
    motion: str
    period: int
    impacts_right: int
    impacts_left: int
    symmetric: bool
    admissible: bool
    stop: int
    impact_velocity: FloatArray
    ends: tuple[str, ...]
    omega: FloatArray | None = None
    clearance: FloatArray | None = None
    horizontal: FloatArray | None = None
    vertical: FloatArray | None = None
    of_motion: int | None = None
    impact: int | None = None
    stops: tuple[int, ...] | None = None
    phases: FloatArray | None = None
    velocities: FloatArray | None = None
    clearance_right: FloatArray | None = None
    clearance_left: FloatArray | None = None

    def motion_at(self, index: int) -> dict[str, Any]:
        """Return the motion at a point of a continued curve, as `periodic_orbit` takes it.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases.
        """
        if self.stops is None or self.phases is None or self.velocities is None:
            raise ValueError("curves in closed form have no phases: request the curves of their motions")
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
            clearance = {name: None if math.isnan(one) else one for name, one in both.items()}
        return {"omega": float(self.omega[index]), "clearance": clearance, "motion": motion}


@described(FOLLOWED_MOTION)
class FollowedMotion:
    """A motion whose curves are continued."""

    period: int
    stops: tuple[int, ...]
    omega: float | None = None
    clearance: float | None = None
    horizontal: float | None = None
    vertical: float | None = None
    label: str | None = None
    admissible: bool = False
    reason: str | None = None


class BifurcationCurves(Result):
    """Curves of special motions in a window of omega and clearance, or of two other parameters."""

    curves: tuple[BifurcationCurve, ...]
    motions: tuple[FollowedMotion, ...]

    @property
    def plane(self) -> Plane:
        """The two parameters with the ends of their intervals, and the others."""
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
        """The stop whose clearance varies, "right" or "left"; None: that of both, or none."""
        named = [name for name in self.parameters if name in ("clearance_right", "clearance_left")]
        return named[0].removeprefix("clearance_") if len(named) == 1 else None

    def orbit(self, curve: BifurcationCurve, index: int) -> dict[str, Any]:
        """Return a point of a continued curve as keywords of `periodic_orbit`, in any plane.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases.
        """
        motion = curve.motion_at(index)
        there = self.plane.parameters.at(dict(zip(self.parameters, curve.line[index].tolist(), strict=True)))
        place = {"omega": there.omega, "clearance": there.clearance.model_dump()}
        return {"oscillator": there.oscillator.model_dump(), **place, "motion": motion}

    @picture
    def plot(self, ax: Axes | None = None, *, admissible: bool = True, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the curves; with `admissible` only those of admissible motions."""
        return draw(self, ax, options, admissible=admissible)

    def _summary(self) -> str:
        lost = [motion for motion in self.motions if motion.reason is not None]
        return counted(self.curves, "piece") + " of curves" + (f", {counted(lost, 'motion')} not found" if lost else "")
