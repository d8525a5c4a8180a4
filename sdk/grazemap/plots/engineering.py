"""The units of pictures: texts and ticks in the units of a result, or in those in which it is shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from grazemap.constants import ENGINEERING_UNITS
from grazemap.units import shown_in, si_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.text import Text

    A = TypeVar("A", bound=Axes | Iterable[Axes])

_OMEGA, _FREQUENCY = r"$\omega$", r"$\omega/2\pi$"


@dataclass(frozen=True)
class Amount:
    """A quantity in a text: its name with its unit, or with its value and unit."""

    symbol: str
    """The name or the symbol."""
    unit: str
    """The unit in SI."""
    value: float | None = None
    """The value in SI; None for the name of an axis."""

    def text(self, shown: Sequence[str]) -> str:
        """Return the text with one of the units that are shown, if it has one."""
        unit, factor = shown_in(self.unit, shown)
        symbol = self.symbol.replace(_OMEGA, _FREQUENCY) if unit != self.unit else self.symbol
        return f"{symbol} ({unit})" if self.value is None else f"{symbol} = {self.value * factor:.5g} {unit}"


@dataclass(frozen=True)
class Wording:
    """A text of a picture, in any units."""

    parts: tuple[str | Amount, ...]
    """The parts of the text in order."""
    unit: str = ""
    """The unit in SI of the numbers along an axis with this text; empty if they have none."""

    def text(self, shown: Sequence[str] = ()) -> str:
        """Return the text, with the units that are shown in place of those of SI."""
        return "".join(part if isinstance(part, str) else part.text(shown) for part in self.parts)

    def __add__(self, suffix: str | Wording) -> Wording:
        return replace(self, parts=(*self.parts, *_parts_of(suffix)))

    def __radd__(self, prefix: str) -> Wording:
        return replace(self, parts=(prefix, *self.parts))


def _parts_of(text: str | Wording) -> tuple[str | Amount, ...]:
    return (text,) if isinstance(text, str) else text.parts


def unit_wording(text: str, unit: str = "", units: str = "SI") -> Wording:
    """Return the text of an axis, with its unit if there is one; nondimensional quantities have none."""
    return Wording((Amount(text, unit),), unit) if unit and units == "SI" else Wording((text,))


def value_wording(symbol: str, value: float, unit: str, units: str) -> Wording:
    """Return the text "symbol = value unit"; nondimensional quantities have no unit."""
    return Wording((Amount(symbol, unit, value) if units == "SI" else f"{symbol} = {value:.5g}",))


def keep_wording(text: Text, wording: Wording) -> None:
    """Keep the wording of a text that was written, so that its units can be changed while its user leaves it alone."""
    text.wording, text.written = wording, text.get_text()  # type: ignore[attr-defined]


def engineering_units(ax: A, units: Sequence[str] = ENGINEERING_UNITS) -> A:
    """Show frequencies in Hz and lengths in mm, in the ticks, labels and titles of pictures of results in SI.

    Call it after `plot`. The data stay in rad/s and m: so do coordinates for `ax.plot`, `ax.set_xlim` and
    `ax.set_xticks`. Times and velocities stay in s and m/s, and labels and titles that you wrote yourself as they are.
    A later change of the scale of an axis, as by `ax.set_yscale`, undoes it for the ticks: call it again then.

    Parameters
    ----------
    ax : Axes, or several
        What a `plot` or `pyplot.subplots` has returned, such as both axes of a trajectory or an array of axes.
    units : sequence of str
        Other units: "Hz", "rpm" or "rad/s" for frequencies, "mm" or "m" for lengths.

    Returns
    -------
    Axes, or several
        The given axes.

    Raises
    ------
    ValueError
        Nothing on the axes is in SI: they are empty, or have a picture of a nondimensional result. Or another unit.
    TypeError
        The argument is neither axes nor several axes.
    """
    axes_list: list[Axes] = np.ravel(np.array(ax, dtype=object)).tolist()
    if not all(hasattr(axes, "xaxis") for axes in axes_list):
        raise TypeError("engineering_units takes axes; of a figure, figure.axes")
    for unit in units:
        si_unit(unit)
    pictures = [picture for axes in axes_list for picture in (axes, *colour_bars(axes))]
    if all(axis.units is None for picture in pictures for axis in (picture.xaxis, picture.yaxis)):
        raise ValueError("nothing on these axes is in SI units: plot a result in SI first")
    for picture in pictures:
        for axis in (picture.xaxis, picture.yaxis):
            scale_ticks(axis, units)
        for text in _texts(picture):
            if getattr(text, "written", None) == text.get_text():
                wording: Wording = text.wording  # type: ignore[attr-defined]
                text.set_text(wording.text(units))
                keep_wording(text, wording)
    return ax


def units_shown_on(ax: Axes) -> tuple[str, ...]:
    """Return the units other than those of SI that axes show."""
    formatters = (axis.get_major_formatter() for axis in (ax.xaxis, ax.yaxis))
    return tuple(formatter.shown_unit for formatter in formatters if hasattr(formatter, "shown_unit"))


def scale_ticks(axis: Axis, shown: Sequence[str]) -> None:
    """Show other units along an axis whose `units` are those of SI, unless the caller wrote its ticks."""
    from matplotlib.ticker import FixedLocator, LogFormatter, ScalarFormatter

    from grazemap.plots.scaled_ticks import ScaledFormatter, ScaledLocator, ScaledLogFormatter

    unit, factor = shown_in(axis.units or "", shown)
    locator, formatter = axis.get_major_locator(), axis.get_major_formatter()
    if unit == getattr(formatter, "shown_unit", axis.units or ""):
        return
    if isinstance(formatter, LogFormatter):
        axis.set_major_formatter(ScaledLogFormatter(factor, unit))
        axis.set_minor_formatter(ScaledLogFormatter(factor, unit))
        axis.set_minor_locator(ScaledLocator.of(axis.get_minor_locator(), factor))
    elif isinstance(formatter, ScalarFormatter):
        scaled = ScaledFormatter(factor, unit)
        scaled.set_useOffset(formatter.get_useOffset())
        axis.set_major_formatter(scaled)
    else:
        return
    if not isinstance(locator, FixedLocator):
        axis.set_major_locator(ScaledLocator.of(locator, factor))


def colour_bars(ax: Axes) -> Iterator[Axes]:
    """Yield the axes of the scales of colours beside axes."""
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
