"""Basins of attraction: initial states coloured by the motion that they lead to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING

from grazemap.plots.axes import Drawing, axis_label, cell_borders, chance_text, legend_square, place_text, share_text
from grazemap.plots.hatching import hatch_sensitive
from grazemap.plots.palette import UNRESOLVED, motion_colours, motion_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import Basins


def plot_basins(result: Basins, drawing: Drawing, given: Mapping[str, str] | None = None) -> Axes:
    """Draw the rectangle of initial states; the legend names the attractors with their shares.

    `given` are colours of motions by label or kind.
    """
    from matplotlib.colors import ListedColormap

    ax = drawing.ax
    colours = motion_colours([attractor.motion for attractor in result.attractors], given)
    seen: Counter[str] = Counter()
    for colour, attractor in zip(colours, result.attractors, strict=True):
        motion = attractor.motion
        seen[motion.label] += 1
        which = f", {seen[motion.label]}" if seen[motion.label] > 1 else ""
        chance = chance_text(motion.kind, result.chance_to_settle)
        legend_square(ax, colour, f"{motion_text(motion)}{which} ({share_text(motion.share)}){chance}")
    if result.unresolved > 0.0:
        legend_square(ax, UNRESOLVED, f"unresolved ({result.unresolved:.1%})")
    ax.pcolormesh(
        cell_borders(result.horizontal),
        cell_borders(result.vertical),
        result.label,
        cmap=ListedColormap([UNRESOLVED, *colours]),
        vmin=-1.5,
        vmax=len(colours) - 0.5,
        rasterized=True,
    )
    hatch_sensitive(ax, result.horizontal, result.vertical, result.sensitive)
    request = result.meta["request"]
    x, y = (
        "initial " + axis_label(request[name]["quantity"], result.units, request[name]["mass"])
        for name in ("horizontal", "vertical")
    )
    rows, columns = result.label.shape
    where = place_text(result.units, omega=request["omega"], clearance=request["clearance"])
    drawing.describe(x, y, f"Basins of attraction at {where}, {rows} × {columns} states")
    drawing.show_legend(handlelength=1.4, labelspacing=0.35)
    return ax
