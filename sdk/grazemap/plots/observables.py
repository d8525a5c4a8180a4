"""Observables and outputs of motions: over the plane of a map, and along a branch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import Drawing, cell_borders, draws, parameter_label, quantity_label
from grazemap.plots.map_axes import describe_map, draw_curves_and_points, leave_out_of_legend
from grazemap.plots.orbits import STYLES, named_branch, plot_branch
from grazemap.plots.palette import BIFURCATIONS, OTHER
from grazemap.results import (
    BifurcationCurves,
    CodimensionTwoPoints,
    GrazingCurve,
    OrbitBranch,
    StopGrazingCurves,
    UnfoldingMap,
)
from grazemap.results.observables import Quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_over_plane(
    umap: UnfoldingMap,
    drawing: Drawing,
    quantity: Quantity,
    curve: GrazingCurve | StopGrazingCurves | None,
    points: CodimensionTwoPoints | None,
    curves: BifurcationCurves | Sequence[BifurcationCurves] | None,
) -> Axes:
    """Draw a quantity over the plane of a map, with a scale of colours, curves and points; grey where it is NaN."""
    ax, across, up = drawing.ax, cell_borders(umap.horizontal), cell_borders(umap.vertical)
    pen, label = describe_map(umap, drawing, f"Unfolding map: {quantity.name} of the motions"), quantity_label(quantity)
    ax.set_facecolor(OTHER)
    values = np.ma.masked_invalid(drawing.colour_values(quantity.values, label))
    drawn = pen.pcolormesh(across, up, values, cmap="viridis", rasterized=True)
    if drawing.legend != "none":
        drawing.show_scale(drawn, label)
    draw_curves_and_points(pen, umap, curve, points, curves)
    pen.set_xlim(across[0], across[-1])
    pen.set_ylim(up[0], up[-1])
    leave_out_of_legend(ax)
    drawing.show_legend(handlelength=2.6)
    return ax


@draws(OrbitBranch)
def plot_along_branch(
    branch: OrbitBranch, drawing: Drawing, quantity: Quantity | None, colour: str | None, label: str | None
) -> Axes:
    """Draw a quantity of the motions of a branch over the parameter: stable ones solid, unstable ones dashed.

    Special points between two motions are marked. Without a quantity the speeds of the impacts are drawn.
    """
    if quantity is None:
        return plot_branch(branch, drawing, colour, label)
    ax = drawing.ax
    vary = parameter_label(branch.meta["request"]["axis"]["vary"], branch.units)
    title = f"{quantity.name} along branches" if label else f"{named_branch(branch)}: {quantity.name}"
    pen = drawing.describe(vary, quantity_label(quantity), title)
    if not len(branch.parameter):
        drawing.write_reason(f"no branch was found: {branch.reason}")
        return ax
    prefix = "" if label is None else f"{label}, "
    order = [*range(len(branch.parameter)), *([0] if branch.closed else [])]
    for kind, stable in (("stable", branch.stable), ("unstable", ~branch.stable)):
        chosen = stable[order]
        # a line goes on to the next orbit, of whatever kind
        shown = chosen.copy()
        shown[1:] |= chosen[:-1]
        if not np.any(stable & branch.admissible):
            continue
        style: dict[str, Any] = STYLES[kind] | ({"color": colour} if colour else {})
        values = np.where(shown, quantity.values[order], np.nan)
        pen.plot(branch.parameter[order], values, label=prefix + kind, **style)
    seen: set[str] = set()
    for point in branch.special_points:
        ends = quantity.values[point.segment : point.segment + 2]
        if not np.all(np.isfinite(ends)):  # for example at a graze, beyond which there is no motion
            continue
        marker, of_type, text = BIFURCATIONS[point.type]
        style = {"marker": marker, "color": of_type, "markersize": 6, "linestyle": "none", "zorder": 5}
        pen.plot([point.parameter], [np.mean(ends)], label=None if point.type in seen else text, **style)
        seen.add(point.type)
    drawing.show_legend()
    return ax
