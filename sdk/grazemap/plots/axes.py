"""Figures, axes and their labels: what all pictures share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patheffects import AbstractPathEffect

INK = "#222222"
_KEPT_FROM_PYPLOT: ContextVar[bool] = ContextVar("kept from pyplot", default=False)

_QUANTITIES = {
    "omega": (r"forcing frequency $\omega$", "rad/s"),
    "clearance": ("clearance $b$", "m"),
    "restitution": ("restitution $R$", ""),
    "time": ("time $t$", "s"),
    "displacement": ("displacement $x_{mass}$", "m"),
    "velocity": ("velocity $v_{mass}$", "m/s"),
}


@contextmanager
def kept_from_pyplot() -> Iterator[None]:
    """Within this block new figures are not pyplot's: they are not shown, and closed with their last reference."""
    token = _KEPT_FROM_PYPLOT.set(True)
    try:
        yield
    finally:
        _KEPT_FROM_PYPLOT.reset(token)


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size in inches that is readable as a PNG. Raises MissingExtra.

    A notebook shows it below the cell, a script with `matplotlib.pyplot.show()`.
    """
    try:
        from matplotlib import pyplot
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a picture", "plot") from error
    make = Figure if _KEPT_FROM_PYPLOT.get() else pyplot.figure
    return make(figsize=(width, height), dpi=150, layout="constrained")


def axes_or_new(ax: Axes | None, width: float = 9.0, height: float = 5.5) -> Axes:
    """Return the axes that were given, or those of a new figure."""
    return ax if ax is not None else new_figure(width, height).add_subplot(axes_class=shown_axes())


@cache
def shown_axes() -> type[Axes]:
    """Return the class of axes that are a picture, not a line of text, as the value of a notebook's cell."""
    from matplotlib.axes import Axes

    class PictureAxes(Axes):
        """Axes that show their figure as the value of a notebook's cell."""

        def _ipython_display_(self) -> None:
            show_in_notebook(self)

    return PictureAxes


def show_in_notebook(ax: Axes) -> None:
    """Show the figure of axes in a notebook, unless pyplot still has it and shows it at the end of the cell."""
    from IPython.display import display
    from matplotlib import pyplot

    figure = ax.get_figure(root=True)
    number = getattr(figure, "number", None)
    if number is None or not pyplot.fignum_exists(number):
        display(figure)


def axis_label(quantity: str, units: str, mass: int = 1) -> str:
    """Return the text of an axis, with its unit in SI; nondimensional quantities have none."""
    text, unit = _QUANTITIES[quantity]
    text = text.replace("mass", str(mass))
    return f"{text} ({unit})" if units == "SI" and unit else text


def place_text(units: str, **values: float) -> str:
    """Return the text "omega = .., b = .." of the values that are given, with their units in SI."""
    signs = {"omega": r"$\omega$", "clearance": "$b$"}
    unit = {name: f" {_QUANTITIES[name][1]}" if units == "SI" else "" for name in signs}
    return ", ".join(f"{signs[name]} = {value:g}{unit[name]}" for name, value in values.items())


def label_plane(ax: Axes, units: str) -> None:
    """Label the axes of a picture in the plane of omega and clearance."""
    ax.set_xlabel(axis_label("omega", units))
    ax.set_ylabel(axis_label("clearance", units))


def legend_outside(ax: Axes, **options: object) -> None:
    """Put the legend, if it has entries, to the right of the axes."""
    if not ax.get_legend_handles_labels()[0]:
        return
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8, **options)


def legend_square(ax: Axes, colour: str, text: str, edge: float = 0.4) -> None:
    """Add an entry to the legend: a square of a colour, its edge of some width."""
    ax.plot([], [], "s", markersize=8, color=colour, markeredgecolor=INK, markeredgewidth=edge, label=text)


def rimmed(width: float, colour: str = "white") -> list[AbstractPathEffect]:
    """Return the path effects of a line with a rim, legible on colours; the width is that of both."""
    from matplotlib.patheffects import Normal, withStroke

    return [withStroke(linewidth=width, foreground=colour), Normal()]


def cell_borders(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the borders of the cells around increasing values, shape (values + 1,)."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
