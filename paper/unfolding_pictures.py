"""The pictures of Figure 8: the map over the paper's window, the curves that divide it, and a close-up."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from grazemap import BifurcationCurves, CodimensionTwoPoints, GrazingCurve, UnfoldingMap
from grazemap.plots.axes import drawing
from grazemap.plots.palette import INK
from grazemap.results import BifurcationCurve
from paper.paper import GAMMA, POINT_CLEARANCE, POINT_OMEGA, REGIONS
from paper.samples import Sample

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LABEL = "grazing curve, dashed as in the paper"
# Okabe and Ito's, but for black and yellow, and two darker ones.
COLOURS = ("#D55E00", "#56B4E9", "#E69F00", "#0072B2", "#009E73", "#CC79A7", "#7A3E9D", "#8B6B00")
STYLES = {"SN": ("-", 1.6), "PD": ("--", 1.6), "SB": ("-.", 1.4), "NS": (":", 1.8), "GR": ("-", 0.7)}
NAMES = {"SN": "saddle-node (SN)", "PD": "period doubling (PD)", "SB": "symmetry breaking (SB)",
         "NS": "Neimark-Sacker (NS)", "GR": "graze (GR)"}  # fmt: skip
CROWDED = 0.012


def regions(umap: UnfoldingMap, curve: GrazingCurve, points: CodimensionTwoPoints, samples: Sequence[Sample]) -> Axes:
    """Draw the map with the grazing curve, its points, and the letters of Figure 9 along the paper's two lines."""
    from matplotlib.patheffects import withStroke

    place = drawing(None, None, labels=True, width=12.0, height=8.0)
    ax = umap.plot(place.ax, points=points, motions=16, legend="none")
    _dashed(ax, curve)
    for omega, ((high, low), _) in REGIONS.items():
        ax.plot([omega, omega], [low, high], color=INK, linewidth=0.8, zorder=3)
    before = None
    for sample in samples:
        # letters that would lie on each other stand on either side of the line
        crowded = before is not None and before.omega == sample.omega and before.clearance - sample.clearance < CROWDED
        side = -1 if crowded else 1
        ax.text(
            sample.omega + side * 0.0004, sample.clearance, sample.region.letter, fontsize=8, fontweight="bold",
            color=INK, va="center", ha="right" if crowded else "left",
            path_effects=[withStroke(linewidth=2.0, foreground="white")], zorder=5,
        )  # fmt: skip
        ax.plot(sample.omega, sample.clearance, ".", color=INK, markersize=5, zorder=5)
        before = None if crowded else sample
    rows, columns = umap.kind.shape
    ax.set_title(f"Figure 8: motions from rest, {GAMMA}, {rows} × {columns} points", fontsize=10)
    place.show_legend(handlelength=1.4, labelspacing=0.35)
    return ax


def _dashed(ax: Axes, curve: GrazingCurve) -> None:
    from matplotlib.patheffects import Normal, withStroke

    ax.plot(
        curve.omega, curve.clearance, "--", color=INK, linewidth=1.4, label=LABEL, zorder=3,
        path_effects=[withStroke(linewidth=3.0, foreground="white"), Normal()],
    )  # fmt: skip


def curves_of_motions(curve: GrazingCurve, closed: BifurcationCurves, named: BifurcationCurves) -> Axes:
    """Draw the curves that are borders of motions: a colour for each motion, a line style for each type."""
    place = drawing(None, None, labels=True, width=12.0, height=8.0)
    ax = place.ax
    pieces = [piece for curves in (closed, named) for piece in curves.curves if piece.admissible]
    colours = dict(zip(dict.fromkeys(piece.motion for piece in pieces), cycle(COLOURS)))
    for piece in pieces:
        style, width = STYLES[piece.type]
        ax.plot(*piece.line.T, linestyle=style, linewidth=width, color=colours[piece.motion])
    for motion, colour in colours.items():
        ax.plot([], [], color=colour, linewidth=3.0, label=motion)
    for name, (style, width) in STYLES.items():
        if any(piece.type == name for piece in pieces):
            ax.plot([], [], linestyle=style, linewidth=width, color="#777777", label=NAMES[name])
    _dashed(ax, curve)
    for omega, ((high, low), _) in REGIONS.items():
        ax.plot([omega, omega], [low, high], color=INK, linewidth=0.6, zorder=1)
    ax.set_xlim(*closed.plane.horizontal.ends)
    ax.set_ylim(*closed.plane.vertical.ends)
    place.describe_plane("nondimensional", "Bifurcation curves of motions of Figure 9")
    place.show_legend(handlelength=3.0)
    return ax


def close_up(near: UnfoldingMap, curve: GrazingCurve, points: CodimensionTwoPoints, closed: BifurcationCurves) -> Axes:
    """Draw the map close to the point, with the curves that cross it."""
    inside = replace(closed, curves=tuple(piece for piece in closed.curves if _crosses(piece, near)))
    place = drawing(None, None, labels=True, width=12.0, height=7.0)
    ax = near.plot(place.ax, points=points, curves=inside, motions=5, legend="none")
    _dashed(ax, curve)
    ax.plot(
        POINT_OMEGA.value, POINT_CLEARANCE.value, "o", color="#0072B2", markersize=6, markeredgecolor="white",
        label="printed in the paper", zorder=6,
    )  # fmt: skip
    ax.set_title(f"Figure 8, close to the point with $\\xi_1$ = 0, {GAMMA}", fontsize=10)
    place.show_legend(handlelength=1.4, labelspacing=0.35)
    return ax


def _crosses(piece: BifurcationCurve, umap: UnfoldingMap) -> bool:
    """Whether a curve is seen in a map."""
    across = (piece.omega >= umap.horizontal[0]) & (piece.omega <= umap.horizontal[-1])
    return bool(np.any(across & (piece.clearance >= umap.vertical[0]) & (piece.clearance <= umap.vertical[-1])))
