"""The steady response of a structure over the forcing frequency, or its impulse response over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.plots.axes import Drawing, axis_label, draws
from grazemap.plots.palette import INK, ORDERS, PALE_LINE, dash
from grazemap.plots.wordings import unit_wording
from grazemap.results import Structure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LOGARITHMIC = 30.0
"""Ratio of the largest to the smallest amplitude from which their axis is logarithmic."""


@draws(Structure)
def plot_structure(structure: Structure, drawing: Drawing) -> Axes:
    """Draw the amplitude of every harmonic with the natural frequencies; without frequencies the impulse response."""
    ax, units = drawing.ax, structure.units
    if len(structure.omega) == 0:
        if len(structure.time) == 0:
            drawing.write_reason("neither frequencies nor times were asked for")
            return ax
        response, title = unit_wording("impulse response $g$", "s", units), "Contact coordinate after a unit jump"
        pen = drawing.describe(axis_label("time", units), response, f"{title} of its velocity")
        pen.plot(structure.time, structure.impulse_response, color=INK, linewidth=1.2)
        pen.axhline(0.0, color=PALE_LINE, linewidth=0.8)
        return ax
    amplitude = unit_wording("amplitude of the contact coordinate", "m", units)
    pen = drawing.describe(axis_label("omega", units), amplitude, "Steady response without contact")
    order = np.argsort(structure.omega, kind="stable")
    omega = structure.omega[order]
    for i, steady in enumerate(structure.harmonics):
        round, place = divmod(i, len(ORDERS))
        colour = INK if len(structure.harmonics) == 1 else ORDERS[place]
        text = "amplitude" if steady.harmonic == 1 else f"amplitude of harmonic {steady.harmonic}"
        style: dict[str, Any] = {"color": colour, "linestyle": dash(round), "marker": "." if len(omega) < 20 else ""}
        pen.plot(omega, steady.amplitude[order], linewidth=1.2, label=text, **style)
    inside = structure.natural_frequencies[
        (structure.natural_frequencies >= omega[0]) & (structure.natural_frequencies <= omega[-1])
    ]
    for i, frequency in enumerate(inside):
        name = "natural frequencies" if i == 0 else None
        pen.axvline(frequency, color=PALE_LINE, linewidth=0.8, linestyle="--", label=name, zorder=1)
    amplitudes = [steady.amplitude for steady in structure.harmonics]
    drawn = [values[np.isfinite(values) & (values > 0.0)] for values in amplitudes]
    sizes = np.concatenate(drawn) if drawn else np.zeros(0)
    if len(sizes) and sizes.max() > _LOGARITHMIC * sizes.min():
        ax.set_yscale("log")
    ax.margins(x=0.01)
    drawing.show_legend()
    return ax
