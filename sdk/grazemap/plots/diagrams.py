"""Bifurcation diagrams: sections of settled motions over one parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import axes_or_new, axis_label, legend_outside, place_text
from grazemap.plots.palette import components, hexadecimal, motion_colour, motion_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import BifurcationDiagram

# Number of motions in the legend, those with the most values.
_NAMED = 12
_NEARLY_WHITE, _STRONGER, _LIGHT, _DARKER = 200, 8.0, 0.7, 0.58


def plot_bifurcation_diagram(
    result: BifurcationDiagram, ax: Axes | None = None, quantity: str = "displacement"
) -> Axes:
    """Draw a quantity of the sections over the parameter. Raises ValueError: no such quantity."""
    parameter, values = result.points(quantity)
    ax = axes_or_new(ax, 10.0, 5.5)
    labels = np.array(result.labels())
    label_of_point = np.repeat(labels, [len(getattr(section, quantity)) for section in result.sections])
    names, first, counts = np.unique(labels, return_index=True, return_counts=True)
    named = set(names[np.argsort(-counts, kind="stable")][:_NAMED].tolist())
    entries = zip(names.tolist(), first.tolist(), counts.tolist(), strict=True)
    for name, index, count in sorted(entries, key=lambda entry: (-entry[2], entry[0])):
        motion = result.sections[index].motion
        chosen = label_of_point == name
        entry = f"{motion_text(motion)} ({count} value{'s' if count > 1 else ''})" if name in named else None
        style: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 2.5, "markeredgewidth": 0.0}
        ax.plot(parameter[chosen], values[chosen], color=_visible(motion_colour(motion)), **style, rasterized=True)
        ax.plot([], [], "s", markersize=6, color=_visible(motion_colour(motion)), label=entry or "_")
    what = "before impacts" if quantity == "impact_velocity" else "once a forcing period"
    ax.set_xlabel(axis_label(result.vary, result.units))
    ax.set_ylabel(f"{axis_label(quantity.removeprefix('impact_'), result.units)}, {what}")
    request = result.meta["request"]
    other = "omega" if result.vary == "clearance" else "clearance"
    fixed = place_text(result.units, **{other: request[other]})
    ax.set_title(f"Bifurcation diagram, {fixed}, {request['policy']}", fontsize=10)
    ax.margins(x=0.01)
    legend_outside(ax, handlelength=1.0, labelspacing=0.35)
    return ax


def _visible(colour: str) -> str:
    """Return a colour that is visible on white: a nearly white one is made stronger, a light one darker."""
    parts = components(colour)
    if parts.min() > _NEARLY_WHITE:
        parts = 255.0 - np.minimum(255.0, (255.0 - parts) * _STRONGER)
    light = float(parts.mean() / 255.0)
    if light > _LIGHT:
        parts *= _DARKER / light
    return hexadecimal(parts)
