"""The axes of a map of any two parameters, and the curves and points over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import Drawing, cell_borders, parameter_label, rimmed
from grazemap.plots.bifurcation_curves import draw_bifurcation_curves
from grazemap.plots.grazing_curve import draw_curve, draw_graze, draw_points, meets_other_stop
from grazemap.plots.palette import INK
from grazemap.plots.pen import Pen
from grazemap.results import BifurcationCurves, CodimensionTwoPoints, GrazingCurve, StopGrazingCurves, UnfoldingMap
from grazemap.wire.structure import SIDES

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def describe_map(umap: UnfoldingMap, drawing: Drawing, title: str) -> Pen:
    """Label the axes of a map, and return what draws on them."""
    across, up = (parameter_label(name, umap.units) for name in umap.parameters)
    return drawing.describe(across, up, title)


def draw_curves_and_points(
    pen: Pen,
    umap: UnfoldingMap,
    curve: GrazingCurve | StopGrazingCurves | None,
    points: CodimensionTwoPoints | None,
    curves: BifurcationCurves | Sequence[BifurcationCurves] | None,
    margins: bool = True,
) -> None:
    """Draw curves and codimension-two points over a map.

    With `margins` the grazing curves are drawn too, as the lines on which the margins of the map are 0.
    """
    across, up = cell_borders(umap.horizontal), cell_borders(umap.vertical)
    if curves is not None:
        draw_bifurcation_curves(pen, curves, halo=True)
    if margins:
        _draw_margins(pen, umap)
    if curve is not None:
        _draw_grazes(pen, umap, curve)
    if points is not None:
        stop = {"clearance_right": 1, "clearance_left": -1}.get(umap.parameters[1])
        drawn = [point for point in points.points if stop is None or point.stop in (None, stop)]
        inside = [point for point in drawn if up[0] <= point.clearance <= up[-1]]
        draw_points(pen, inside, (float(across[0]), float(across[-1])), rim=True)


def leave_out_of_legend(ax: Axes) -> None:
    """Remove lines that lie wholly outside the axes from the legend."""
    for line in ax.lines:
        if np.size(line.get_xdata()) and not line.get_path().intersects_bbox(ax.viewLim, filled=False):
            line.set_label("_nolegend_")


def _draw_grazes(pen: Pen, umap: UnfoldingMap, curve: GrazingCurve | StopGrazingCurves) -> None:
    """Draw the grazing curves of the stops that vary in a map, dashed where the steady motion meets the other stop.

    Raises
    ------
    ValueError
        The curve is that of a stop that does not vary in the map.
    """
    varied, parameters = umap.parameters[1], umap.plane.parameters
    if varied == "clearance" and isinstance(curve, GrazingCurve):
        draw_curve(pen, curve, halo=True)
        return
    drawn = [stop for stop in SIDES if varied in ("clearance", f"clearance_{stop}")]
    grazes = {stop: getattr(curve, f"clearance_{stop}") for stop in drawn}
    if all(clearance is None for clearance in grazes.values()):
        raise ValueError(
            f"the map is over the clearance of the {drawn[0]} stop, and the curve is that of the other one"
        )
    for stop, clearance in grazes.items():
        if clearance is None:
            continue
        opposite = SIDES[1 - SIDES.index(stop)]
        fixed = clearance if varied == "clearance" else getattr(parameters, opposite)
        virtual = meets_other_stop(parameters.oscillator, curve.omega, stop, fixed)
        draw_graze(pen, stop, curve.omega, clearance, virtual, halo=True)


def _draw_margins(pen: Pen, umap: UnfoldingMap) -> None:
    """Draw the lines on which the margins of a stop are 0, if the map has margins."""
    for margin, style, text in ((umap.margin_right, "-", "right"), (umap.margin_left, "--", "left")):
        if margin is None or not (np.any(margin < 0.0) and np.any(margin > 0.0)):
            continue
        drawn = pen.contour(
            umap.horizontal, umap.vertical, margin, levels=[0.0], colors=INK, linestyles=style, linewidths=1.4, zorder=3
        )
        drawn.set_path_effects(rimmed(3.0))
        pen.plot([], [], color=INK, linestyle=style, label=f"grazing, {text} stop")
