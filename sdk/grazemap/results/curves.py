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
    type : {"SN", "PD", "SB", "GR"}
        Saddle-node, period doubling, symmetry breaking; graze: a further contact appears.
    motion : str
        n-p_r-q_l; the mirror images of motions with an impact on one stop have the same curves.
    period, impacts_right, impacts_left : int
    symmetric : bool
    admissible : bool
        The motions there touch a stop at their impacts only; otherwise the piece is no border of motions.
    stop : int
        Of a graze: +1 where the further contact is with a stop that is struck first, -1 with the other one; else 0.
    omega, clearance, impact_velocity : ndarray of shape (m,)
    ends : tuple of two str
        "window", "grazing", "admissible" (another piece goes on) or "none" (no such motions beyond).
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


@dataclass(frozen=True, eq=False, repr=False)
class BifurcationCurves(Result):
    """Curves of special motions in a window of omega and clearance.

    Attributes
    ----------
    curves : tuple of BifurcationCurve
    """

    process: ClassVar[str] = "bifurcation-curves"

    curves: tuple[BifurcationCurve, ...]

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        return {"curves": tuple(_curve(record) for record in document["curves"])}

    def plot(self, ax: Axes | None = None, *, admissible: bool = True) -> Axes:
        """Draw the curves; with `admissible` those only that are borders of motions."""
        from grazemap.plots.borders import plot_bifurcation_curves

        return plot_bifurcation_curves(self, ax, admissible)

    def _summary(self) -> str:
        return f"{len(self.curves)} pieces of curves"


def _curve(record: Any) -> BifurcationCurve:
    values = known_fields(BifurcationCurve, record)
    arrays = {name: floats(values[name]) for name in ("omega", "clearance", "impact_velocity")}
    return BifurcationCurve(**(values | arrays | {"ends": tuple(str(end) for end in values["ends"])}))
