"""Pictures of results in SI with hertz and millimetres on their axes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from grazemap.constants import ENGINEERING_UNITS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    A = TypeVar("A", bound=Axes | Iterable[Axes])

_LABEL = re.compile(r"\((rad/s|m)\)")
_VALUE = re.compile(r"= ([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?) (rad/s|m)(?![\w/])")
_OMEGA, _FREQUENCY = r"$\omega$", r"$\omega/2\pi$"


def engineering_units(ax: A) -> A:
    """Show frequencies in Hz and lengths in mm, in the ticks, labels and titles of pictures of results in SI.

    Call it after `plot`. The data stay in rad/s and m: so do coordinates for `ax.plot`, `ax.set_xlim` and
    `ax.set_xticks`. Times and velocities stay in s and m/s. A later change of the scale of an axis undoes it.

    Parameters
    ----------
    ax : Axes, or several
        What a `plot` or `pyplot.subplots` has returned, such as both axes of a trajectory or an array of axes.

    Returns
    -------
    Axes, or several
        Those that were given.

    Raises
    ------
    ValueError
        Nothing on the axes is in SI: they have a picture of a nondimensional result, or none.
    TypeError
        What is given are not axes.
    """
    given: list[Axes] = np.ravel(np.array(ax, dtype=object)).tolist()
    if not all(hasattr(one, "xaxis") for one in given):
        raise TypeError("engineering_units takes axes; of a figure, figure.axes")
    pictures = [one for axes in given for one in (axes, *_colour_bars(axes))]
    if all(axis.units is None for one in pictures for axis in (one.xaxis, one.yaxis)):
        raise ValueError("nothing on these axes is in SI units: plot a result in SI first")
    for one in pictures:
        _convert(one)
    return ax


def convert_figure(figure: Figure) -> None:
    """As `engineering_units` on a whole figure, also where nothing but its texts is in SI."""
    for one in figure.axes:
        _convert(one)


def keep_engineering_units(ax: Axes) -> None:
    """Convert the labels of axes too that another picture was drawn on after `engineering_units`."""
    from grazemap.plots.scaled_ticks import ScaledFormatter

    if any(isinstance(axis.get_major_formatter(), ScaledFormatter) for axis in (ax.xaxis, ax.yaxis)):
        _convert(ax)


def _convert(ax: Axes) -> None:
    for axis in (ax.xaxis, ax.yaxis):
        if axis.units in ENGINEERING_UNITS:
            _scale_ticks(axis)
    for text in _texts(ax):
        text.set_text(_converted(text.get_text()))


def _scale_ticks(axis: Axis) -> None:
    from matplotlib.ticker import FixedLocator, LogFormatter, MaxNLocator, NullFormatter

    from grazemap.plots.scaled_ticks import ScaledFormatter, ScaledLocator, ScaledLogFormatter

    factor, locator = ENGINEERING_UNITS[axis.units][1], axis.get_major_locator()
    if isinstance(axis.get_major_formatter(), NullFormatter):
        return  # the caller has removed the texts
    if isinstance(axis.get_major_formatter(), LogFormatter):
        axis.set_major_formatter(ScaledLogFormatter(factor))
        axis.set_minor_formatter(ScaledLogFormatter(factor))
        return
    if isinstance(locator, MaxNLocator):
        axis.set_major_locator(ScaledLocator(locator, factor))
    axis.set_major_formatter(ScaledFormatter(factor, 4 if isinstance(locator, FixedLocator) else 10))


def _colour_bars(ax: Axes) -> Iterator[Axes]:
    for drawn in ax.collections:
        if drawn.colorbar is not None:
            yield drawn.colorbar.ax


def _texts(ax: Axes) -> Iterator[Text]:
    """Yield the titles of axes and of their figure, and the labels of all axes that share the ticks."""
    yield ax.title
    yield from (one.xaxis.label for one in ax.get_shared_x_axes().get_siblings(ax))
    yield from (one.yaxis.label for one in ax.get_shared_y_axes().get_siblings(ax))
    title = getattr(ax.get_figure(root=False), "_suptitle", None)
    if title is not None:
        yield title


def _converted(text: str) -> str:
    """Return a label or a title in Hz and mm."""
    if "rad/s" in text:
        text = text.replace(_OMEGA, _FREQUENCY)
    text = _LABEL.sub(lambda found: f"({ENGINEERING_UNITS[found[1]][0]})", text)
    return _VALUE.sub(_value, text)


def _value(found: re.Match[str]) -> str:
    unit, factor = ENGINEERING_UNITS[found[2]]
    return f"= {float(found[1]) * factor:.5g} {unit}"
