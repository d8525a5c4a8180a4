"""Grazing curves and their codimension-two points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from grazemap.codec import Document
from grazemap.results.base import Result, counted, outside
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import BoolArray, FloatArray, IntArray, described
from grazemap.schema.grazing import CORNER, FAMILY, POINT, UNFOLDING
from grazemap.wire import Oscillator
from grazemap.wire.linear import STOPS, StopName, grazing_clearance

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NEAR = 1e-9
"""Relative distance from omega of a point in which the statement on the point has its zero."""


@described(FAMILY, comparable=True)
class Family:
    """One of the paper's families of double grazing motions: case 1 to 4 and n, equation (42)."""

    case: int
    n: int


@described(UNFOLDING, comparable=True)
class Unfolding:
    """The curve that leaves the grazing curve at a resonant point, to leading order in the distance x in omega.

    The curve of its bifurcation is b = A(omega) + slope x + quadratic x^2, on one side of the point.
    """

    orbits_before: int
    orbits_after: int
    curve_omega: int
    curve_clearance: int
    contact: str
    slope: float
    quadratic: float | None
    velocity_slope: float
    transversality: float
    admissible: bool | None
    margin: float | None


@described(CORNER, comparable=True)
class Corner:
    """Two maxima of the steady motion that are equal, where the grazing curve has a kink."""

    phase_before: float
    phase_after: float
    slope_before: float
    slope_after: float
    recurrence_before: int
    recurrence_after: int


@described(POINT, comparable=True)
class CodimensionTwoPoint:
    """One codimension-two point of the grazing curve; fields that its kind does not have are None."""

    kind: str
    omega: float
    clearance: float
    order: int | None
    active: bool | None
    families: tuple[Family, ...]
    multiple: int | None
    symmetric: bool | None
    bifurcation: str | None
    residual: float | None
    status: str | None
    omega_error: float | None
    stop: int | None
    amplitude_slope: float | None
    margin: float | None
    unfolding: Unfolding | None
    corner: Corner | None
    _oscillator: dict[str, Any] | None = field(default=None, repr=False, compare=False)

    @property
    def oscillator(self) -> dict[str, Any] | None:
        """The oscillator of the request."""
        return self._oscillator

    def statement(self) -> dict[str, Any]:
        """Return the statement of proofs that the point is a zero of g, h or h_s, with the numbers of the point."""
        if self.kind == "recurrence":
            function, order = "g", self.order
        elif self.kind == "resonant" and self.multiple is not None:
            whole = (self.bifurcation == "SN") != self.symmetric
            function, order = ("h" if whole else "h_s"), self.multiple * (1 if self.symmetric else 2)
        else:
            raise ValueError(
                f"a point of the kind {self.kind} is no zero of g, h or h_s, as a statement of proofs needs it"
            )
        away = max(_NEAR * self.omega, 4.0 * (self.omega_error or 0.0))
        window = {"start": self.omega - away, "stop": self.omega + away}
        stop = {None: None, 1: "A", -1: "C"}[self.stop]
        return {"kind": "codimension-two", "type": function, "order": order, "range": window, "stop": stop}


class _WithPoints:
    """Base of results whose points know their oscillator."""

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        attributes: dict[str, Any] = super()._attributes(document, meta)  # type: ignore[misc]
        oscillator = meta["request"]["oscillator"]
        return attributes | {"points": tuple(replace(point, _oscillator=oscillator) for point in attributes["points"])}


class StopGrazingCurves(_WithPoints, Result):
    """The grazes of stops that are not alike: of one of them, or of both at one clearance."""

    contact_equilibrium: float
    omega: FloatArray
    clearance_right: FloatArray | None
    phase_right: FloatArray | None
    margin_right: FloatArray | None
    virtual_right: BoolArray | None
    first_recurrence_right: IntArray | None
    clearance_left: FloatArray | None
    phase_left: FloatArray | None
    margin_left: FloatArray | None
    virtual_left: BoolArray | None
    first_recurrence_left: IntArray | None
    points: tuple[CodimensionTwoPoint, ...]

    def at(self, omega: ArrayLike, stop: StopName | None = None) -> FloatArray:
        """Return the clearance at which the steady motion touches a stop, in the shape of omega.

        It is that of the stop that varies. Where both vary together it is that of the first one that the motion touches
        as they come nearer, the larger one, or with `stop` that of this one. As in the fields, the motion may meet the
        other stop before: the graze is virtual. The formula is evaluated: nothing is interpolated. Raises ValueError
        for an omega outside of the curve's, as it may be meant in other units, and for a stop that does not vary.
        """
        varied = [name for name in STOPS if getattr(self, f"clearance_{name}") is not None]
        if stop is not None and stop not in varied:
            raise ValueError(f"the result has no curve of the stop {stop!r}; it has {' and '.join(varied)}")
        return _evaluated(self, omega, varied if stop is None else [stop])

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        points: CodimensionTwoPoints | Literal[False] | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the clearance of each stop over omega, dashed where it is virtual, with the codimension-two points."""
        return draw(self, ax, options, points=points)

    def _summary(self) -> str:
        return f"{counted(self.omega, 'value')} of omega, {counted(self.points, 'codimension-two point')}"


class GrazingCurve(_WithPoints, Result):
    """The curve clearance = A(omega) on which the steady motion touches both stops (equations (16)-(19))."""

    omega: FloatArray
    clearance: FloatArray
    phase: FloatArray
    first_recurrence: IntArray
    recurrence_stop: IntArray
    points: tuple[CodimensionTwoPoint, ...]
    xi: FloatArray | None

    @property
    def clearance_right(self) -> FloatArray:
        """The clearance of the right stop, that of both."""
        return self.clearance

    @property
    def clearance_left(self) -> FloatArray:
        """The clearance of the left stop, that of both."""
        return self.clearance

    def at(self, omega: ArrayLike) -> FloatArray:
        """Return the clearance at which the steady motion touches the stops, in the shape of omega.

        The formula is evaluated: nothing is interpolated. Raises ValueError for an omega outside of the curve's, as it
        may be meant in other units.
        """
        return _evaluated(self, omega, ["right"])

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        points: CodimensionTwoPoints | Literal[False] | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw clearance over omega with the codimension-two points (its own, or `points`; False: none)."""
        return draw(self, ax, options, points=points)

    def _summary(self) -> str:
        return f"{counted(self.omega, 'value')} of omega, {counted(self.points, 'codimension-two point')}"


class CodimensionTwoPoints(_WithPoints, Result):
    """Every codimension-two point of the grazing curve over an interval of omega."""

    points: tuple[CodimensionTwoPoint, ...]

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        curve: GrazingCurve | StopGrazingCurves | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the points on the grazing curve in the plane of omega and clearance.

        A `curve` that is given is drawn as it draws itself; left out, those of the stops that vary are evaluated.
        """
        return draw(self, ax, options, curve=curve)

    @picture
    def plot_unfolding(
        self, ax: Axes | None = None, *, omega: tuple[float, float] | None = None, **options: Unpack[PictureOptions]
    ) -> Axes:
        """Draw the curves that leave the grazing curve at resonant points, to leading order, relative to it.

        `omega` is the interval drawn; left out: that of the request.
        """
        return draw(self, ax, options, "plot_unfolding", omega=omega)

    def _summary(self) -> str:
        kinds = Counter(point.kind for point in self.points)
        others = "".join(f", {kinds[kind]} {kind}" for kind in ("double-graze", "corner") if kinds[kind])
        return f"{kinds['recurrence']} recurrence and {kinds['resonant']} resonant points{others}"


def _evaluated(curve: GrazingCurve | StopGrazingCurves, omega: ArrayLike, stops: Sequence[StopName]) -> FloatArray:
    """Return the largest clearance at which the steady motion touches one of the stops, in the shape of omega."""
    frequencies = np.asarray(omega, dtype=np.float64)
    low, high = float(curve.omega[0]), float(curve.omega[-1])
    beyond = frequencies[~((low <= frequencies) & (frequencies <= high))]
    if beyond.size:
        raise outside("curve", "omega", float(beyond.flat[0]), (low, high), curve.units)
    oscillator = Oscillator.model_validate(curve.meta["request"]["oscillator"])
    each = [grazing_clearance(oscillator, frequencies.ravel(), stop) for stop in stops]
    return np.reshape(np.max(each, axis=0), frequencies.shape)
