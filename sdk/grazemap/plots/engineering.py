"""The units of pictures: texts and ticks in the units of a result, or in hertz and millimetres where it is in SI."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from grazemap.constants import ENGINEERING_UNITS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    A = TypeVar("A", bound=Axes | Iterable[Axes])

_OMEGA, _FREQUENCY = r"$\omega$", r"$\omega/2\pi$"


@dataclass(frozen=True)
class Wording:
    """A text of a picture in the units of the result, and the same text in engineering units."""

    text: str
    """The text. It differs from `engineering` where a frequency or a length in SI is in it."""
    engineering: str
    """The text in engineering units."""
    unit: str = ""
    """The unit of the numbers along an axis with this text; empty if they have none."""

    def __add__(self, suffix: str) -> Wording:
        return replace(self, text=self.text + suffix, engineering=self.engineering + suffix)

    def __radd__(self, prefix: str) -> Wording:
        return replace(self, text=prefix + self.text, engineering=prefix + self.engineering)


def unit_wording(text: str, unit: str = "", units: str = "SI") -> Wording:
    """Return the text of an axis, with its unit if there is one; nondimensional quantities have none."""
    if not unit or units != "SI":
        return Wording(text, text)
    symbol = text.replace(_OMEGA, _FREQUENCY) if unit == "rad/s" else text
    shown, _ = ENGINEERING_UNITS.get(unit, (unit, 1.0))
    return Wording(f"{text} ({unit})", f"{symbol} ({shown})", unit)


def value_wording(symbol: str, value: float, unit: str, units: str) -> Wording:
    """Return the text "symbol = value unit"; nondimensional quantities have no unit."""
    if units != "SI":
        return unit_wording(f"{symbol} = {value:.5g}")
    shown, factor = ENGINEERING_UNITS.get(unit, (unit, 1.0))
    engineering_symbol = symbol.replace(_OMEGA, _FREQUENCY) if unit == "rad/s" else symbol
    return Wording(f"{symbol} = {value:.5g} {unit}", f"{engineering_symbol} = {value * factor:.5g} {shown}")


def engineering_units(ax: A) -> A:
    """Show frequencies in Hz and lengths in mm, in the ticks, labels and titles of pictures of results in SI.

    Call it after `plot`. The data stay in rad/s and m: so do coordinates for `ax.plot`, `ax.set_xlim` and
    `ax.set_xticks`. Times and velocities stay in s and m/s, and labels and titles that you wrote yourself as they are.
    A later change of the scale of an axis, as by `ax.set_yscale`, undoes it for the ticks: call it again then.

    Parameters
    ----------
    ax : Axes, or several
        What a `plot` or `pyplot.subplots` has returned, such as both axes of a trajectory or an array of axes.

    Returns
    -------
    Axes, or several
        The given axes.

    Raises
    ------
    ValueError
        Nothing on the axes is in SI: they are empty, or have a picture of a nondimensional result.
    TypeError
        The argument is neither axes nor several axes.
    """
    axes_list: list[Axes] = np.ravel(np.array(ax, dtype=object)).tolist()
    if not all(hasattr(axes, "xaxis") for axes in axes_list):
        raise TypeError("engineering_units takes axes; of a figure, figure.axes")
    pictures = [picture for axes in axes_list for picture in (axes, *_colour_bars(axes))]
    if all(axis.units is None for picture in pictures for axis in (picture.xaxis, picture.yaxis)):
        raise ValueError("nothing on these axes is in SI units: plot a result in SI first")
    for picture in pictures:
        for axis in (picture.xaxis, picture.yaxis):
            scale_ticks(axis)
        for text in _texts(picture):
            wording = getattr(text, "wording", None)
            if wording is not None and text.get_text() == wording.text:
                text.set_text(wording.engineering)
    return ax


def shows_engineering_units(ax: Axes) -> bool:
    """Return whether axes show Hz or mm."""
    from grazemap.plots.scaled_ticks import ScaledFormatter, ScaledLogFormatter

    scaled = ScaledFormatter, ScaledLogFormatter
    return any(isinstance(axis.get_major_formatter(), scaled) for axis in (ax.xaxis, ax.yaxis))


def scale_ticks(axis: Axis) -> None:
    """Show Hz or mm along an axis whose `units` are those of SI, unless the caller wrote its ticks."""
    from matplotlib.ticker import FixedLocator, LogFormatter, ScalarFormatter

    from grazemap.plots.scaled_ticks import ScaledFormatter, ScaledLocator, ScaledLogFormatter

    if axis.units not in ENGINEERING_UNITS:
        return
    _, factor = ENGINEERING_UNITS[axis.units]
    locator, formatter = axis.get_major_locator(), axis.get_major_formatter()
    if isinstance(formatter, ScaledFormatter | ScaledLogFormatter):
        return
    if isinstance(formatter, LogFormatter):
        axis.set_major_formatter(ScaledLogFormatter(factor))
        axis.set_minor_formatter(ScaledLogFormatter(factor))
        axis.set_minor_locator(ScaledLocator(axis.get_minor_locator(), factor))
    elif isinstance(formatter, ScalarFormatter):
        scaled = ScaledFormatter(factor)
        scaled.set_useOffset(formatter.get_useOffset())
        axis.set_major_formatter(scaled)
    else:
        return
    if not isinstance(locator, FixedLocator):
        axis.set_major_locator(ScaledLocator(locator, factor))


def _colour_bars(ax: Axes) -> Iterator[Axes]:
    for drawn in ax.collections:
        if drawn.colorbar is not None:
            yield drawn.colorbar.ax


def _texts(ax: Axes) -> Iterator[Text]:
    """Yield the titles of axes and of their figure, and the labels of all axes that share the ticks."""
    yield ax.title
    yield from (sibling.xaxis.label for sibling in ax.get_shared_x_axes().get_siblings(ax))
    yield from (sibling.yaxis.label for sibling in ax.get_shared_y_axes().get_siblings(ax))
    figure = ax.get_figure(root=False)
    yield from () if figure is None else figure.texts
