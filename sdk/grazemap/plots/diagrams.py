"""Bifurcation diagrams: sections of settled motions over one parameter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import (
    Drawing,
    axis_label,
    chance_text,
    draws,
    legend_square,
    parameter_label,
    point_text,
    quantity_label,
)
from grazemap.plots.palette import INK, OTHER, entry_text, is_light, motion_colours
from grazemap.plots.trajectory import mass_of
from grazemap.results import BifurcationDiagram
from grazemap.results.observables import Quantity
from grazemap.wire import Oscillator

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@draws(BifurcationDiagram, width=10.0, height=5.5)
def plot_bifurcation_diagram(
    result: BifurcationDiagram,
    drawing: Drawing,
    quantity: str,
    observed: Quantity | None,
    motions: int,
    colours: Mapping[str, str] | None,
) -> Axes:
    """Draw a quantity of the sections over the parameter. Raises ValueError: no such quantity.

    `motions` is the number of motions with a colour and a legend entry of their own; the most frequent ones are chosen.
    All others are drawn as "other". `observed` has the values of an observable or an output, one for each value of the
    parameter; None for other quantities. Ticks along the top mark sensitive motions.
    """
    parameter, values = result.points(quantity)
    what = "before impacts" if quantity == "impact_velocity" else "once a forcing period"
    oscillator = Oscillator.model_validate(result.meta["request"]["oscillator"])
    mass = mass_of(np.array(oscillator.contact_row))
    wording = (
        axis_label(quantity.removeprefix("impact_"), result.units, mass) + f", {what}"
        if observed is None
        else quantity_label(observed)
    )
    title = "Bifurcation diagram, " + point_text(result) + f", {result.meta['request']['policy']}"
    ax, pen = drawing.ax, drawing.describe(parameter_label(result.vary, result.units), wording, title)
    labels = np.array(result.labels())
    count = [len(getattr(section, quantity)) for section in result.sections] if observed is None else 1
    label_of_point = np.repeat(labels, count)
    names, first, counts = np.unique(labels, return_index=True, return_counts=True)
    order = np.lexsort([first, -counts])
    shown = [result.sections[first[i]].motion for i in order[:motions]]
    assigned = motion_colours(shown, colours)
    coloured = [entry for entry in zip(order, assigned, shown, strict=False) if entry[1] != OTHER]
    entries = [
        (
            label_of_point == names[i],
            colour,
            f"{entry_text(motion)} ({_values(counts[i])}){chance_text(motion.kind, result.chance_to_settle)}",
        )
        for i, colour, motion in coloured
    ]
    if len(order) > len(coloured):
        other_points = ~np.isin(label_of_point, names[[i for i, _, _ in coloured]])
        entries.append((other_points, OTHER, f"{len(order) - len(coloured)} other motions"))
    for chosen, colour, text in entries:
        style: dict[str, Any] = {"linestyle": "none", "marker": ".", "markeredgewidth": 0.0, "rasterized": True}
        if is_light(colour):  # light dots are drawn on dark ones, so that they are seen on white
            pen.plot(parameter[chosen], values[chosen], color=INK, markersize=4.2, zorder=2.0, **style)
        pen.plot(parameter[chosen], values[chosen], color=colour, markersize=2.8, zorder=2.1, **style)
        legend_square(ax, colour, text)
    sensitive = result.parameter[[section.sensitive for section in result.sections]]
    if sensitive.size:
        style = {"linestyle": "none", "marker": "|", "color": INK, "transform": ax.get_xaxis_transform()}
        ax.plot(
            pen.x(sensitive), np.full(sensitive.size, 0.985), label=f"sensitive ({_values(sensitive.size)})", **style
        )
    ax.margins(x=0.01)
    drawing.show_legend(handlelength=1.0, labelspacing=0.35)
    return ax


def _values(count: int) -> str:
    return f"{count} value{'s' if count > 1 else ''}"
