"""Periodic orbits: their multipliers on the unit circle, and branches over a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import INK, axes_or_new, axis_label, legend_outside, place_text
from grazemap.plots.palette import BIFURCATIONS, label_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import OrbitBranch, PeriodicOrbit

_LINE, _PALE = "#0072B2", "#B9B9B9"
_VIRTUAL = 0.3
_FARTHEST = 3.0


def plot_multipliers(result: PeriodicOrbit, ax: Axes | None = None) -> Axes:
    """Draw the multipliers of an orbit and the unit circle."""
    ax = _unit_circle(ax)
    inside = np.abs(result.multipliers) < 1.0
    for chosen, colour in ((inside, _LINE), (~inside, "#C31E2D")):
        points = result.multipliers[chosen]
        ax.plot(points.real, points.imag, linestyle="none", marker="o", markersize=5, color=colour)
    name = label_text(result.motion.label) if result.motion.label else "no orbit"
    ax.set_title(f"Multipliers of {name}, {result.said}", fontsize=10)
    if result.reason and not result.converged:
        ax.text(0.5, 0.5, result.reason, transform=ax.transAxes, ha="center", wrap=True, fontsize=8)
    return ax


def plot_branch_multipliers(result: OrbitBranch, ax: Axes | None = None) -> Axes:
    """Draw the multipliers of all orbits of a branch and the unit circle, coloured by the parameter.

    Those of inadmissible orbits are pale. Those far outside the circle, as near a graze, are not shown.
    """
    ax = _unit_circle(ax)
    request = result.meta["request"]
    if len(result.parameter):
        value = np.broadcast_to(result.parameter[:, None], result.multipliers.shape)
        low, high = float(result.parameter.min()), float(result.parameter.max())
        for chosen, alpha in ((~result.admissible, 0.3), (result.admissible, 1.0)):
            points, colour = result.multipliers[chosen].ravel(), value[chosen].ravel()
            near = np.abs(points) < _FARTHEST
            x, y = points[near].real, points[near].imag
            drawn = ax.scatter(x, y, s=10, c=colour[near], alpha=alpha, vmin=low, vmax=high, cmap="viridis", zorder=3)
        ax.figure.colorbar(drawn, ax=ax, label=axis_label(request["vary"], result.units), shrink=0.8)
    ax.set_title(f"Multipliers along a branch of period {result.period}, {_fixed(result)}", fontsize=10)
    return ax


def _unit_circle(ax: Axes | None) -> Axes:
    ax = axes_or_new(ax, 5.5, 5.5)
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(np.cos(turn), np.sin(turn), color=INK, linewidth=0.9)
    for value in (ax.axhline, ax.axvline):
        value(0.0, color=_PALE, linewidth=0.5, zorder=0)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="real part", ylabel="imaginary part")
    return ax


def _fixed(result: OrbitBranch) -> str:
    """Return the text of the parameters of a branch that do not vary."""
    request = result.meta["request"]
    fixed = {name: request[name] for name in ("omega", "clearance") if name != request["vary"]}
    return place_text(result.units, **fixed)


def plot_branch(result: OrbitBranch, ax: Axes | None = None) -> Axes:
    """Draw the speed of every impact over the parameter.

    Stable motions are solid, unstable ones dashed, inadmissible orbits pale; special points are marked on all impacts.
    """
    ax = axes_or_new(ax, 9.0, 5.5)
    speeds = result.velocities * result.stops if len(result.parameter) else np.zeros((0, 0))
    kinds: tuple[tuple[NDArray[np.bool_], dict[str, Any], str], ...] = (
        (result.admissible & result.stable, {"color": _LINE, "linewidth": 1.8, "zorder": 3}, "stable"),
        (result.admissible & ~result.stable, {"color": _LINE, "linewidth": 1.2, "linestyle": "--"}, "unstable"),
        (~result.admissible, {"color": _PALE, "linewidth": 1.0}, "not admissible: virtual impact or further contact"),
    )
    for chosen, style, text in kinds:
        if not chosen.any():
            continue
        # with the point before and after each stretch, so that stretches meet
        reach = chosen | np.append(chosen[1:], False) | np.append(False, chosen[:-1])
        shown = chosen if text == "stable" else reach
        for impact in range(speeds.shape[1]):
            line = np.where(shown, speeds[:, impact], np.nan)
            ax.plot(result.parameter, line, label=text if impact == 0 else None, **style)
    seen: set[str] = set()
    for point in result.special_points:
        marker, colour, text = BIFURCATIONS[point.type]
        heights = (point.velocities[: len(result.stops)] * result.stops).tolist()
        style = {"marker": marker, "color": colour, "markersize": 6, "linestyle": "none", "zorder": 5}
        label = None if point.type in seen else text
        seen.add(point.type)
        fill = colour if point.admissible else "white"
        ax.plot([point.parameter] * len(heights), heights, label=label, markerfacecolor=fill, **style)
    ax.axhline(0.0, color=INK, linewidth=0.5, zorder=0)
    # virtual impacts may be many times as fast as real ones
    low, high = ax.get_ylim()
    ax.set_ylim(max(low, -_VIRTUAL * high), high)
    ax.set_xlabel(axis_label(result.meta["request"]["vary"], result.units))
    ax.set_ylabel("impact speed" + (" (m/s)" if result.units == "SI" else ""))
    stops = "".join("A" if stop > 0 else "C" for stop in result.stops)
    ax.set_title(f"Branch of period {result.period}, impacts {stops or 'not found'}, {_fixed(result)}", fontsize=10)
    if result.reason:
        ax.text(0.5, 0.5, result.reason, transform=ax.transAxes, ha="center", wrap=True, fontsize=8)
    legend_outside(ax)
    return ax
