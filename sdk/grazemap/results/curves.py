"""Bifurcation curves in the plane of omega and clearance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from grazemap.results.base import Result, counted
from grazemap.results.records import FloatArray, described
from grazemap.schema.curves import CURVE, FOLLOWED_MOTION

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.plots.axes import LegendPlace


@described(CURVE)
class BifurcationCurve:
    """A piece of a curve inside the window."""

    type: str
    motion: str
    period: int
    impacts_right: int
    impacts_left: int
    symmetric: bool
    admissible: bool
    stop: int
    omega: FloatArray
    clearance: FloatArray
    impact_velocity: FloatArray
    ends: tuple[str, ...]
    of_motion: int | None = None
    impact: int | None = None
    stops: tuple[int, ...] | None = None
    phases: FloatArray | None = None
    velocities: FloatArray | None = None

    def orbit(self, index: int) -> dict[str, Any]:
        """Return a point of a continued curve as the omega, clearance and motion of `periodic_orbit`.

        Raises
        ------
        ValueError
            The curve is in closed form, without phases.
        """
        if self.stops is None or self.phases is None or self.velocities is None:
            raise ValueError("curves in closed form have no phases: request the curves of their motions")
        lists = {"phases": self.phases[index].tolist(), "velocities": self.velocities[index].tolist()}
        motion = {"period": self.period, "stops": list(self.stops), **lists}
        return {"omega": float(self.omega[index]), "clearance": float(self.clearance[index]), "motion": motion}


@described(FOLLOWED_MOTION)
class FollowedMotion:
    """A motion whose curves were requested."""

    period: int
    stops: tuple[int, ...]
    omega: float | None = None
    clearance: float | None = None
    label: str | None = None
    admissible: bool = False
    reason: str | None = None


class BifurcationCurves(Result):
    """Curves of special motions in a window of omega and clearance."""

    curves: tuple[BifurcationCurve, ...]
    motions: tuple[FollowedMotion, ...]

    def plot(
        self,
        ax: Axes | None = None,
        *,
        admissible: bool = True,
        legend: LegendPlace | None = None,
        labels: bool = True,
    ) -> Axes:
        """Draw the curves; with `admissible` only those of admissible motions."""
        from grazemap.plots.axes import drawing
        from grazemap.plots.borders import plot_bifurcation_curves

        return plot_bifurcation_curves(self, drawing(ax, legend, labels), admissible)

    def _summary(self) -> str:
        lost = [motion for motion in self.motions if motion.reason is not None]
        return counted(self.curves, "piece") + " of curves" + (f", {counted(lost, 'motion')} not found" if lost else "")
