"""The unfolding diagram: the regions of a map, and the curves that are their borders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import Drawing, cell_borders, draws, rimmed
from grazemap.plots.bifurcation_curves import curve_style
from grazemap.plots.grazing_curve import draw_curve, draw_plane_grazes
from grazemap.plots.palette import BIFURCATIONS, INK, PAPER, UNEXPLAINED
from grazemap.plots.pen import Pen
from grazemap.plots.smooth import smooth_line
from grazemap.plots.unfolding import plot_unfolding_map
from grazemap.results import MapBorders, UnfoldingDiagram, UnfoldingMap
from grazemap.results.base import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@draws(UnfoldingDiagram, width=10.5, height=6.5)
def plot_unfolding_diagram(diagram: UnfoldingDiagram, drawing: Drawing, **options: Any) -> Axes:
    """Draw a map, its grazing curve and the curves that explain borders, one colour for each type.

    Borders of basins of attraction are white, unexplained borders magenta. A diagram without borders has the
    bifurcation curves in closed form instead. `options` are keywords of `plot_unfolding_map`.
    """
    borders, umap = diagram.borders, diagram.unfolding_map
    size = f"{len(umap.vertical)} × {len(umap.horizontal)} points"
    note = "; no border between mirror images" if borders is not None and diagram.mirrors else ""

    def draw_overlay(pen: Pen) -> None:
        for curve in (diagram.grazing_curve, diagram.stop_grazing_curves):
            if curve is not None:
                draw_curve(pen, curve, halo=True)
        if diagram.grazing_curves is not None:
            draw_plane_grazes(pen, diagram.grazing_curves, both=diagram.mirrors)
        if borders is not None:
            _draw_borders(pen, umap, borders)

    return plot_unfolding_map(
        umap,
        drawing,
        points=diagram.codimension_two_points,
        curves=diagram.bifurcation_curves if borders is None else None,
        title=f"Unfolding diagram: motions $n$-$p_r$-$q_l$, {size}{note}",
        overlay=draw_overlay,
        margins=diagram.grazing_curves is None,
        **options,
    )


def _draw_borders(pen: Pen, umap: UnfoldingMap, borders: MapBorders) -> None:
    _draw_border_curves(pen, borders)
    for name, colour, text in (
        ("coexistence", PAPER, "basin boundary: both motions attract"),
        ("unexplained", UNEXPLAINED, "unexplained border"),
    ):
        chosen = np.flatnonzero(borders.where(name) & borders.regular)
        _draw_steps(pen, umap, borders, chosen.tolist(), colour, text)


def _draw_border_curves(pen: Pen, borders: MapBorders) -> None:
    """Draw the curves that explain a border, where their orbits are admissible; grazing curves are drawn elsewhere."""
    for kind, (_, _, name) in BIFURCATIONS.items():
        chosen = [curve for curve in borders.curves if curve.type == kind and curve.pairs]
        chosen = [curve for curve in chosen if max(curve.impacts_right, curve.impacts_left) > 0]
        style = curve_style(kind, 1.0, halo=True)
        for place, curve in enumerate(chosen):
            across, up = smooth_line(curve.line, curve.line, curve.admissible).T
            label = f"{name}, {counted(chosen, 'curve')}" if place == 0 else None
            pen.plot(across, up, label=label, zorder=3, **style)


def _draw_steps(pen: Pen, umap: UnfoldingMap, borders: MapBorders, chosen: list[int], colour: str, text: str) -> None:
    """Draw the side between the two cells of each chosen pair of neighbouring points."""
    if not chosen:
        return
    across, up = cell_borders(umap.horizontal), cell_borders(umap.vertical)
    lines = []
    for k in chosen:
        row, column = int(borders.row[k]), int(borders.column[k])
        if borders.along[k] == 0:
            lines.append([(across[column], up[row + 1]), (across[column + 1], up[row + 1])])
        else:
            lines.append([(across[column + 1], up[row]), (across[column + 1], up[row + 1])])
    pen.segments(lines, colors=INK, linewidths=2.2, zorder=3, capstyle="round")
    pen.segments(lines, colors=colour, linewidths=1.2, zorder=3.1, capstyle="round")
    label = f"{text} ({counted(chosen, 'step')})"
    pen.plot([], [], linestyle="-", color=colour, linewidth=1.8, path_effects=rimmed(2.8, INK), label=label)
