"""Observables and outputs of motions: over the plane of a map, and along a branch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import Drawing, cell_borders, parameter_label, record_unit
from grazemap.plots.map_axes import describe_map, draw_curves_and_points
from grazemap.plots.orbits import STYLES, named_branch
from grazemap.plots.palette import BIFURCATIONS, OTHER

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import (
        BifurcationCurves,
        CodimensionTwoPoints,
        GrazingCurve,
        OrbitBranch,
        StopGrazingCurves,
        UnfoldingMap,
    )
    from grazemap.results.observables import Quantity


def quantity_label(quantity: Quantity) -> str:
    """Return the text of an axis, with the unit in SI."""
    return f"{quantity.name} ({quantity.unit})" if quantity.unit not in ("", "nondimensional") else quantity.name


def plot_over_plane(
    umap: UnfoldingMap,
    drawing: Drawing,
    quantity: Quantity,
    curve: GrazingCurve | StopGrazingCurves | None = None,
    points: CodimensionTwoPoints | None = None,
    curves: BifurcationCurves | Sequence[BifurcationCurves] | None = None,
) -> Axes:
    """Draw a quantity over a map with its scale, grey where there is none, and over it the curves and points given."""
    ax, across, up = drawing.ax, cell_borders(umap.horizontal), cell_borders(umap.vertical)
    ax.set_facecolor(OTHER)
    drawn = ax.pcolormesh(across, up, np.ma.masked_invalid(quantity.values), cmap="viridis", rasterized=True)
    label = quantity_label(quantity)
    if drawing.legend != "none":
        bar = ax.figure.colorbar(drawn, ax=ax, shrink=0.8).ax
        record_unit(bar.yaxis, label)
        if drawing.labels:
            bar.set_ylabel(label)
    draw_curves_and_points(ax, umap, curve, points, curves)
    ax.set_xlim(across[0], across[-1])
    ax.set_ylim(up[0], up[-1])
    describe_map(umap, drawing, f"Unfolding map: {quantity.name} of the motions")
    return ax


def plot_along_branch(
    branch: OrbitBranch, drawing: Drawing, quantity: Quantity, colour: str | None = None, label: str | None = None
) -> Axes:
    """Draw a quantity of the motions of a branch over the parameter: stable ones solid, unstable ones dashed.

    Special points between two motions are marked.
    """
    ax = drawing.ax
    vary = parameter_label(branch.meta["request"]["vary"], branch.units)
    title = f"{quantity.name} along branches" if label else f"{named_branch(branch)}: {quantity.name}"
    drawing.describe(vary, quantity_label(quantity), title)
    if not len(branch.parameter):
        drawing.say(f"no branch was found: {branch.reason}")
        return ax
    named = "" if label is None else f"{label}, "
    for kind, chosen in (("stable", branch.stable), ("unstable", ~branch.stable)):
        # a line goes on to the next orbit, of whatever kind
        shown = chosen.copy()
        shown[1:] |= chosen[:-1]
        if not np.any(chosen & branch.admissible):
            continue
        style: dict[str, Any] = STYLES[kind] | ({"color": colour} if colour else {})
        ax.plot(branch.parameter, np.where(shown, quantity.values, np.nan), label=named + kind, **style)
    seen: set[str] = set()
    for point in branch.special_points:
        ends = quantity.values[point.segment : point.segment + 2]
        if not np.all(np.isfinite(ends)):  # as at a graze, beyond which there is no motion
            continue
        marker, of_type, text = BIFURCATIONS[point.type]
        style = {"marker": marker, "color": of_type, "markersize": 6, "linestyle": "none", "zorder": 5}
        ax.plot([point.parameter], [np.mean(ends)], label=None if point.type in seen else text, **style)
        seen.add(point.type)
    drawing.show_legend()
    return ax
