"""Unfolding maps: which motion each point of a rectangle of (omega, clearance) settles to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.results.base import Result, floats, integers
from grazemap.results.records import FloatArray, IntArray, MotionShare
from grazemap.wire import motion_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results.curves import BifurcationCurves
    from grazemap.results.grazing import CodimensionTwoPoints, GrazingCurve


@dataclass(frozen=True, eq=False, repr=False)
class UnfoldingMap(Result):
    """The motion that each point of a rectangle of (omega, clearance) settles to.

    Attributes
    ----------
    omega : ndarray of shape (omega,)
    clearance : ndarray of shape (clearance,)
    kind : ndarray of int, shape (clearance, omega)
        Index into `kinds`.
    kinds : tuple of str
    period, impacts_right, impacts_left : ndarray of int, shape (clearance, omega)
        The label n-p_r-q_l; it counts only where the kind is "periodic". -1: the stop is not touched, -2: infinitely
        many impacts, in complete chatter.
    symmetric : ndarray of bool, shape (clearance, omega)
    sticking : ndarray of bool, shape (clearance, omega)
        Whether mass 1 rests on a stop some time in the period.
    least_impact_velocity : ndarray of shape (clearance, omega)
        NaN where the motion has no impacts or is not periodic.
    settled_after : ndarray of int, shape (clearance, omega)
        Forcing periods; -1 where the motion is not periodic.
    certified : ndarray of bool, shape (clearance, omega)
        Whether a periodic motion is proven: its orbit was solved for and is the only one nearby, a motion, and stable.
    reason : ndarray of int, shape (clearance, omega)
        Index into `reasons`: why a motion is unresolved, or is periodic and not certified.
    reasons : tuple of str
    multiplier : ndarray of shape (clearance, omega), or None
        Largest modulus of the multipliers over one motion period; NaN where the motion is not periodic. Of a preview it
        is None, and so are the next two.
    lyapunov : ndarray of shape (clearance, omega), or None
        Largest Lyapunov exponent per forcing period; NaN where it is not known.
    lyapunov_error : ndarray of shape (clearance, omega), or None
        Standard error of an exponent that was measured along the trajectory; NaN for others.
    computed : ndarray of bool, shape (clearance, omega), or None
        Of an adaptive map: where the motion was computed. Elsewhere kind, reason, label, symmetric and sticking are
        inferred from the points around, and all figures are NaN, or -1. None: every point was computed.
    share : ndarray of shape (clearance, omega), or None
        Of an ensemble: of the initial states, those that lead to this motion or its mirror image.
    motions_found : ndarray of int, shape (clearance, omega), or None
        Of an ensemble: how many different motions were found, mirror images counted once.
    """

    process: ClassVar[str] = "unfolding-maps"
    NOT_ALWAYS: ClassVar[tuple[str, ...]] = ("multiplier", "lyapunov", "lyapunov_error", "share", "motions_found")

    omega: FloatArray
    clearance: FloatArray
    kind: IntArray
    kinds: tuple[str, ...]
    period: IntArray
    impacts_right: IntArray
    impacts_left: IntArray
    symmetric: NDArray[np.bool_]
    sticking: NDArray[np.bool_]
    least_impact_velocity: FloatArray
    settled_after: IntArray
    certified: NDArray[np.bool_]
    reason: IntArray
    reasons: tuple[str, ...]
    multiplier: FloatArray | None = None
    lyapunov: FloatArray | None = None
    lyapunov_error: FloatArray | None = None
    share: FloatArray | None = None
    motions_found: IntArray | None = None
    computed: NDArray[np.bool_] | None = None

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        if "computed" not in document:
            return cls._of_grid(document, integers)
        computed = np.asarray(document["computed"], dtype=np.bool_)
        figures = {name: _spread(values, computed) for name, values in document["at_computed"].items()}
        return cls._of_grid({**document, **figures}, _small_integers) | {"computed": computed}

    @classmethod
    def _of_grid(cls, document: Document, integers: Callable[[Any], NDArray[Any]]) -> dict[str, Any]:
        whole = ("kind", "period", "impacts_right", "impacts_left", "settled_after", "reason")
        figures = ("omega", "clearance", "least_impact_velocity")
        not_always = {
            name: integers(document[name]) if name == "motions_found" else floats(document[name])
            for name in cls.NOT_ALWAYS
            if name in document
        }
        return {
            **not_always,
            **{name: floats(document[name]) for name in figures},
            **{name: integers(document[name]) for name in whole},
            **{name: tuple(str(text) for text in document[name]) for name in ("kinds", "reasons")},
            **{name: np.asarray(document[name], dtype=np.bool_) for name in ("symmetric", "sticking", "certified")},
        }

    @property
    def preview(self) -> bool:
        """Whether motions were told by their returns alone."""
        return bool(self.meta["request"].get("preview"))

    def motions(self) -> list[MotionShare]:
        """Return the motions of the map, those that cover most of it first."""
        labels = [self.kind, self.period, self.impacts_right, self.impacts_left]
        # neighbours are mostly alike: only where runs of equal ones begin have labels to be sorted
        begins = np.ones(self.kind.size, dtype=np.bool_)
        begins[1:] = np.any([label.ravel()[1:] != label.ravel()[:-1] for label in labels], axis=0)
        starts = np.flatnonzero(begins)
        codes = np.stack([label.ravel()[starts] for label in labels], axis=-1)
        codes[codes[:, 0] != self._code("periodic"), 1:] = 0
        found, places = np.unique(codes, axis=0, return_inverse=True)
        lengths = np.diff(starts, append=self.kind.size)
        counts = np.bincount(places.ravel(), weights=lengths).astype(np.int64)
        shares = [
            self._share(code, pixels, self.kind.size)
            for code, pixels in zip(found.tolist(), counts.tolist(), strict=True)
        ]
        return sorted(shares, key=lambda motion: (-motion.pixels, motion.label))

    def labels(self) -> NDArray[np.str_]:
        """Return the label of every point, shape (clearance, omega)."""
        text = np.full(self.kind.shape, "", dtype="<U32")
        for motion in self.motions():
            text[self.mask(motion)] = motion.label
        return text

    def mask(self, motion: MotionShare) -> NDArray[np.bool_]:
        """Return where a motion is, shape (clearance, omega)."""
        there: NDArray[np.bool_] = self.kind == self._code(motion.kind)
        if motion.period is not None:
            there &= (self.period == motion.period) & (self.impacts_right == motion.impacts_right)
            there &= self.impacts_left == motion.impacts_left
        return there

    def plot(
        self,
        ax: Axes | None = None,
        *,
        curve: GrazingCurve | None = None,
        points: CodimensionTwoPoints | None = None,
        curves: BifurcationCurves | None = None,
        motions: int = 20,
    ) -> Axes:
        """Draw the regions of the motions with a legend, and the curves and codimension-two points that are given."""
        from grazemap.plots.unfolding import plot_unfolding_map

        return plot_unfolding_map(self, ax, curve, points, motions, curves)

    def plot_computed(self, ax: Axes | None = None) -> Axes:
        """Draw which points of an adaptive map were computed. Raises ValueError of another map."""
        from grazemap.plots.unfolding import plot_computed

        return plot_computed(self, ax)

    def _code(self, kind: str) -> int:
        return self.kinds.index(kind) if kind in self.kinds else -1

    def _share(self, code: list[int], pixels: int, total: int) -> MotionShare:
        kind, period, right, left = code
        name = self.kinds[kind]
        if name != "periodic":
            return MotionShare(name, name, None, None, None, pixels, pixels / total)
        return MotionShare(motion_label(period, right, left), name, period, right, left, pixels, pixels / total)

    def _summary(self) -> str:
        computed = "" if self.computed is None else f" ({self.computed.mean():.1%} computed)"
        periodic = self.kind == self._code("periodic")
        share = self.certified[periodic].mean() if periodic.any() else 1.0
        points = f"{len(self.clearance)} x {len(self.omega)} points{computed}"
        certified = f"{share:.1%} of the periodic points certified"
        return f"{points}, {len(self.motions())} motions, {'a preview' if self.preview else certified}"


def _small_integers(value: Any) -> NDArray[Any]:
    """Return whole numbers in no more than four bytes: adaptive maps are large."""
    values = np.asarray(value)
    return values if values.dtype.itemsize <= 4 else values.astype(np.int32)


def _spread(values: Any, computed: NDArray[np.bool_]) -> NDArray[Any]:
    """Return an array of the grid from the figures of its computed points, in the order of its rows."""
    figures = np.asarray(values)
    if figures.dtype.kind not in "ib":
        figures = floats(values)
    nothing: Any = {"f": np.nan, "i": -1, "b": False}[figures.dtype.kind]
    whole = np.full(computed.shape, nothing, dtype=figures.dtype)
    whole[computed] = figures
    return whole
