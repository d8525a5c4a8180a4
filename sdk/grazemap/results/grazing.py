"""Grazing curves and their codimension-two points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import field as attribute
from typing import TYPE_CHECKING, Any, Literal, Unpack

import numpy as np
from numpy.typing import ArrayLike

from grazemap.codec import Document
from grazemap.results.base import Result, counted, outside, quantities
from grazemap.results.common_records import Common
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, FloatArray, IntArray, Record, changed, field
from grazemap.wire import Oscillator
from grazemap.wire.linear import grazing_clearance
from grazemap.wire.structure import SIDES, StopName

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NEAR = 1e-9
"""Half the width of the range of omega in the statement on a point, relative to the omega of the point."""
_UNLIKE = "of stops that are not alike"
_RECURRENCE, _RESONANT, _SIMPLE = "of recurrences", "of resonant points", "of simple resonant points"
_CORNER_SLOPE = "d A/d omega of this maximum, which is the slope of the grazing curve at omega {} the point."
_IF_RIGHT, _IF_LEFT = "if the clearance of the right stop varies", "if the clearance of the left stop varies"
XI = field("xi_m for m = 1, 2, ..., equations (33)-(40).", "order")


class Family(Record):
    """One of the paper's families of double grazing motions, equation (42)."""

    case: int = field("The paper's case, 1 to 4.")
    n: int = field("The paper's n.")


class Unfolding(Record):
    """The curve that leaves the grazing curve at a resonant point, to leading order in the distance x in omega.

    It is b = A(omega) + slope x + quadratic x^2, on one side of the point.
    """

    orbits_before: int = field(
        "Whether motions of vanishing impact velocity are below (-1) or above (+1) the grazing curve, at omega "
        "below the point."
    )
    orbits_after: int = field("The same at omega above the point.")
    curve_omega: int = field("Whether the curve is at smaller (-1) or larger (+1) omega.")
    curve_clearance: int = field("Whether the curve is below (-1) or above (+1) the grazing curve.")
    contact: str = field("Contact of the curve with the grazing curve.", values=("transversal", "tangent"))
    slope: float = field("Slope of the difference from the grazing curve; 0 where the contact is tangent.")
    quadratic: float | None = field("Coefficient of x^2 in this difference.", when="where the contact is tangent")
    velocity_slope: float = field("Impact velocity on the curve divided by |x|.")
    transversality: float = field("Relative derivative of the sum that vanishes at the point; 0: degenerate.")
    admissible: bool | None = field(
        "Whether the motions near the point have no contact other than their impacts.", when="where that is decided"
    )
    margin: float | None = field(
        "Minimum of the distances that decide `admissible`, relative to the size of their terms.",
        when="where that is decided",
    )


class Corner(Record):
    """Two maxima of the steady motion that are equal, where the grazing curve has a kink."""

    phase_before: float = field(
        "omega t, in (-pi/p, pi/p], of the maximum that is the larger one at omega below the point.", unit="rad"
    )
    phase_after: float = field("The same at omega above the point.", unit="rad")
    slope_before: float = field(_CORNER_SLOPE.format("below"), unit="m s/rad")
    slope_after: float = field(_CORNER_SLOPE.format("above"), unit="m s/rad")
    recurrence_before: int = field(
        "Number of the contact at which an impact first recurs after a graze at the first maximum; 0: none within "
        "max_order half periods. The contacts are those of the steady motion at the point, in the order of time."
    )
    recurrence_after: int = field("The same after a graze at the second maximum.")


class CodimensionTwoPoint(Record):
    """One codimension-two point of the grazing curve."""

    kind: str = field(
        "recurrence: a zero of Phi_12(order T/2), equations (45), (57), (58); resonant: a zero of the "
        "periodic sum H(1) or H(-1); double-graze: the steady motion touches both stops, which are not alike; "
        "corner: two maxima of the steady motion are equal.",
        values=("recurrence", "resonant", "double-graze", "corner"),
    )
    omega: float = field(Common, coordinate=True)
    clearance: float = field(Common)
    order: int | None = field("Number of half periods of the forcing after which the graze recurs.", when=_RECURRENCE)
    active: bool | None = field("Whether no smaller order recurs at the point.", when=_RECURRENCE)
    families: tuple[Family, ...] = field(
        "The paper's families of this order.", "family", when="of recurrences of equal stops", prefix="family_"
    )
    multiple: int | None = field(
        "The period of the motions in forcing periods.", unit="forcing periods", when=_RESONANT
    )
    symmetric: bool | None = field("Whether these motions are their own mirror image.", when=_RESONANT)
    bifurcation: str | None = field(
        "Type of the curve that leaves the point: saddle-node, period doubling, symmetry breaking.",
        when=_RESONANT,
        values=("SN", "PD", "SB"),
    )
    residual: float | None = field(
        "Modulus of the function at its zero divided by the sum of its amplitudes.", when="where it was computed"
    )
    status: str | None = field(
        "near-double: two zeros too close to be separated, or an extremum close to zero.",
        when="where it was computed",
        values=("simple", "near-double"),
    )
    omega_error: float | None = field(
        "Error of omega due to the round-off of the model.", unit="rad/s", when="where it was computed"
    )
    stop: int | None = field("The stop that is grazed: +1 right, -1 left.", when=_UNLIKE, values=(1, -1))
    amplitude_slope: float | None = field(
        "d A/d omega of the steady motion.", unit="m s/rad", when="of stops that are not alike, but for corners"
    )
    margin: float | None = field(
        "Gap of the other stop minus the amplitude toward it; the graze is virtual where it is negative.",
        unit="m",
        when="of stops that are not alike, if there is another one",
    )
    unfolding: Unfolding | None = field("The curve that leaves the grazing curve.", when=_SIMPLE, prefix="unfolding_")
    corner: Corner | None = field("The two maxima.", when="of simple corners", prefix="corner_")
    _oscillator: dict[str, Any] | None = attribute(default=None, repr=False, compare=False)

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
        stop = {None: None, 1: "right", -1: "left"}[self.stop]
        return {"kind": "codimension-two", "type": function, "order": order, "range": window, "stop": stop}


class _PointsResult:
    """Base of results whose points know their oscillator."""

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        attributes: dict[str, Any] = super()._attributes(document, meta)  # type: ignore[misc]
        oscillator = meta["request"]["oscillator"]
        return attributes | {"points": tuple(changed(point, _oscillator=oscillator) for point in attributes["points"])}


class GrazingCurve(_PointsResult, Result, process="grazing-curves", rows="omega"):
    """The curve clearance = A(omega) on which the steady motion touches both stops, equations (16)-(19)."""

    omega: FloatArray = field(Common, "omega")
    clearance: FloatArray = field(Common, "omega", description="A(omega), where the steady motion touches both stops.")
    phase: FloatArray = field("omega t at the contact with the right stop, in (-pi/p, pi/p].", "omega", "rad")
    first_recurrence: IntArray = field(
        "Number of half periods after which an impact first recurs; 0: none up to max_order.", "omega"
    )
    recurrence_stop: IntArray = field("The stop of that recurrence: +1 right, -1 left, 0 none.", "omega")
    points: tuple[CodimensionTwoPoint, ...] = field(
        "The codimension-two points inside the range, in increasing omega.", "point", variable=None
    )
    xi: FloatArray | None = field(
        XI,
        "omega order",
        when="with sequence",
        description="xi_m for m = 1 .. max_order of a graze of the right stop, equations (33)-(40): an impact recurs "
        "at the first m with (-1)^m xi_m < 0.",
    )

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

        The formula is evaluated: nothing is interpolated. In SI frequencies may be texts with a unit, as "8 Hz". Raises
        ValueError for an omega outside the range of the curve, which may be meant in other units.
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


_PHASE = field("omega t at the contact, in (-pi/p, pi/p].", "omega", "rad")
_MARGIN = field("Gap of the other stop minus the amplitude toward it; null if there is none.", "omega", "m", null=True)
_VIRTUAL = field("Whether the steady motion meets the other stop first, so that it does not reach this graze.", "omega")
_FIRST_RECURRENCE = field(
    "Number of half periods, even, after which an impact on this stop first recurs; 0: none up to max_order.", "omega"
)


class StopGrazingCurves(_PointsResult, Result, process="grazing-curves", rows="omega"):
    """The grazes of stops that are not alike: of one of them, or of both at one clearance.

    The stop that does not vary is fixed or absent. The grazes of both at one clearance differ where a bias moves the
    equilibrium, or the forces have even and odd harmonics.
    """

    contact_equilibrium: float = field("The contact coordinate at the static equilibrium.", unit="m")
    omega: FloatArray = field(Common, "omega")
    clearance_right: FloatArray | None = field(
        "Clearance of the right stop at which the steady motion touches it.", "omega", "m", when=_IF_RIGHT
    )
    phase_right: FloatArray | None = field(_PHASE, when=_IF_RIGHT)
    margin_right: FloatArray | None = field(_MARGIN, when=_IF_RIGHT)
    virtual_right: BoolArray | None = field(_VIRTUAL, when=_IF_RIGHT)
    first_recurrence_right: IntArray | None = field(_FIRST_RECURRENCE, when=_IF_RIGHT)
    clearance_left: FloatArray | None = field(
        "Clearance of the left stop at which the steady motion touches it.", "omega", "m", when=_IF_LEFT
    )
    phase_left: FloatArray | None = field(_PHASE, when=_IF_LEFT)
    margin_left: FloatArray | None = field(_MARGIN, when=_IF_LEFT)
    virtual_left: BoolArray | None = field(_VIRTUAL, when=_IF_LEFT)
    first_recurrence_left: IntArray | None = field(_FIRST_RECURRENCE, when=_IF_LEFT)
    points: tuple[CodimensionTwoPoint, ...] = field(GrazingCurve)

    def at(self, omega: ArrayLike, stop: StopName | None = None) -> FloatArray:
        """Return the clearance at which the steady motion touches a stop, in the shape of omega.

        The stop is the one that varies. Where both vary together, `stop` chooses one of them; without it, the larger
        clearance is returned, at which the motion first touches a stop as both come nearer. As in the fields, the graze
        is virtual where the motion meets the other stop first. The formula is evaluated: nothing is interpolated.
        Raises ValueError for an omega outside the range of the curve, which may be meant in other units, and for a stop
        that does not vary.
        """
        varied = [name for name in SIDES if getattr(self, f"clearance_{name}") is not None]
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


class CodimensionTwoPoints(_PointsResult, Result, process="codimension-two-points"):
    """Every codimension-two point of the grazing curve over an interval of omega."""

    points: tuple[CodimensionTwoPoint, ...] = field("The points, in increasing omega.", "point")

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        curve: GrazingCurve | StopGrazingCurves | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the points on the grazing curve in the plane of omega and clearance.

        `curve` is drawn as by its own `plot`. Without it, the grazing curves of the stops that vary are evaluated.
        """
        return draw(self, ax, options, curve=curve)

    @picture
    def plot_unfolding(
        self,
        ax: Axes | None = None,
        *,
        omega: tuple[float | str, float | str] | None = None,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the curves that leave the grazing curve at resonant points, to leading order, relative to it.

        `omega` is the interval drawn; left out: that of the request.
        """
        interval = None if omega is None else tuple(quantities(omega, "omega", self.units).tolist())
        return draw(self, ax, options, "plot_unfolding", omega=interval)

    def _summary(self) -> str:
        kinds = Counter(point.kind for point in self.points)
        special = "".join(f", {kinds[kind]} {kind}" for kind in ("double-graze", "corner") if kinds[kind])
        return f"{kinds['recurrence']} recurrence and {kinds['resonant']} resonant points{special}"


def _evaluated(curve: GrazingCurve | StopGrazingCurves, omega: ArrayLike, stops: Sequence[StopName]) -> FloatArray:
    """Return the largest clearance at which the steady motion touches one of the stops, in the shape of omega."""
    frequencies = quantities(omega, "omega", curve.units)
    low, high = float(curve.omega[0]), float(curve.omega[-1])
    beyond = frequencies[~((low <= frequencies) & (frequencies <= high))]
    if beyond.size:
        raise outside("curve", "omega", float(beyond.flat[0]), (low, high), curve.units)
    oscillator = Oscillator.model_validate(curve.meta["request"]["oscillator"])
    each = [grazing_clearance(oscillator, frequencies.ravel(), stop) for stop in stops]
    return np.reshape(np.max(each, axis=0), frequencies.shape)
