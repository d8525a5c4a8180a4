"""Basins of attraction, with states coloured by the motion that they lead to, and basin fractions along a parameter."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import (
    Drawing,
    axis_label,
    cell_borders,
    chance_text,
    draws,
    legend_square,
    point_text,
    share_text,
)
from grazemap.plots.hatching import hatch_sensitive
from grazemap.plots.palette import OTHER, PAPER, UNRESOLVED, entry_text, motion_colours
from grazemap.plots.wordings import unit_wording
from grazemap.results import BasinFractions, Basins, ChanceToSettle, MotionShare
from grazemap.wire import BasinCoordinate
from grazemap.wire.planes import AXES

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@draws(Basins, width=9.0, height=6.5)
def plot_basins(result: Basins, drawing: Drawing, colours: Mapping[str, str] | None, hatching: bool) -> Axes:
    """Draw the rectangle of initial states; the legend names the attractors with their shares."""
    from matplotlib.colors import ListedColormap

    axes = (BasinCoordinate.model_validate(result.meta["request"][name]) for name in AXES)
    x, y = ("initial " + axis_label(axis.quantity, result.units, axis.mass) for axis in axes)
    rows, columns = result.label.shape
    pen = drawing.describe(x, y, "Basins of attraction at " + point_text(result) + f", {rows} × {columns} states")
    ax = drawing.ax
    motions = [attractor.motion for attractor in result.attractors]
    shown = motion_colours(motions, colours)
    for colour, text in zip(shown, _texts(motions, result.chance_to_settle), strict=True):
        if colour != OTHER:
            legend_square(ax, colour, text)
    rest = [motion.share for motion, colour in zip(motions, shown, strict=True) if colour == OTHER]
    if rest:
        legend_square(ax, OTHER, f"{len(rest)} other attractors ({share_text(sum(rest))})")
    if result.unresolved > 0.0:
        legend_square(ax, UNRESOLVED, f"unresolved ({result.unresolved:.1%})")
    pen.pcolormesh(
        cell_borders(result.horizontal),
        cell_borders(result.vertical),
        result.label,
        cmap=ListedColormap([UNRESOLVED, *shown]),
        vmin=-1.5,
        vmax=len(shown) - 0.5,
        rasterized=True,
    )
    if hatching:
        hatch_sensitive(pen, result.horizontal, result.vertical, result.sensitive)
    drawing.show_legend(handlelength=1.4, labelspacing=0.35)
    return ax


@draws(BasinFractions, width=10.0, height=5.5)
def plot_basin_fractions(
    result: BasinFractions, drawing: Drawing, motions: int, colours: Mapping[str, str] | None
) -> Axes:
    """Draw the shares over the parameter, as areas on top of each other, in the order of the attractors.

    `motions` is the number of attractors with a colour and a legend entry of their own; those with the largest shares
    are chosen. All others are drawn as "other".
    """
    states = result.meta["request"]["states"]
    title = "Basin fractions, " + point_text(result) + f", {states} states"
    pen = drawing.describe(axis_label(result.vary, result.units), unit_wording("share of the initial states"), title)
    ax, every = drawing.ax, result.motions()
    chosen = np.sort(np.argsort([-motion.share for motion in every], kind="stable")[:motions])
    assigned = motion_colours([every[i] for i in chosen], colours)
    # a motion with the colour of "other" has no area of its own
    coloured = {int(i): colour for i, colour in zip(chosen, assigned, strict=True) if colour != OTHER}
    shown, drawn = [every[i] for i in coloured], list(coloured.values())
    areas, texts = [result.share[i] for i in coloured], _texts(shown, result.chance_to_settle)
    other_count = len(every) - len(shown)
    if other_count:
        areas.append(result.share.sum(axis=0) - np.sum(areas, axis=0))
        drawn, texts = [*drawn, OTHER], [*texts, f"{other_count} other motions"]
    if np.any(result.unresolved > 0.0):
        areas.append(result.unresolved)
        drawn, texts = [*drawn, UNRESOLVED], [*texts, f"unresolved ({share_text(float(result.unresolved.mean()))})"]
    pen.stackplot(result.parameter, areas, colors=drawn, edgecolor=PAPER, linewidth=0.4)
    for colour, text in zip(drawn, texts, strict=True):
        legend_square(ax, colour, text)
    pen.set_xlim(result.parameter[0], result.parameter[-1])
    ax.set_ylim(0.0, 1.0)
    drawing.show_legend(handlelength=1.4, labelspacing=0.35)
    return ax


def _texts(motions: Sequence[MotionShare], chance: ChanceToSettle | None) -> list[str]:
    """Return the legend texts of motions with their shares. Motions of equal names are numbered from the second on."""
    seen: Counter[str] = Counter()
    texts = []
    for motion in motions:
        seen[motion.label] += 1
        which = f", {seen[motion.label]}" if seen[motion.label] > 1 else ""
        text = f"{entry_text(motion)}{which} ({share_text(motion.share)}){chance_text(motion.kind, chance)}"
        texts.append(text)
    return texts
