"""Local unfoldings: the curves that leave the grazing curve at its resonant points, relative to it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import Drawing, axis_label
from grazemap.plots.palette import BIFURCATIONS, DASHES, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import CodimensionTwoPoint, CodimensionTwoPoints, Unfolding

_FAR = 0.003


def plot_local_unfolding(
    result: CodimensionTwoPoints, drawing: Drawing, omega: tuple[float, float] | None = None
) -> Axes:
    """Draw the distance to the grazing curve, b - A(omega), of the curves that leave it, to leading order.

    At a saddle-node curve the branch that starts at the graze ends; at a period-doubling or symmetry-breaking curve it
    loses its stability. A branch has no motions beyond its saddle-node, so curves are drawn up to the saddle-node curve
    that they would cross. Curves of inadmissible motions are pale.
    """
    ax = drawing.ax
    interval = result.meta["request"]["omega"]
    start, stop = omega if omega is not None else (interval["start"], interval["stop"])
    points = [p for p in result.points if start <= p.omega <= stop]
    ax.axhline(0.0, color=INK, linewidth=1.2, label=r"grazing curve $b = A(\omega)$", zorder=3)
    resonant = [(point, point.unfolding) for point in points if point.unfolding is not None]
    for point, unfolding in resonant:
        _draw(ax, point, unfolding, start, stop, _saddle_nodes(point, resonant))
    for point in points:
        if point.kind == "recurrence" and point.active:
            ax.plot(point.omega, 0.0, marker=(6, 2, 0), markersize=8, color=INK, linestyle="none", zorder=4)
            ax.annotate(
                f"order {point.order}", (point.omega, 0.0), (0, 7), textcoords="offset points", fontsize=7, ha="center"
            )
    _label_sides(ax, resonant)
    ax.set_xlim(start, stop)
    distance = r"distance to the grazing curve $b - A(\omega)$" + (" (m)" if result.units == "SI" else "")
    drawing.describe(axis_label("omega", result.units), distance, "Curves from the grazing curve, to leading order")
    seen: set[str] = set()
    for line in ax.lines:  # curves of one kind have one entry
        label = str(line.get_label())
        if label in seen:
            line.set_label("_")
        seen.add(label)
    drawing.show_legend()
    return ax


def _saddle_nodes(
    point: CodimensionTwoPoint, resonant: list[tuple[CodimensionTwoPoint, Unfolding]]
) -> list[tuple[float, float]]:
    """Return omega and coefficient of the other points at which saddle-nodes of the same motions leave the curve."""
    return [
        (other.omega, unfolding.quadratic)
        for other, unfolding in resonant
        if other is not point
        and other.bifurcation == "SN"
        and (other.symmetric, other.multiple) == (point.symmetric, point.multiple)
        and unfolding.quadratic is not None
    ]


def _draw(
    ax: Axes,
    point: CodimensionTwoPoint,
    unfolding: Unfolding,
    start: float,
    stop: float,
    saddle_nodes: list[tuple[float, float]],
) -> None:
    marker, colour, _ = BIFURCATIONS[point.bifurcation or "SN"]
    end = stop if unfolding.curve_omega > 0 else start
    # the leading order is drawn within a fraction of the clearance from the grazing curve
    far = _FAR * point.clearance
    reach = min(
        abs(end - point.omega),
        far / abs(unfolding.slope) if unfolding.slope else np.inf,
        (far / abs(unfolding.quadratic)) ** 0.5 if unfolding.quadratic else np.inf,
    )
    x = np.linspace(0.0, unfolding.curve_omega * reach, 600)
    distance = unfolding.slope * x + (unfolding.quadratic or 0.0) * x * x
    for omega, quadratic in saddle_nodes:
        across = distance > quadratic * (point.omega + x - omega) ** 2
        if across.any():
            end_of_curve = int(np.argmax(across))
            x, distance = x[:end_of_curve], distance[:end_of_curve]
    family = "symmetric" if point.symmetric else "one-sided"
    pale = unfolding.admissible is False
    ax.plot(
        point.omega + x,
        distance,
        color=colour,
        linestyle=DASHES[((point.multiple or 1) - 1) % len(DASHES)],
        linewidth=1.4,
        alpha=0.35 if pale else 1.0,
        label=f"{point.bifurcation}, {family}, n = {point.multiple}" + (", not admissible" if pale else ""),
    )
    ax.plot(
        point.omega,
        0.0,
        marker=marker,
        markersize=6,
        color=colour,
        markerfacecolor="white" if point.symmetric else colour,
        linestyle="none",
        zorder=5,
    )


def _label_sides(ax: Axes, resonant: list[tuple[CodimensionTwoPoint, Unfolding]]) -> None:
    """Draw arrows on the side of the grazing curve on which the motions of each family exist, at its saddle-nodes."""
    _, colour, _ = BIFURCATIONS["SN"]
    saddle_nodes = [(point, unfolding) for point, unfolding in resonant if point.bifurcation == "SN"]
    if saddle_nodes:
        ax.plot([], [], linestyle="none", marker=r"$\uparrow$", color=colour, label="side on which motions exist")
    for point, unfolding in saddle_nodes:
        for side, where in ((-1, unfolding.orbits_before), (1, unfolding.orbits_after)):
            ax.annotate(
                "",
                (point.omega, 0.0),
                (14 * side, 16 * where),
                textcoords="offset points",
                arrowprops={"arrowstyle": "<-", "color": colour, "linewidth": 0.9},
            )
