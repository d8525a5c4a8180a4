"""Unfolding maps: which motion each point of a rectangle of (omega, clearance) settles to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.colours import colours_of_map
from grazemap.results.base import Result, counted, counted_points, outside
from grazemap.results.curves import BifurcationCurves
from grazemap.results.grazing import CodimensionTwoPoints, GrazingCurve
from grazemap.results.records import (
    RECORDS,
    BoolArray,
    ChanceToSettle,
    FloatArray,
    InferredWrong,
    IntArray,
    MotionShare,
    Verifiable,
)
from grazemap.schema.maps import AT_COMPUTED
from grazemap.schema.motions import motions_of
from grazemap.wire import motion_label
from grazemap.wire.job import INFINITE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.plots.axes import LegendPlace


@dataclass(frozen=True, slots=True)
class MapPoint:
    """One point of an unfolding map.

    Attributes
    ----------
    omega, clearance : float
        The point of the grid.
    label, kind : str
        n-p_r-q_l as plain text, or the name of the kind for a motion that is not periodic; and the kind.
    verified : bool
    reason : str
        Why the motion is unresolved, or periodic and not verified; else empty.
    computed : bool
        False: inferred from the points around it.
    omega_offset, clearance_offset : float
        This point minus the place that was asked for: at most half a step of the grid.
    request : dict or None
        The keywords with which `client.periodic_orbit` computes the orbit. None for a motion that is not periodic, and
        unless the map's trajectories start at rest.
    """

    omega: float
    clearance: float
    label: str
    kind: str
    verified: bool
    reason: str
    computed: bool
    omega_offset: float
    clearance_offset: float
    request: dict[str, Any] | None


class UnfoldingMap(Verifiable, Result):
    """The motion that each point of a rectangle of (omega, clearance) settles to."""

    omega: FloatArray
    clearance: FloatArray
    kind: IntArray
    kinds: tuple[str, ...]
    period: IntArray
    impacts_right: IntArray
    impacts_left: IntArray
    symmetric: BoolArray
    sticking: BoolArray
    least_impact_velocity: FloatArray
    settled_after: IntArray
    verified: BoolArray
    reason: IntArray
    reasons: tuple[str, ...]
    multiplier: FloatArray | None = None
    lyapunov: FloatArray | None = None
    lyapunov_error: FloatArray | None = None
    sensitive: BoolArray | None = None
    transient_growth: FloatArray | None = None
    share: FloatArray | None = None
    motions_found: IntArray | None = None
    computed: BoolArray | None = None
    resolved: BoolArray | None = None
    inferred_wrong: InferredWrong | None = None
    chance_to_settle: ChanceToSettle | None = None

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        whole = super()._attributes(document, meta)
        figures = whole.pop("at_computed")
        if figures is None:
            return whole
        # an adaptive map is large
        whole = {name: _small(value) if isinstance(value, np.ndarray) else value for name, value in whole.items()}
        return whole | {name: _spread(values, whole["computed"]) for name, values in figures.items()}

    @property
    def preview(self) -> bool:
        """Whether only periodic motions are identified."""
        return bool(self.meta["request"].get("preview"))

    @property
    def inferred(self) -> BoolArray:
        """Where points are inferred from their neighbours, not computed: nowhere unless the map is adaptive."""
        return np.zeros(self.kind.shape, dtype=np.bool_) if self.computed is None else ~self.computed

    def motions(self, *, merge_mirror_images: bool = False) -> list[MotionShare]:
        """Return the motions of the map, the largest share first.

        With `merge_mirror_images` n-p_r-q_l and n-q_r-p_l are one motion, with the label that has more impacts on the
        right: the machine is symmetric, so there is the mirror image of every motion.
        """
        shares, _ = self._coded()
        return _merged(shares, self.kind.size) if merge_mirror_images else shares

    def colours(self) -> dict[str, str]:
        """Return the colours #RRGGBB of the map's picture by label or kind, for `colours=` of another picture."""
        return {motion.label: motion.colour for motion in self.motions() if motion.colour is not None}

    def _coded(self) -> tuple[list[MotionShare], IntArray]:
        """Return the motions, the largest share first, and the position of each point's motion among them."""
        motions, codes = motions_of(vars(self))
        return [MotionShare(**motion) for motion in motions], codes

    def labels(self) -> NDArray[np.str_]:
        """Return the label of every point, shape (clearance, omega)."""
        motions, codes = self._coded()
        return np.array([motion.label for motion in motions], dtype="<U32")[codes]

    def at(self, omega: float, clearance: float) -> MapPoint:
        """Return the point of the grid that is nearest to a place. Raises ValueError for a place outside the map."""
        column = _nearest("omega", self.omega, omega, self.units)
        row = _nearest("clearance", self.clearance, clearance, self.units)
        place = float(self.omega[column]), float(self.clearance[row])
        kind = self.kinds[self.kind[row, column]]
        period = int(self.period[row, column])
        counts = int(self.impacts_right[row, column]), int(self.impacts_left[row, column])
        asked, request = self.meta["request"], None
        if kind == "periodic" and asked.get("policy", "rest") == "rest" and max(counts) != -1:
            settings = {"transient_periods": asked["max_periods"], "max_period": asked["max_period"]}
            request = {"oscillator": asked["oscillator"], "omega": place[0], "clearance": place[1], **settings}
        return MapPoint(
            *place,
            motion_label(period, *counts) if kind == "periodic" else kind,
            kind,
            bool(self.verified[row, column]),
            self.reasons[self.reason[row, column]],
            self.computed is None or bool(self.computed[row, column]),
            place[0] - float(omega),
            place[1] - float(clearance),
            request,
        )

    def zoom(
        self, omega: tuple[float, float], clearance: tuple[float, float], shape: tuple[int, int] | None = None
    ) -> dict[str, Any]:
        """Return the keywords with which `client.unfolding_map` computes a part of the map, with the same settings.

        `shape` is (clearance points, omega points); left out: that of this map.
        """
        settings = {name: value for name, value in self.meta["request"].items() if name not in ("omega", "clearance")}
        return settings | {"omega": omega, "clearance": clearance, "shape": shape or self.kind.shape}

    def mask(self, motion: MotionShare | str) -> BoolArray:
        """Return where a motion is, shape (clearance, omega).

        The motion is one of `motions`, or its label. Raises ValueError for a label that the map does not have.
        """
        if isinstance(motion, str):
            found = {one.label: one for one in self.motions()}
            if motion not in found:
                raise ValueError(f"the map has no motion {motion!r}; it has {', '.join(found)}")
            motion = found[motion]
        there: BoolArray = self.kind == self._code(motion.kind)
        if motion.period is not None:
            right, left = motion.impacts_right, motion.impacts_left
            counted = (self.impacts_right == right) & (self.impacts_left == left)
            if motion.mirror_images:
                counted |= (self.impacts_right == left) & (self.impacts_left == right)
            there &= (self.period == motion.period) & counted
        return there

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """As `Result.derived_tables`."""
        return {"motions": self.motions()}

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """As `Result.derived`."""
        motions, codes = self._coded()
        return {"label": (codes, [motion.label for motion in motions])}

    def plot(
        self,
        ax: Axes | None = None,
        *,
        curve: GrazingCurve | None = None,
        points: CodimensionTwoPoints | None = None,
        curves: BifurcationCurves | Sequence[BifurcationCurves] | None = None,
        motions: int = 20,
        colours: Mapping[str, str] | None = None,
        merge_mirror_images: bool = False,
        legend: LegendPlace | None = None,
        labels: bool = True,
    ) -> Axes:
        """Draw the regions of the motions with a legend, and the curves and codimension-two points that are given.

        `motions` is the number of motions with a colour. `colours` gives colours by label or kind, such as those of
        another map (`other.colours()`). `merge_mirror_images` is as of `motions`. Raises TypeError for other results.
        """
        from grazemap.plots.axes import drawing
        from grazemap.plots.unfolding import plot_unfolding_map

        _expect("curve", curve, GrazingCurve)
        _expect("points", points, CodimensionTwoPoints)
        for one in curves if isinstance(curves, Sequence) else [curves]:
            _expect("curves", one, BifurcationCurves)
        return plot_unfolding_map(
            self,
            drawing(ax, legend, labels, 10.5, 6.5),
            curve=curve,
            points=points,
            curves=curves,
            motions=motions,
            colours=colours,
            merge_mirror_images=merge_mirror_images,
        )

    def plot_computed(self, ax: Axes | None = None, *, legend: LegendPlace | None = None, labels: bool = True) -> Axes:
        """Draw which points of an adaptive map were computed. Raises ValueError for other maps."""
        from grazemap.plots.axes import drawing
        from grazemap.plots.unfolding import plot_computed

        return plot_computed(self, drawing(ax, legend, labels, 8.0, 6.5))

    def _code(self, kind: str) -> int:
        return self.kinds.index(kind) if kind in self.kinds else -1

    def _summary(self) -> str:
        computed = "" if self.computed is None else f" ({self.computed.mean():.1%} computed)"
        periodic = self.kind == self._code("periodic")
        share = self.verified[periodic].mean() if periodic.any() else 1.0
        said = [
            f"{len(self.clearance)} x {len(self.omega)} points{computed}",
            counted(self.motions(), "motion"),
            f"{share:.1%} of the periodic points verified",
        ]
        said += [] if self.sensitive is None else [counted_points(self.sensitive, "sensitive")]
        said += [] if self.resolved is None else [f"{np.count_nonzero(self.resolved)} resolved in more digits"]
        said += ["a preview"] if self.preview else []
        said += [str(found) for found in (self.inferred_wrong, self.chance_to_settle) if found is not None]
        return ", ".join(said)


def _merged(shares: Sequence[MotionShare], total: int) -> list[MotionShare]:
    """Return motions and their mirror images as one, the largest share first."""
    merged: dict[str, MotionShare] = {}
    for motion in shares:
        one = motion
        if motion.period is not None and motion.impacts_right != motion.impacts_left:
            counts = (motion.impacts_right or 0, motion.impacts_left or 0)
            right, left = sorted(counts, key=lambda count: np.inf if count == INFINITE else count, reverse=True)
            label = motion_label(motion.period, right, left)
            one = replace(motion, label=label, impacts_right=right, impacts_left=left, mirror_images=True)
        pixels = one.pixels + (merged[one.label].pixels if one.label in merged else 0)
        merged[one.label] = replace(one, pixels=pixels, share=pixels / total)
    largest = sorted(merged.values(), key=lambda motion: (-motion.pixels, motion.label))
    colours = colours_of_map([motion.label for motion in largest], [motion.kind for motion in largest])
    return [replace(motion, colour=colour) for motion, colour in zip(largest, colours, strict=True)]


def _expect(name: str, given: object, kind: type[Result]) -> None:
    """Raise TypeError for an argument of `plot` that is not a result of its kind, or None."""
    if not isinstance(given, kind | None):
        raise TypeError(f"{name} is a {type(given).__name__}, and plot draws {kind.__name__} there")


def _nearest(name: str, values: FloatArray, value: float, units: str) -> int:
    """Return the index of the nearest of increasing values. Raises ValueError outside of them."""
    if not values[0] <= value <= values[-1]:
        raise outside("map", name, value, (float(values[0]), float(values[-1])), units)
    return int(np.abs(values - value).argmin())


def _small(values: NDArray[Any]) -> NDArray[Any]:
    """Return whole numbers in four bytes."""
    return values.astype(np.int32) if values.dtype.kind == "i" else values


def _spread(figures: NDArray[Any] | None, computed: BoolArray) -> NDArray[Any] | None:
    """Return an array of the grid from the values at its computed points, in the order of its rows."""
    if figures is None:
        return None
    nothing: Any = {"f": np.nan, "i": -1, "b": False}[figures.dtype.kind]
    whole = np.full(computed.shape, nothing, dtype=_small(figures).dtype)
    whole[computed] = figures
    return whole


# the class of these figures is that of the map
RECORDS[AT_COMPUTED.name] = dict
