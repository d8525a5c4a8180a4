"""Local unfoldings: the curves that leave the grazing curve at its resonant points, relative to the grazing curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import Drawing, axis_label, draws, rimmed
from grazemap.plots.grazing_curve import CURVE
from grazemap.plots.layout import Name
from grazemap.plots.palette import ANY_COLOUR, BIFURCATIONS, INK, PAPER, dash
from grazemap.plots.pen import Pen
from grazemap.plots.wordings import unit_wording
from grazemap.results import CodimensionTwoPoint, CodimensionTwoPoints, Unfolding

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MAX_DISTANCE = 0.003
# Maximum number of resonant points that are drawn, and minimum distance of arrows and texts as a share of the width.
_MAX_POINTS, _MIN_SPACING = 40, 0.07
_PALE = 0.35


@draws(CodimensionTwoPoints, "plot_unfolding")
def plot_local_unfolding(result: CodimensionTwoPoints, drawing: Drawing, omega: tuple[float, float] | None) -> Axes:
    """Draw the distance to the grazing curve, b - A(omega), of the curves that leave it, to leading order.

    The branch that starts at the graze ends at a saddle-node curve, and loses its stability at a period-doubling or
    symmetry-breaking curve. A branch has no motions beyond its saddle-node, so a curve ends where it would cross a
    saddle-node curve of the same motions. Curves of inadmissible motions are pale. If there are too many points, those
    of admissible motions with the shortest periods are drawn, and the title says how many.
    """
    interval = result.meta["request"]["axis"]["values"]
    start, stop = omega if omega is not None else (interval["start"], interval["stop"])
    points = [p for p in result.points if start <= p.omega <= stop]
    resonant = [(point, point.unfolding) for point in points if point.unfolding is not None]
    shown = sorted(resonant, key=_prominence)[:_MAX_POINTS]
    distance = unit_wording(r"distance to the grazing curve $b - A(\omega)$", "m", result.units)
    of_all = f", {len(shown)} of {len(resonant)} points (shortest periods)" if len(shown) < len(resonant) else ""
    title = f"Curves from the grazing curve, to leading order{of_all}"
    pen = drawing.describe(axis_label("omega", result.units), distance, title)
    # with a rim, as in maps; the other curves have none
    pen.axhline(0.0, color=PAPER, linewidth=1.2, label=CURVE, path_effects=rimmed(3.2, INK), zorder=3)
    for point, unfolding in shown:
        _draw(pen, point, unfolding, start, stop, _saddle_nodes(point, resonant))
    active = [point for point in points if point.kind == "recurrence" and point.active]
    for point in active:
        pen.plot(point.omega, 0.0, marker=(6, 2, 0), markersize=8, color=INK, linestyle="none", zorder=4)
    if drawing.labels:
        for point in _spaced(active, lambda point: point.order or 0, stop - start):
            name = pen.annotate(f"order {point.order}", (point.omega, 0.0), (0, 7), fontsize=7, ha="center")
            drawing.names.append(Name(name))
    _draw_sides(pen, shown, stop - start)
    pen.set_xlim(start, stop)
    _explain(drawing.ax, shown)
    drawing.show_legend(handlelength=3.0)
    return drawing.ax


def _prominence(entry: tuple[CodimensionTwoPoint, Unfolding]) -> tuple[bool, int, float]:
    point, unfolding = entry
    return unfolding.admissible is False, point.multiple or 0, point.omega


def _spaced(
    points: Sequence[CodimensionTwoPoint], rank: Callable[[CodimensionTwoPoint], float], width: float
) -> list[CodimensionTwoPoint]:
    """Return points with a minimum distance along the axis; points of a smaller rank are chosen first."""
    chosen: list[CodimensionTwoPoint] = []
    for point in sorted(points, key=rank):
        if all(abs(point.omega - neighbour.omega) > _MIN_SPACING * width for neighbour in chosen):
            chosen.append(point)
    return chosen


def _explain(ax: Axes, shown: list[tuple[CodimensionTwoPoint, Unfolding]]) -> None:
    """Add an entry to the legend for each colour, dash, fill and paleness of the curves."""
    for type, (marker, colour, text) in BIFURCATIONS.items():
        if any(point.bifurcation == type for point, _ in shown):
            ax.plot([], [], color=colour, marker=marker, markersize=5, linewidth=1.4, label=text)
    for multiple in sorted({point.multiple or 1 for point, _ in shown}):
        style = {"color": ANY_COLOUR, "linestyle": _dash(multiple), "linewidth": 1.4}
        ax.plot([], [], label=f"of motions of period {multiple}", **style)
    if any(point.symmetric for point, _ in shown):
        ax.plot([], [], "o", color=INK, markerfacecolor=PAPER, markersize=5, label="hollow: symmetric motions")
    pale = [point for point, unfolding in shown if unfolding.admissible is False]
    if pale:
        _, colour, _ = BIFURCATIONS[pale[0].bifurcation or "SN"]
        ax.plot([], [], color=colour, alpha=_PALE, linewidth=1.4, label="pale: not admissible")


def _dash(multiple: int) -> Any:
    return dash(multiple - 1)


def _saddle_nodes(
    point: CodimensionTwoPoint, resonant: list[tuple[CodimensionTwoPoint, Unfolding]]
) -> list[tuple[float, float, int]]:
    """Return omega, coefficient and side of those saddle-node curves of the same motions that leave other points."""
    return [
        (source.omega, unfolding.quadratic, unfolding.curve_omega)
        for source, unfolding in resonant
        if source is not point
        and source.bifurcation == "SN"
        and (source.symmetric, source.multiple) == (point.symmetric, point.multiple)
        and unfolding.quadratic is not None
    ]


def _draw(
    pen: Pen,
    point: CodimensionTwoPoint,
    unfolding: Unfolding,
    start: float,
    stop: float,
    saddle_nodes: list[tuple[float, float, int]],
) -> None:
    marker, colour, _ = BIFURCATIONS[point.bifurcation or "SN"]
    end = stop if unfolding.curve_omega > 0 else start
    # the leading order is drawn within a fraction of the clearance from the grazing curve
    far = _MAX_DISTANCE * point.clearance
    reach = min(
        abs(end - point.omega),
        far / abs(unfolding.slope) if unfolding.slope else np.inf,
        (far / abs(unfolding.quadratic)) ** 0.5 if unfolding.quadratic else np.inf,
    )
    x = np.linspace(0.0, unfolding.curve_omega * reach, 600)
    distance = unfolding.slope * x + (unfolding.quadratic or 0.0) * x * x
    for omega, quadratic, side in saddle_nodes:
        beside = point.omega + x - omega
        beyond = distance > quadratic * beside**2
        across = np.append(False, beyond[1:] & ~beyond[:-1] & (beside[:-1] * side >= 0.0))
        if across.any():
            end_of_curve = int(np.argmax(across))
            x, distance = x[:end_of_curve], distance[:end_of_curve]
    pen.plot(
        point.omega + x,
        distance,
        color=colour,
        linestyle=_dash(point.multiple or 1),
        linewidth=1.4,
        alpha=_PALE if unfolding.admissible is False else 1.0,
    )
    pen.plot(
        point.omega,
        0.0,
        marker=marker,
        markersize=6,
        color=colour,
        markerfacecolor="white" if point.symmetric else colour,
        linestyle="none",
        zorder=5,
    )


def _draw_sides(pen: Pen, shown: list[tuple[CodimensionTwoPoint, Unfolding]], width: float) -> None:
    """Draw arrows at the saddle-nodes, to the side of the grazing curve on which the motions of the family exist.

    Inadmissible motions have no arrows.
    """
    _, colour, _ = BIFURCATIONS["SN"]
    unfoldings = {
        id(point): unfolding
        for point, unfolding in shown
        if point.bifurcation == "SN" and unfolding.admissible is not False
    }
    chosen = _spaced([p for p, _ in shown if id(p) in unfoldings], lambda point: point.multiple or 0, width)
    if chosen:
        pen.plot([], [], linestyle="none", marker=r"$\uparrow$", color=colour, label="side on which motions exist")
    for point in chosen:
        unfolding = unfoldings[id(point)]
        for side, direction in ((-1, unfolding.orbits_before), (1, unfolding.orbits_after)):
            arrow = {"arrowstyle": "<-", "color": colour, "linewidth": 0.9}
            pen.annotate("", (point.omega, 0.0), (14 * side, 16 * direction), arrowprops=arrow)
