"""Basins of attraction: which motion every initial state of a rectangle leads to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from grazemap.codec import Document
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import FloatArray, IntArray, MotionShare, known_fields

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, slots=True)
class Attractor:
    """A motion that initial states lead to.

    Attributes
    ----------
    kind : {"periodic", "quasi-periodic", "chaotic"}
        Motions that are not periodic are not told apart further: one entry per kind.
    label : str or None
        n-p_r-q_l of a periodic one, as plain text.
    period, impacts_right, impacts_left : int or None
    symmetric, sticking : bool or None
    mean_position, mean_velocity : float or None
        Of mass 1 where the forcing has its initial phase, less the steady motion, in units of the clearance and of
        omega times it: these tell motions with the same label apart.
    multiplier, lyapunov : float or None
        Largest multiplier over one period, of a periodic one; largest exponent per forcing period, where it is known.
    certified : bool
        Whether a periodic motion is proven, from every state that leads to it.
    states : int
        Initial states that lead to it.
    share : float
        The same over all states.
    """

    kind: str
    states: int
    share: float
    label: str | None = None
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    mean_position: float | None = None
    mean_velocity: float | None = None
    multiplier: float | None = None
    lyapunov: float | None = None
    certified: bool = False

    @property
    def motion(self) -> MotionShare:
        """As a motion and its share, for pictures and legends."""
        counts = (self.period, self.impacts_right, self.impacts_left)
        return MotionShare(self.label or self.kind, self.kind, *counts, self.states, self.share)


@dataclass(frozen=True, eq=False, repr=False)
class Basins(Result):
    """The motion that every initial state of a rectangle leads to, at one point of the plane of omega and clearance.

    Attributes
    ----------
    horizontal, vertical : ndarray of shape (m,) and (n,)
        The values of the two initial coordinates.
    label : ndarray of int, shape (n, m), [vertical, horizontal]
        Position in `attractors`; -1 where the motion is unresolved.
    attractors : tuple of Attractor
        The most frequent first.
    settled_after : ndarray of int, shape (n, m)
        Forcing periods; -1 where the motion is not periodic.
    lyapunov : ndarray of shape (n, m)
        Largest exponent per forcing period; NaN where it is not known.
    reason : ndarray of int, shape (n, m)
        Index into `reasons`: why a state is unresolved.
    reasons : tuple of str
    """

    process: ClassVar[str] = "basins"

    horizontal: FloatArray
    vertical: FloatArray
    label: IntArray
    attractors: tuple[Attractor, ...]
    settled_after: IntArray
    lyapunov: FloatArray
    reason: IntArray
    reasons: tuple[str, ...]

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        return {
            **{name: floats(document[name]) for name in ("horizontal", "vertical", "lyapunov")},
            **{name: integers(document[name]) for name in ("label", "settled_after", "reason")},
            "reasons": tuple(str(reason) for reason in document["reasons"]),
            "attractors": tuple(Attractor(**known_fields(Attractor, record)) for record in document["attractors"]),
        }

    @property
    def unresolved(self) -> float:
        """Share of the states whose motion could not be named."""
        return float((self.label < 0).mean())

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the rectangle, every state in the colour of the motion that it leads to."""
        from grazemap.plots.basins import plot_basins

        return plot_basins(self, ax)

    def _summary(self) -> str:
        rows, columns = self.label.shape
        return f"{rows} x {columns} states, {len(self.attractors)} attractors"
