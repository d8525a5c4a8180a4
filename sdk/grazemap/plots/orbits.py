"""Pictures of periodic orbits: multipliers and the unit circle, and the speeds of a branch over a parameter."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import Drawing, draws, parameter_label, point_text
from grazemap.plots.layout import Name
from grazemap.plots.palette import BIFURCATIONS, INK, LINE, PALE_LINE, label_text
from grazemap.plots.pen import Pen
from grazemap.plots.smooth import smooth_pieces
from grazemap.plots.wordings import Wording, unit_wording
from grazemap.results import OrbitBranch, PeriodicOrbit, SpecialPoint
from grazemap.results.stretches import Knots
from grazemap.wire import impacts_on, motion_label
from grazemap.wire.structure import SIDES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The axis of speeds begins at this share of its upper end below 0, so that symbols at 0 are whole.
_BELOW_ZERO = 0.03
# Multipliers along a branch with a larger modulus are not drawn.
_MAX_MODULUS = 3.0
# Share of the height that is added to a picture for a scale of colours inside it.
_BAR_SPACE = 0.25
# Share of the height of the axes: lines that are closer have one text for their impacts.
_MERGED_DISTANCE = 0.025
# Styles of the stretches of a branch.
STYLES: dict[str, dict[str, Any]] = {
    "stable": {"color": LINE, "linewidth": 1.8, "zorder": 3},
    "unstable": {"color": LINE, "linewidth": 1.2, "linestyle": (0, (5, 2)), "zorder": 2},
    "not admissible": {"color": PALE_LINE, "linewidth": 1.0, "zorder": 1},
}

Floats = NDArray[np.float64]


@draws(PeriodicOrbit, width=5.5, height=5.5)
def plot_multipliers(result: PeriodicOrbit, drawing: Drawing) -> Axes:
    """Draw the multipliers of an orbit and the unit circle."""
    name = label_text(result.motion.label) if result.motion.label else "no orbit"
    _describe_circle(drawing, f"Multipliers of {name}, {result.said}")
    if not result.converged:
        drawing.write_reason(f"no orbit was found: {result.reason}")
        return drawing.ax
    ax = _unit_circle(drawing)
    inside = np.abs(result.multipliers) < 1.0
    for chosen, colour in ((inside, LINE), (~inside, BIFURCATIONS["SN"][1])):
        points = result.multipliers[chosen]
        ax.plot(points.real, points.imag, linestyle="none", marker="o", markersize=5, color=colour)
    return ax


@draws(OrbitBranch, "plot_multipliers", width=5.5, height=5.5)
def plot_branch_multipliers(result: OrbitBranch, drawing: Drawing) -> Axes:
    """Draw the multipliers of all orbits of a branch and the unit circle, coloured by the parameter.

    Multipliers of inadmissible orbits are pale. Multipliers far outside the circle, as near a graze, are not shown.
    """
    _describe_circle(drawing, f"Multipliers along a branch of period {result.period}, " + point_text(result))
    if not len(result.parameter):
        drawing.write_reason(f"no branch was found: {result.reason}")
        return drawing.ax
    from matplotlib.ticker import MaxNLocator

    ax = _unit_circle(drawing)
    label = parameter_label(result.meta["request"]["axis"]["vary"], result.units)
    parameter = drawing.colour_values(result.parameter, label)
    value = np.broadcast_to(parameter[:, None], result.multipliers.shape)
    low, high = float(parameter.min()), float(parameter.max())
    for chosen, alpha in ((~result.admissible, 0.3), (result.admissible, 1.0)):
        points, colour = result.multipliers[chosen].ravel(), value[chosen].ravel()
        near = np.abs(points) < _MAX_MODULUS
        x, y = points[near].real, points[near].imag
        drawn = ax.scatter(x, y, s=10, c=colour[near], alpha=alpha, vmin=low, vmax=high, cmap="viridis", zorder=3)
    if drawing.legend == "outside":
        drawing.show_scale(drawn, label)
    elif drawing.legend == "inside":
        # the view is extended below the points, to make room for the scale
        bottom, top = ax.dataLim.intervaly
        ax.update_datalim([(0.0, bottom - _BAR_SPACE * (top - bottom))])
        bar = ax.inset_axes((0.05, 0.09, 0.5, 0.03))
        ax.figure.colorbar(drawn, cax=bar, orientation="horizontal", ticks=MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        drawing.describe_axis(bar.xaxis, label, partial(bar.set_title, fontsize=7))
        bar.tick_params(labelsize=6)
    return ax


def _describe_circle(drawing: Drawing, title: Wording | str) -> None:
    drawing.describe(unit_wording("real part"), unit_wording("imaginary part"), title)


def _unit_circle(drawing: Drawing) -> Axes:
    ax = drawing.ax
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    ax.plot(np.cos(turn), np.sin(turn), color=INK, linewidth=0.9)
    for value in (ax.axhline, ax.axvline):
        value(0.0, color=PALE_LINE, linewidth=0.5, zorder=0)
    ax.set_aspect("equal", adjustable="datalim")
    ax.locator_params(nbins=6)
    return ax


def plot_branch(result: OrbitBranch, drawing: Drawing, colour: str | None, label: str | None) -> Axes:
    """Draw the speed of every impact over the parameter.

    Stable motions are solid, unstable motions dashed, inadmissible orbits pale; these stretches end at special points,
    which are marked on the lines of all impacts. A branch may retrace itself, as mirror images or shifted by forcing
    periods; it is drawn once. `colour` is the colour of the motions, `label` the name of the branch in the legend.
    """
    ax = drawing.ax
    pen = drawing.describe(
        parameter_label(result.meta["request"]["axis"]["vary"], result.units),
        unit_wording("impact speed", "m/s", result.units),
        ("Impact speeds along branches, " if label else f"{named_branch(result)}, ") + point_text(result),
    )
    if not len(result.parameter):
        drawing.write_reason(f"no branch was found: {result.reason}")
        return ax
    prefix = "" if label is None else f"{label}, "
    for kind, line in _lines(result).items():
        style = STYLES[kind] | ({"color": colour} if colour and kind != "not admissible" else {})
        for impact in range(1, line.shape[1]):
            pen.plot(line[:, 0], line[:, impact], label=prefix + kind if impact == 1 and len(line) else None, **style)
    seen: set[str] = set()
    # the legend shows a type as at an admissible orbit, if there is one
    for point in sorted(result.special_points, key=lambda point: not point.admissible):
        marker, point_colour, text = BIFURCATIONS[point.type]
        heights = _speeds(result, point).tolist()
        style = {"marker": marker, "color": point_colour, "markersize": 6, "linestyle": "none", "zorder": 5}
        name = None if point.type in seen else text
        seen.add(point.type)
        fill = point_colour if point.admissible else "white"
        pen.plot([point.parameter] * len(heights), heights, label=name, markerfacecolor=fill, **style)
    ax.axhline(0.0, color=INK, linewidth=0.5, zorder=0)
    # virtual impacts of inadmissible orbits have negative speeds
    low, high = ax.get_ylim()
    ax.set_ylim(max(low, -_BELOW_ZERO * high), high)
    if drawing.labels:
        _name_stops(drawing, pen, result)
    drawing.show_legend()
    return ax


def _speeds(result: OrbitBranch, point: SpecialPoint) -> Floats:
    return point.velocities[: len(result.stops)] * result.stops


def named_branch(result: OrbitBranch) -> str:
    """Return the name of a branch."""
    if not len(result.stops):
        return f"Branch of period {result.period}"
    knots = result.knots()
    images = " and its mirror image" if any(knots.types[i] == "SB" for i in knots.turns()) else ""
    return f"Branch of {label_text(motion_label(result.period, *impacts_on(result.stops)))}{images}"


def _name_stops(drawing: Drawing, pen: Pen, result: OrbitBranch) -> None:
    """Write r or l, the stop of the impacts, at the end of admissible orbits where most lines are separate.

    Nothing is written where all impacts are on one stop.
    """
    if len({*result.stops.tolist()}) < len(SIDES):
        return
    knots = result.knots()
    first, last = _drawn_once(knots)
    if first == last:  # a single orbit has no line
        return
    admissible = [kind != "not admissible" for kind in knots.kinds]
    if not any(admissible[first:last]):
        admissible = [True] * len(admissible)
    ends: dict[int, int] = {}  # knots next to admissible orbits on one side only, and on which: 1 after, -1 before
    for knot in range(first, last + 1):
        before, after = knot > first and admissible[knot - 1], knot < last and admissible[knot]
        if before != after:
            ends[knot] = 1 if after else -1
    low, high = pen.get_ylim()
    groups = {
        knot: _close_groups(knots.path[knot, 1 : 1 + len(result.stops)], _MERGED_DISTANCE * (high - low))
        for knot in ends
    }
    end = max(ends, key=lambda knot: (len(groups[knot]), float(knots.path[knot, 0])))
    side = -1 if knots.path[end + ends[end], 0] > knots.path[end, 0] else 1
    style: dict[str, Any] = {"fontsize": 7, "va": "center", "annotation_clip": True}
    for group in groups[end]:
        text = ", ".join(sorted({"r" if result.stops[impact] > 0 else "l" for impact in group}))
        place = float(knots.path[end, 0]), float(np.mean(knots.path[end, 1:][group]))
        name = pen.annotate(text, place, (6 * side, 0), color=INK, ha="left" if side > 0 else "right", **style)
        drawing.names.append(Name(name))
    for stop, text in ((1, "right"), (-1, "left")):
        if np.any(result.stops == stop):
            marker = f"${text[0]}$"
            pen.plot([], [], linestyle="none", marker=marker, color=INK, label=f"impacts on the {text} stop")


def _close_groups(heights: Floats, distance: float) -> list[list[int]]:
    """Return the indices of heights in groups: within a group, neighbouring heights are closer than a distance."""
    order = np.argsort(heights)
    groups = np.split(order, np.flatnonzero(np.diff(heights[order]) >= distance) + 1)
    return [group.tolist() for group in groups]


def _drawn_once(knots: Knots) -> tuple[int, int]:
    """Return the first and last knot of a part of a branch that has all its motions, or their mirror images."""
    last = len(knots.types) - 1
    back = [i for i in knots.turns() if knots.types[i] in ("SB", "PD")]
    if not back:
        return 0, last
    if len(back) > 1:
        return back[0], back[1]
    # the two sides have the same motions; one of them may have been followed further
    lengths = np.linalg.norm(np.diff(knots.path, axis=0), axis=1)
    return (0, back[0]) if lengths[: back[0]].sum() > lengths[back[0] :].sum() else (back[0], last)


def _lines(result: OrbitBranch) -> dict[str, Floats]:
    """Return the lines of stable, unstable and inadmissible orbits: parameter and speeds, (points, 1 + impacts).

    Pieces of a line are separated by NaN. They begin and end at special points where there are some, so that stable
    motions that graze end at the graze.
    """
    knots = result.knots()
    points = knots.path[:, : 1 + len(result.stops)]
    gap = np.full((1, points.shape[1]), np.nan)
    lines: dict[str, list[Floats]] = {kind: [np.empty((0, points.shape[1]))] for kind in STYLES}
    pieces, (first, last) = list(smooth_pieces(knots.path, points)), _drawn_once(knots)
    for number in range(first, last):
        piece, kind = pieces[number], knots.kinds[number]
        goes_on = number > first and knots.kinds[number - 1] == kind
        lines[kind] += [piece[1:]] if goes_on else [gap, piece]
    return {kind: np.concatenate(line) for kind, line in lines.items()}
