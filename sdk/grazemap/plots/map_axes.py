"""The axes of a map of any two parameters, and the curves and points over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import Drawing, cell_borders, parameter_label, rimmed
from grazemap.plots.borders import draw_bifurcation_curves
from grazemap.plots.curve import draw_curve, draw_points
from grazemap.plots.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import BifurcationCurves, CodimensionTwoPoints, GrazingCurve, UnfoldingMap


def describe_map(umap: UnfoldingMap, drawing: Drawing, title: str) -> None:
    """Label the axes of a map."""
    across, up = (parameter_label(name, umap.units) for name in umap.parameters)
    drawing.describe(across, up, title)


def draw_curves_and_points(
    ax: Axes,
    umap: UnfoldingMap,
    curve: GrazingCurve | None,
    points: CodimensionTwoPoints | None,
    curves: BifurcationCurves | Sequence[BifurcationCurves] | None,
    margins: bool = True,
) -> None:
    """Draw the curves and the codimension-two points that are given over a map, and the grazing curves of its margins.

    Without `margins` the latter are not drawn.
    """
    across, up = cell_borders(umap.horizontal), cell_borders(umap.vertical)
    if curves is not None:
        draw_bifurcation_curves(ax, curves, halo=True)
    if margins:
        _draw_margins(ax, umap)
    if curve is not None:
        draw_curve(ax, curve, halo=True)
    if points is not None:
        inside = [point for point in points.points if up[0] <= point.clearance <= up[-1]]
        draw_points(ax, inside, (float(across[0]), float(across[-1])), rim=True)


def _draw_margins(ax: Axes, umap: UnfoldingMap) -> None:
    """Draw the grazing curves where the margins of the stops are 0, where the map has them."""
    for margin, style, text in ((umap.margin_right, "-", "right"), (umap.margin_left, "--", "left")):
        if margin is None or not (np.any(margin < 0.0) and np.any(margin > 0.0)):
            continue
        drawn = ax.contour(
            umap.horizontal, umap.vertical, margin, levels=[0.0], colors=INK, linestyles=style, linewidths=1.4, zorder=3
        )
        drawn.set_path_effects(rimmed(3.0))
        ax.plot([], [], color=INK, linestyle=style, label=f"grazing, {text} stop")
