"""The grazing curve and its codimension-two points in the plane of omega and clearance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import Drawing, draws, rimmed
from grazemap.plots.palette import BIFURCATIONS, INK, LINE, NAMED, PAPER, UNRESOLVED, order_style
from grazemap.plots.pen import Pen
from grazemap.results import (
    CodimensionTwoPoint,
    CodimensionTwoPoints,
    GrazingCurve,
    GrazingCurveOfPlane,
    StopGrazingCurves,
)
from grazemap.wire import Oscillator
from grazemap.wire.linear import grazing_clearance, steady_amplitude
from grazemap.wire.structure import SIDES, StopName

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]
Booleans = NDArray[np.bool_]

_PASSIVE, _QUIET = UNRESOLVED, NAMED["1-1r-1l"]
# Maximum number of symbols that are drawn at full size.
_MAX_FULL_SIZE = 150
# Size of an asterisk in points for order 0; it is smaller by 1.5 for each order, so that low orders stand out.
_MAX_MARKER_SIZE = 12.5
# Text of the grazing curve in legends, and its number of points where it is evaluated for a picture.
CURVE, _CURVE_POINTS = r"grazing curve $b = A(\omega)$", 1000


@draws(GrazingCurve)
@draws(StopGrazingCurves)
def plot_grazing_curve(
    curve: GrazingCurve | StopGrazingCurves, drawing: Drawing, points: CodimensionTwoPoints | Literal[False] | None
) -> Axes:
    """Draw clearance over omega with codimension-two points: `points`, or for None the curve's own; for False none."""
    pen = drawing.describe_plane(curve.units, "Grazing curve" if isinstance(curve, GrazingCurve) else "Grazing curves")
    draw_curve(pen, curve)
    if points is not False:
        span = float(curve.omega[0]), float(curve.omega[-1])
        draw_points(pen, points.points if points is not None else curve.points, span)
    drawing.ax.margins(x=0.01)
    drawing.show_legend()
    return drawing.ax


@draws(CodimensionTwoPoints)
def plot_codimension_two_points(
    points: CodimensionTwoPoints, drawing: Drawing, curve: GrazingCurve | StopGrazingCurves | None
) -> Axes:
    """Draw codimension-two points on a grazing curve; without `curve` it is evaluated over the omega of the request."""
    pen = drawing.describe_plane(points.units, "Codimension-two points of the grazing curve")
    if curve is not None:
        draw_curve(pen, curve)
    else:
        request = points.meta["request"]
        interval = request["axis"]["values"]
        between = np.linspace(interval["start"], interval["stop"], _CURVE_POINTS)
        omega = np.union1d(between, [point.omega for point in points.points])
        oscillator, fixed = Oscillator.model_validate(request["oscillator"]), request.get("clearance")
        if oscillator.is_symmetric and fixed is None:
            pen.plot(omega, steady_amplitude(oscillator, omega), color=INK, linewidth=1.2, label=CURVE, zorder=3)
        else:
            _draw_evaluated(pen, oscillator, omega, fixed)
    draw_points(pen, points.points)
    drawing.show_legend()
    return drawing.ax


def _draw_evaluated(pen: Pen, oscillator: Oscillator, omega: Floats, fixed: Mapping[str, float | None] | None) -> None:
    """Draw the grazing curves of unlike stops; `fixed` has the clearance of the stop that does not vary."""
    for stop in SIDES:
        if fixed is None or stop not in fixed:
            clearance = grazing_clearance(oscillator, omega, stop)
            beside = clearance if fixed is None else next(iter(fixed.values()))
            draw_graze(pen, stop, omega, clearance, meets_other_stop(oscillator, omega, stop, beside))


def meets_other_stop(
    oscillator: Oscillator, omega: Floats, stop: StopName, clearance: Floats | float | None
) -> Booleans:
    """Return where the steady motion that touches a stop meets the other stop first.

    `clearance` is that of the other stop, None where it is absent.
    """
    opposite = SIDES[1 - SIDES.index(stop)]
    if clearance is None:
        return np.zeros(len(omega), dtype=np.bool_)
    return np.asarray(grazing_clearance(oscillator, omega, opposite) > clearance)


def draw_curve(pen: Pen, curve: GrazingCurve | StopGrazingCurves, halo: bool = False) -> None:
    """Draw a grazing curve, or the grazing curves of the stops, which are dashed where they are virtual.

    Under a grazing curve of both stops, a band marks the stretches on which the graze does not recur.

    Parameters
    ----------
    pen : Pen
    curve : GrazingCurve or StopGrazingCurves
    halo : bool
        Draw a white line with dark rims, without the band, so that it differs from other curves and from regions.
    """
    if isinstance(curve, StopGrazingCurves):
        for name in SIDES:
            clearance, virtual = getattr(curve, f"clearance_{name}"), getattr(curve, f"virtual_{name}")
            if clearance is not None:
                draw_graze(pen, name, curve.omega, clearance, virtual, halo)
        return
    pen.plot(
        curve.omega,
        curve.clearance,
        color=PAPER if halo else INK,
        linewidth=1.2,
        label=CURVE,
        path_effects=rimmed(3.2, INK) if halo else None,
        zorder=3,
    )
    quiet = curve.first_recurrence == 0
    if quiet.any() and not halo:
        pen.plot(
            curve.omega,
            np.where(quiet, curve.clearance, np.nan),
            color=_QUIET,
            linewidth=6.0,
            solid_capstyle="butt",
            label=f"no recurrence up to order {curve.meta['request']['max_order']}",
            zorder=2,
        )


def draw_graze(
    pen: Pen, stop: StopName, omega: Floats, clearance: Floats, virtual: Booleans, halo: bool = False
) -> None:
    """Draw the grazing curve of the stop "right" or "left", dashed where it is virtual.

    `halo` is that of `draw_curve`. The curves of the two stops have different colours.
    """
    colour = LINE if stop == "left" else PAPER if halo else INK
    style: dict[str, Any] = {"color": colour, "path_effects": rimmed(3.2, INK) if halo else None, "zorder": 3}
    text = f"graze of the {stop} stop"
    if not virtual.all():
        pen.plot(omega, np.where(virtual, np.nan, clearance), linewidth=1.2, label=text, **style)
    if virtual.any():
        drawn, text = np.where(virtual, clearance, np.nan), f"{text}, virtual"
        pen.plot(omega, drawn, linewidth=1.0, linestyle="--", label=text, **style)


def draw_plane_grazes(pen: Pen, curves: Sequence[GrazingCurveOfPlane], both: bool) -> None:
    """Draw the grazing curves of a plane of any two parameters, dashed where they are virtual.

    `both` says whether the two stops are grazed at once.
    """
    labelled: set[str] = set()
    for curve in curves:
        colour = PAPER if curve.stop > 0 else LINE
        text = "grazing curve" if both else f"graze of the {'right' if curve.stop > 0 else 'left'} stop"
        for drawn, dash, label in ((curve.admissible, "-", text), (~curve.admissible, "--", f"{text}, virtual")):
            if not drawn.any():
                continue
            shown = [np.where(drawn, values, np.nan) for values in (curve.horizontal, curve.vertical)]
            style: dict[str, Any] = {"color": colour, "linestyle": dash, "path_effects": rimmed(3.2, INK)}
            pen.plot(*shown, linewidth=1.2, label=None if label in labelled else label, zorder=3, **style)
            labelled.add(label)


def draw_points(
    pen: Pen, points: Sequence[CodimensionTwoPoint], span: tuple[float, float] | None = None, rim: bool = False
) -> None:
    """Draw codimension-two points, with a legend entry per kind.

    Recurrences are asterisks. Active ones are coloured by order, and low orders are larger and above higher ones;
    where a smaller order recurs already, they are small and grey. The marker of a resonant point shows the
    bifurcation; it is filled for one-sided and hollow for symmetric motions. Corners are open triangles that point to
    the kink.

    Parameters
    ----------
    pen : Pen
    points : sequence of CodimensionTwoPoint
    span : (float, float), optional
        Interval of omega outside which points are left out.
    rim : bool
        Give the symbols a white rim, so that they are legible on colours.
    """
    inside = [point for point in points if span is None or span[0] <= point.omega <= span[1]]
    # Many symbols are drawn smaller, so that the curve under them stays visible.
    size = max(0.6, min(1.0, (_MAX_FULL_SIZE / max(1, len(inside))) ** 0.5))
    recurrences = [point for point in inside if point.kind == "recurrence"]
    double = [point for point in inside if point.kind == "double-graze"]
    _mark(pen, double, rim, marker="P", color=INK, markersize=8 * size, label="both stops grazed", zorder=6)
    corners = [point for point in inside if point.kind == "corner"]
    style: dict[str, Any] = {"marker": "v", "color": INK, "markerfacecolor": PAPER, "markersize": 7 * size}
    _mark(pen, corners, rim, **style, label="corner: two maxima are equal", zorder=6)
    passive = [point for point in recurrences if not point.active]
    text = "recurrence where a smaller order recurs"
    style = {**order_style(1), "color": _PASSIVE}
    _mark(pen, passive, rim, **style, markersize=5 * size, label=text, zorder=4)
    for name, (marker, colour, text) in BIFURCATIONS.items():
        for symmetric, side in ((False, "one-sided"), (True, "symmetric")):
            chosen = [p for p in inside if p.bifurcation == name and bool(p.symmetric) is symmetric]
            style = {
                "marker": marker,
                "color": colour,
                "markerfacecolor": "white" if symmetric else colour,
            }
            _mark(pen, chosen, rim, **style, markersize=5.5 * size, label=f"resonant, {text}, {side}", zorder=5)
    for order in sorted({point.order or 0 for point in recurrences if point.active}):
        chosen = [point for point in recurrences if point.active and point.order == order]
        style = {**order_style(order), "markersize": max(9 * size, _MAX_MARKER_SIZE - 1.5 * order)}
        layer = {"zorder": 6.0 + 0.5 ** max(1, order)}
        _mark(pen, chosen, rim, 0.6 + 0.8 * size, label=f"recurrence of order {order}", **style, **layer)


def _mark(pen: Pen, points: Sequence[CodimensionTwoPoint], rim: bool, edge: float = 0.9, **style: Any) -> None:
    if points:
        omega, clearance = [point.omega for point in points], [point.clearance for point in points]
        effects = rimmed(edge + 1.6) if rim else None
        pen.plot(omega, clearance, linestyle="none", markeredgewidth=edge, path_effects=effects, **style)
