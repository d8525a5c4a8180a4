"""Grazing curves and their codimension-two points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from grazemap.codec import Document
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import CodimensionTwoPoint, FloatArray, IntArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def _points(document: Document) -> tuple[CodimensionTwoPoint, ...]:
    return tuple(CodimensionTwoPoint.from_record(record) for record in document["points"])


@dataclass(frozen=True, eq=False, repr=False)
class GrazingCurve(Result):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19)).

    Attributes
    ----------
    omega, clearance : ndarray of shape (points,)
        rad/s and m in SI.
    phase : ndarray of shape (points,)
        Phase of the forcing at the contact with stop A, in (-pi, pi].
    first_recurrence : ndarray of int, shape (points,)
        The first half period after which the graze recurs; 0: none up to the order asked for.
    recurrence_stop : ndarray of int, shape (points,)
        The stop of that recurrence: +1 A, -1 C; 0: none.
    points : tuple of CodimensionTwoPoint
        The codimension-two points inside the range.
    xi : ndarray of shape (points, max_order) or None
        xi_m for m = 1 .. max_order of a graze at A, equations (33)-(40), where the sequence was asked for: an impact
        recurs at the first m with (-1)^m xi_m < 0.
    """

    process: ClassVar[str] = "grazing-curves"

    omega: FloatArray
    clearance: FloatArray
    phase: FloatArray
    first_recurrence: IntArray
    recurrence_stop: IntArray
    points: tuple[CodimensionTwoPoint, ...]
    xi: FloatArray | None = None

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        return {
            "xi": floats(document["xi"]) if "xi" in document else None,
            **{name: floats(document[name]) for name in ("omega", "clearance", "phase")},
            **{name: integers(document[name]) for name in ("first_recurrence", "recurrence_stop")},
            "points": _points(document),
        }

    def plot(self, ax: Axes | None = None, *, points: CodimensionTwoPoints | None = None) -> Axes:
        """Draw clearance over omega with the codimension-two points (its own ones, or `points`)."""
        from grazemap.plots.curve import plot_grazing_curve

        return plot_grazing_curve(self, ax, points)

    def _summary(self) -> str:
        return f"{len(self.omega)} values of omega, {len(self.points)} codimension-two points"


@dataclass(frozen=True, eq=False, repr=False)
class CodimensionTwoPoints(Result):
    """Every codimension-two point of the grazing curve over an interval of omega.

    Attributes
    ----------
    points : tuple of CodimensionTwoPoint
        In increasing omega, as the service sends them.
    """

    process: ClassVar[str] = "codimension-two-points"

    points: tuple[CodimensionTwoPoint, ...]

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        return {"points": _points(document)}

    def plot(self, ax: Axes | None = None, *, curve: GrazingCurve | None = None) -> Axes:
        """Draw the points in the plane of omega and clearance, on a grazing curve if one is given."""
        from grazemap.plots.curve import plot_codimension_two_points

        return plot_codimension_two_points(self, ax, curve)

    def plot_unfolding(self, ax: Axes | None = None, *, omega: tuple[float, float] | None = None) -> Axes:
        """Draw what leaves the grazing curve at the resonant points, to leading order, against the curve itself.

        `omega` is the interval drawn; left out: that of the request.
        """
        from grazemap.plots.resonance import plot_local_unfolding

        return plot_local_unfolding(self, ax, omega)

    def _summary(self) -> str:
        recurrences = sum(point.kind == "recurrence" for point in self.points)
        return f"{recurrences} recurrence and {len(self.points) - recurrences} resonant points"
