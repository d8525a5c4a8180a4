"""Basins of attraction: initial states coloured by the motion that they lead to."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from grazemap.plots.axes import axes_or_new, axis_label, cell_borders, legend_outside, legend_square, place_text
from grazemap.plots.palette import UNRESOLVED, components, hexadecimal, motion_colour, motion_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import Basins

# Different motions with the same label have shades of its colour.
_SHADES = (0.0, 0.35, -0.35, 0.6, -0.6)


def plot_basins(result: Basins, ax: Axes | None = None) -> Axes:
    """Draw the rectangle of initial states; the legend names the attractors with their shares."""
    from matplotlib.colors import ListedColormap

    ax = axes_or_new(ax, 9.0, 6.5)
    colours: list[str] = []
    seen: Counter[str] = Counter()
    for attractor in result.attractors:
        motion = attractor.motion
        shade = _SHADES[seen[motion.label] % len(_SHADES)]
        seen[motion.label] += 1
        which = f", {seen[motion.label]}" if seen[motion.label] > 1 else ""
        colours.append(_shaded(motion_colour(motion), shade))
        legend_square(ax, colours[-1], f"{motion_text(motion)}{which} ({motion.share:.1%})")
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
    request = result.meta["request"]
    for name, put in (("horizontal", ax.set_xlabel), ("vertical", ax.set_ylabel)):
        coordinate = request[name]
        put("initial " + axis_label(coordinate["quantity"], result.units, coordinate["mass"]))
    rows, columns = result.label.shape
    where = place_text(result.units, omega=request["omega"], clearance=request["clearance"])
    ax.set_title(f"Basins of attraction at {where}, {rows} × {columns} states", fontsize=10)
    legend_outside(ax, handlelength=1.4, labelspacing=0.35)
    return ax


def _shaded(colour: str, shade: float) -> str:
    """Return a colour, lighter (shade > 0) or darker (< 0)."""
    parts = components(colour)
    goal = 255.0 if shade > 0.0 else 0.0
    return hexadecimal(parts + abs(shade) * (goal - parts))
