"""Bifurcation curves in the plane of omega and clearance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from grazemap.codec import Document
from grazemap.results.base import Result, floats
from grazemap.results.records import FloatArray, known_fields

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """A piece of a curve inside the window.

    Attributes
    ----------
    type : {"SN", "PD", "SB", "NS", "GR"}
        Saddle-node, period doubling, symmetry breaking, Neimark-Sacker; graze: a further contact appears, or the
        `impact` vanishes.
    motion : str
        n-p_r-q_l; the mirror images of motions with an impact on one stop have the same curves.
    period, impacts_right, impacts_left : int
    symmetric : bool
    admissible : bool
        The motions there touch a stop at their impacts only; otherwise the piece is no border of motions.
    stop : int
        Of a graze: +1 at stop A, -1 at C (of closed forms: of motions that strike A first); else 0.
    omega, clearance, impact_velocity : ndarray of shape (m,)
        Of several impacts the least speed, that of one that vanishes left out.
    ends : tuple of two str
        "window", "grazing", "admissible" (another piece goes on) or "none" (no such motions beyond); of curves that
        were continued also "closed", "real" (a pair of multipliers becomes real), "step", "singular" or "points".
    of_motion : int or None
        Of curves of motions asked for: the place of the motion in `motions`.
    stops : tuple of int, or None
    phases, velocities : ndarray of shape (m, k), or None
        Of such curves: all impacts; `orbit(i)` is a point of it as a question takes it.
    impact : int or None
        Number of the impact that vanishes.
    """

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
            The curve is a closed form, without phases.
        """
        if self.stops is None or self.phases is None or self.velocities is None:
            raise ValueError("curves in closed form have no phases: ask for their motions")
        motion = {
            "period": self.period,
            "stops": list(self.stops),
            "phases": self.phases[index].tolist(),
            "velocities": self.velocities[index].tolist(),
        }
        return {"omega": float(self.omega[index]), "clearance": float(self.clearance[index]), "motion": motion}


@dataclass(frozen=True, eq=False)
class FollowedMotion:
    """A motion whose curves were asked for.

    Attributes
    ----------
    period : int
    stops : tuple of int
    omega, clearance : float or None
        Where in the window the orbit is that the search began with; None: there is none.
    label : str or None
    admissible : bool
        That orbit is a motion.
    reason : str or None
        Why there is none.
    """

    period: int
    stops: tuple[int, ...]
    omega: float | None = None
    clearance: float | None = None
    label: str | None = None
    admissible: bool = False
    reason: str | None = None


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationCurves(Result):
    """Curves of special motions in a window of omega and clearance.

    Attributes
    ----------
    curves : tuple of BifurcationCurve
    motions : tuple of FollowedMotion
        Those asked for, in order; none where closed forms were.
    """

    process: ClassVar[str] = "bifurcation-curves"

    curves: tuple[BifurcationCurve, ...]
    motions: tuple[FollowedMotion, ...]

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        return {
            "curves": tuple(_curve(record) for record in document["curves"]),
            "motions": tuple(_motion(record) for record in document["motions"]),
        }

    def plot(self, ax: Axes | None = None, *, admissible: bool = True) -> Axes:
        """Draw the curves; with `admissible` those only that are borders of motions."""
        from grazemap.plots.borders import plot_bifurcation_curves

        return plot_bifurcation_curves(self, ax, admissible)

    def _summary(self) -> str:
        lost = sum(motion.reason is not None for motion in self.motions)
        return f"{len(self.curves)} pieces of curves" + (f", {lost} motions not found" if lost else "")


def _curve(record: Any) -> BifurcationCurve:
    values = known_fields(BifurcationCurve, record)
    names = ("omega", "clearance", "impact_velocity", "phases", "velocities")
    arrays = {name: floats(values[name]) for name in names if values.get(name) is not None}
    stops = {"stops": tuple(int(stop) for stop in values["stops"])} if values.get("stops") is not None else {}
    return BifurcationCurve(**(values | arrays | stops | {"ends": tuple(str(end) for end in values["ends"])}))


def _motion(record: Any) -> FollowedMotion:
    values = known_fields(FollowedMotion, record)
    return FollowedMotion(**(values | {"stops": tuple(int(stop) for stop in values["stops"])}))
