"""Periodic orbits: their multipliers on the unit circle, and branches over a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import Drawing, axis_label, place_text, record_unit
from grazemap.plots.palette import BIFURCATIONS, INK, LINE, PALE_LINE, label_text
from grazemap.plots.smooth import smooth_pieces

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import OrbitBranch, PeriodicOrbit, SpecialPoint

_VIRTUAL = 0.3
_FARTHEST = 3.0
# Styles of the stretches of a branch.
_STYLES: dict[str, dict[str, Any]] = {
    "stable": {"color": LINE, "linewidth": 1.8, "zorder": 3},
    "unstable": {"color": LINE, "linewidth": 1.2, "linestyle": (0, (5, 2)), "zorder": 2},
    "not admissible": {"color": PALE_LINE, "linewidth": 1.0, "zorder": 1},
}

Floats = NDArray[np.float64]


def plot_multipliers(result: PeriodicOrbit, drawing: Drawing) -> Axes:
    """Draw the multipliers of an orbit and the unit circle."""
    name = label_text(result.motion.label) if result.motion.label else "no orbit"
    _describe_circle(drawing, f"Multipliers of {name}, {result.said}")
    if not result.converged:
        drawing.say(f"no orbit was found: {result.reason}")
        return drawing.ax
    ax = _unit_circle(drawing)
    inside = np.abs(result.multipliers) < 1.0
    for chosen, colour in ((inside, LINE), (~inside, BIFURCATIONS["SN"][1])):
        points = result.multipliers[chosen]
        ax.plot(points.real, points.imag, linestyle="none", marker="o", markersize=5, color=colour)
    return ax


def plot_branch_multipliers(result: OrbitBranch, drawing: Drawing) -> Axes:
    """Draw the multipliers of all orbits of a branch and the unit circle, coloured by the parameter.

    Those of inadmissible orbits are pale. Those far outside the circle, as near a graze, are not shown.
    """
    _describe_circle(drawing, f"Multipliers along a branch of period {result.period}, {_fixed(result)}")
    if not len(result.parameter):
        drawing.say(f"no branch was found: {result.reason}")
        return drawing.ax
    ax = _unit_circle(drawing)
    value = np.broadcast_to(result.parameter[:, None], result.multipliers.shape)
    low, high = float(result.parameter.min()), float(result.parameter.max())
    for chosen, alpha in ((~result.admissible, 0.3), (result.admissible, 1.0)):
        points, colour = result.multipliers[chosen].ravel(), value[chosen].ravel()
        near = np.abs(points) < _FARTHEST
        x, y = points[near].real, points[near].imag
        drawn = ax.scatter(x, y, s=10, c=colour[near], alpha=alpha, vmin=low, vmax=high, cmap="viridis", zorder=3)
    label = axis_label(result.meta["request"]["vary"], result.units)
    if drawing.legend == "outside":
        bar = ax.figure.colorbar(drawn, ax=ax, shrink=0.8).ax
        record_unit(bar.yaxis, label)
        if drawing.labels:
            bar.set_ylabel(label)
    elif drawing.legend == "inside":
        bar = ax.inset_axes((0.05, 0.05, 0.4, 0.03))
        ax.figure.colorbar(drawn, cax=bar, orientation="horizontal", ticks=[low, high], format="%.3g")
        record_unit(bar.xaxis, label)
        if drawing.labels:
            bar.set_title(label, fontsize=7)
        bar.tick_params(labelsize=6)
    return ax


def _describe_circle(drawing: Drawing, title: str) -> None:
    drawing.describe("real part", "imaginary part", title)


def _unit_circle(drawing: Drawing) -> Axes:
    ax = drawing.ax
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(np.cos(turn), np.sin(turn), color=INK, linewidth=0.9)
    for value in (ax.axhline, ax.axvline):
        value(0.0, color=PALE_LINE, linewidth=0.5, zorder=0)
    ax.set_aspect("equal", adjustable="datalim")
    return ax


def _fixed(result: OrbitBranch) -> str:
    """Return the text of the parameters of a branch that do not vary."""
    request = result.meta["request"]
    fixed = {name: request[name] for name in ("omega", "clearance") if name != request["vary"]}
    return place_text(result.units, **fixed)


def plot_branch(result: OrbitBranch, drawing: Drawing) -> Axes:
    """Draw the speed of every impact over the parameter.

    Stable motions are solid, unstable ones dashed, inadmissible orbits pale; special points are marked on all impacts,
    and stretches end at them.
    """
    ax = drawing.ax
    stops = "".join("A" if stop > 0 else "C" for stop in result.stops)
    drawing.describe(
        axis_label(result.meta["request"]["vary"], result.units),
        "impact speed" + (" (m/s)" if result.units == "SI" else ""),
        f"Branch of period {result.period}, impacts {stops or 'not found'}, {_fixed(result)}",
    )
    if not len(result.parameter):
        drawing.say(f"no branch was found: {result.reason}")
        return ax
    for kind, line in _lines(result).items():
        style = _STYLES[kind]
        for impact in range(1, line.shape[1]):
            ax.plot(line[:, 0], line[:, impact], label=kind if impact == 1 and len(line) else None, **style)
    seen: set[str] = set()
    for point in result.special_points:
        marker, colour, text = BIFURCATIONS[point.type]
        heights = _speeds(result, point).tolist()
        style = {"marker": marker, "color": colour, "markersize": 6, "linestyle": "none", "zorder": 5}
        label = None if point.type in seen else text
        seen.add(point.type)
        fill = colour if point.admissible else "white"
        ax.plot([point.parameter] * len(heights), heights, label=label, markerfacecolor=fill, **style)
    ax.axhline(0.0, color=INK, linewidth=0.5, zorder=0)
    # virtual impacts may be many times as fast as real ones
    low, high = ax.get_ylim()
    ax.set_ylim(max(low, -_VIRTUAL * high), high)
    drawing.show_legend()
    return ax


def _speeds(result: OrbitBranch, point: SpecialPoint) -> Floats:
    return point.velocities[: len(result.stops)] * result.stops


def _lines(result: OrbitBranch) -> dict[str, Floats]:
    """Return the lines of stable, unstable and inadmissible orbits: parameter and speeds, (points, 1 + impacts).

    Pieces of a line are separated by NaN. They begin and end at special points where there are some, so that stable
    motions that graze end at the graze.
    """
    knots = result.knots()
    at = knots.path[:, : 1 + len(result.stops)]
    gap = np.full((1, at.shape[1]), np.nan)
    lines: dict[str, list[Floats]] = {kind: [np.empty((0, at.shape[1]))] for kind in _STYLES}
    for number, (piece, kind) in enumerate(zip(smooth_pieces(knots.path, at), knots.kinds, strict=True)):
        goes_on = number > 0 and knots.kinds[number - 1] == kind
        lines[kind] += [piece[1:]] if goes_on else [gap, piece]
    return {kind: np.concatenate(line) for kind, line in lines.items()}
