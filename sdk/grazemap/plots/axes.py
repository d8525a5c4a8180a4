"""Figures, axes, labels and legends, which all pictures share."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap.constants import PictureStyle
from grazemap.errors import MissingExtra
from grazemap.plots.layout import (
    Name,
    emptiest_corner,
    fits_anywhere,
    is_beside,
    legend_below,
    remove_covered,
    settle,
    wrap_labels,
)
from grazemap.plots.palette import INK, PAPER
from grazemap.plots.pen import Pen, scaled, units_along
from grazemap.plots.styles import STYLES, Style, current_style, drawing_in
from grazemap.plots.wordings import Wording, unit_wording, value_wording
from grazemap.results import ChanceToSettle, Result
from grazemap.results.observables import Quantity
from grazemap.results.pictures import PICTURES, LegendPlace
from grazemap.units import shown_in
from grazemap.wire.planes import unit_of

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.patheffects import AbstractPathEffect
    from matplotlib.text import Text

F = TypeVar("F", bound=Callable[..., Any])
Floats = NDArray[np.float64]

# Maximum share of the width and height of the axes that a legend covers, and minimum number of its entries.
_MAX_COVERED, _MIN_ENTRIES = 0.6, 3
_MOST_LAYOUTS = 3
_KEPT_FROM_PYPLOT: ContextVar[bool] = ContextVar("kept from pyplot", default=False)

_PARAMETERS = {
    "omega": r"forcing frequency $\omega$",
    "clearance": "clearance $b$",
    "clearance_right": "clearance $b$ of the right stop",
    "clearance_left": "clearance $b$ of the left stop",
    "restitution": "restitution $R$",
    "restitution_right": "restitution $R$ of the right stop",
    "restitution_left": "restitution $R$ of the left stop",
    "bias": "factor of the bias",
    "forcing": "factor of the forces",
    "damping": "factor of the damping",
    "masses": "mass $m_{{{}}}$",
    "stiffnesses": "stiffness $k_{{{}}}$",
    "dampings": "damping of link {}",
}
_QUANTITIES = {
    "time": ("time $t$", "s"),
    "displacement": ("displacement $x_{mass}$", "m"),
    "velocity": ("velocity $v_{mass}$", "m/s"),
    "contact displacement": ("contact coordinate $q$", "m"),
    "contact velocity": (r"its rate $\dot{q}$", "m/s"),
}


@contextmanager
def kept_from_pyplot() -> Iterator[None]:
    """Within this block pyplot does not know new figures: it does not show them, nor keep them after their last use."""
    token = _KEPT_FROM_PYPLOT.set(True)
    try:
        yield
    finally:
        _KEPT_FROM_PYPLOT.reset(token)


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure in the current style, of a size in inches on a screen. Raises MissingExtra.

    A notebook shows the figure below the cell, a script with `matplotlib.pyplot.show()`.
    """
    try:
        from matplotlib import pyplot
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingExtra("a picture", "plot") from error
    make, style = Figure if _KEPT_FROM_PYPLOT.get() else pyplot.figure, current_style()
    return make(figsize=style.figure_size(width, height), dpi=style.dpi, layout="constrained")


def axes_or_new(ax: Axes | None, width: float = 9.0, height: float = 5.5) -> Axes:
    """Return the given axes or, for None, the axes of a new figure."""
    return ax if ax is not None else new_figure(width, height).add_subplot(axes_class=shown_axes())


def shown_axes() -> type[Axes]:
    """Return the class of axes that a notebook shows as a picture, not as a line of text."""
    from grazemap.plots.picture_axes import PictureAxes

    return PictureAxes


def axis_label(quantity: str, units: str, mass: int | None = 1) -> Wording:
    """Return the text of an axis, with the unit where the result is in SI.

    Displacement and velocity are those of a mass or, for None, of the contact coordinate.
    """
    if quantity in _PARAMETERS:
        return parameter_label(quantity, units)
    text, unit = _QUANTITIES[f"contact {quantity}" if mass is None and quantity != "time" else quantity]
    return unit_wording(text.replace("mass", str(mass)), unit, units)


def parameter_label(name: str, units: str) -> Wording:
    """Return the text of an axis of a parameter that varies, with the unit where the result is in SI."""
    kind, _, index = name.rstrip("]").partition("[")
    return unit_wording(_PARAMETERS[kind].format(index), unit_of(name), units)


def quantity_label(quantity: Quantity) -> Wording:
    """Return the text of an axis of an observable or an output, with its unit, if it has one."""
    return unit_wording(quantity.name, "" if quantity.unit == "nondimensional" else quantity.unit)


def place_text(units: str, **values: float) -> Wording:
    """Return the text "omega = .., b = .." of some values, with units where the result is in SI."""
    signs = {"omega": r"$\omega$", "clearance": "$b$", "right": "right stop at $b$", "left": "left stop at $-b$, $b$"}
    whole = Wording(())
    for name, value in values.items():
        separator = ", " if whole.parts else ""
        whole += separator + value_wording(signs[name], value, "rad/s" if name == "omega" else "m", units)
    return whole


def point_text(result: Result) -> Wording:
    """Return the text of the fixed ones of omega and the clearances in the request of a result."""
    request = result.meta["request"]
    vary, clearance = request.get("axis", {}).get("vary"), request.get("clearance")
    stops = clearance if isinstance(clearance, dict) else {"clearance": clearance}
    fixed = {name: value for name, value in stops.items() if vary not in (name, f"clearance_{name}")}
    values = fixed if vary == "omega" else {"omega": request.get("omega"), **fixed}
    return place_text(result.units, **{name: value for name, value in values.items() if value is not None})


@dataclass(frozen=True)
class Drawing:
    """The axes of a picture, with its options for legend, labels, units and style."""

    ax: Axes
    """The axes."""
    legend: LegendPlace
    """"outside": beside the axes or below them, "inside": on them, or "none": left out."""
    labels: bool
    """Whether there are a title, texts of the axes and names of regions."""
    shown_units: tuple[str, ...]
    """The units in place of rad/s and m: those of the axes, or else those of the result."""
    own_figure: bool = True
    """Whether the figure was made for this picture."""
    may_be_left_out: bool = False
    """Whether a legend that would cover most of the axes is shortened, or left out."""
    style: Style = field(default_factory=current_style)
    """The style."""
    names: list[Name] = field(default_factory=list)
    """Names on the axes, which are left out where there is no room for them."""
    _legends: list[Callable[[], None]] = field(default_factory=list)
    """What makes the legends."""
    _before: frozenset[Artist] = field(init=False)
    """What was on the axes of the caller before."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "_before", frozenset(() if self.own_figure else self.ax.get_children()))

    @property
    def _figure(self) -> Figure:
        figure = self.ax.get_figure(root=True)
        assert figure is not None
        return figure

    def describe(self, x: Wording, y: Wording, title: Wording | str | None = None) -> Pen:
        """Give the axes their units and labels, and return what draws on them."""
        across = self.describe_axis(self.ax.xaxis, x, self.ax.set_xlabel)
        up = self.describe_axis(self.ax.yaxis, y, self.ax.set_ylabel)
        if title is not None:
            self.write(partial(self.ax.set_title, fontsize=self.style.title), title)
        return Pen(self.ax, across, up)

    def describe_axis(self, axis: Axis, wording: Wording, put: Callable[[str], Text]) -> float:
        """Give an axis its unit and its label, and return the factor of its data.

        An axis that has data of results keeps its unit. `put` sets the label, for example `ax.set_xlabel`.
        """
        shown = (*units_along(axis), *self.shown_units)
        unit, factor = shown_in(wording.unit, shown)
        if unit:
            # `set_units` would forget the limits of regions
            axis.units = unit
        self._write(put, wording, shown)
        return factor

    def write(self, put: Callable[[str], Text], wording: Wording | str) -> None:
        """Write a text, unless the picture has no texts. `put` sets the text, for example `ax.set_title`."""
        self._write(put, unit_wording(wording) if isinstance(wording, str) else wording, self.shown_units)

    def _write(self, put: Callable[[str], Text], wording: Wording, shown: Sequence[str]) -> None:
        if self.labels:
            put(wording.text(shown))

    def describe_plane(self, units: str, title: str) -> Pen:
        """Label the axes of a picture in the plane of omega and clearance, and return what draws on them."""
        return self.describe(axis_label("omega", units), axis_label("clearance", units), title)

    def colour_values(self, values: Floats, wording: Wording) -> Floats:
        """Return the values that colours stand for, in the unit of the scale of colours with a wording."""
        shown: Floats = scaled(values, shown_in(wording.unit, self.shown_units)[1])
        return shown

    def show_scale(self, drawn: ScalarMappable, wording: Wording) -> None:
        """Add the scale of colours, which stand for `colour_values`, beside the axes."""
        bar = self.ax.figure.colorbar(drawn, ax=self.ax, shrink=0.8).ax
        self.describe_axis(bar.yaxis, wording, bar.set_ylabel)

    def show_legend(self, shares: Mapping[str, float] | None = None, columns: int = 0, **look: object) -> None:
        """Add the legend, if it has entries, once everything is drawn.

        Equal entries, such as those of several results, are shown once. `shares` has the share of an entry by its text.
        Where not all entries fit, entries without a share are kept first, and then those with the largest shares. With
        `columns` there is room for so many above the axes, on a screen.
        """
        self._legends.append(partial(self._make_legend, shares or {}, columns, look))

    def finish(self) -> None:
        """Give what was drawn its style, and place the legend, the titles and the names. Call it once, at the end."""
        figure = self._figure
        bars = [drawn.colorbar.ax for drawn in self.ax.collections if drawn.colorbar is not None]
        self.style.dress(self.ax, (artist for artist in self.ax.get_children() if artist not in self._before))
        inset: Any = self.ax.child_axes
        for bar in (*bars, *inset):
            self.style.dress(bar, bar.get_children())
        for make in self._legends:
            make()
        labels = [self.ax.title, *(axis.label for ax in (self.ax, *bars) for axis in (ax.xaxis, ax.yaxis))]
        if not self.names and all(fits_anywhere(label) for label in labels):
            return
        settle(figure)
        # where lines are added, the axes move
        for _ in range(_MOST_LAYOUTS):
            if not wrap_labels(self.ax, bars, self.own_figure):
                break
            settle(figure)
        remove_covered(self.ax, self.names)

    def _make_legend(self, shares: Mapping[str, float], columns: int, look: Mapping[str, object]) -> None:
        every = zip(*self.ax.get_legend_handles_labels(), strict=True)
        different = {(text, _look(handle)): handle for handle, text in every}
        handles, texts = list(different.values()), [text for text, _ in different]
        if self.legend == "none" or not handles:
            return
        place: dict[str, Any] = {"frameon": self.legend == "inside", "fontsize": self.style.legend} | dict(look)
        if self.legend == "outside":
            self._place_outside(handles, texts, columns, place)
            return
        place |= {"loc": "upper right", "framealpha": 0.85}
        settle(self._figure)
        whole: Legend = self.ax.legend(handles, texts, **place)
        shown = self._shorten(whole, handles, texts, shares, place) if self.may_be_left_out else whole
        if shown is not None:
            shown.set_loc(emptiest_corner(self.ax, shown))

    def _place_outside(self, handles: list[Artist], texts: list[str], columns: int, place: Mapping[str, Any]) -> None:
        """Add the legend beside the axes, or below them where it would leave them too narrow."""
        figure, is_wide = self._figure, self.style.width is None
        if columns and is_wide:
            high = 1.08 if self.ax.get_title() else 1.0
            above: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, high), "ncols": columns}
            self.ax.legend(handles, texts, **above, **place)
            return
        if is_wide:
            beside: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0}
            if is_beside(self.ax.legend(handles, texts, **beside, **place), figure):
                return
        settle(figure)
        below = legend_below(self.ax, handles, texts, **place)
        if self.own_figure:
            width, height = figure.get_size_inches()
            figure.set_size_inches(width, height + below.get_window_extent().height / figure.dpi)

    def _shorten(
        self,
        shown: Legend,
        handles: Sequence[Artist],
        texts: Sequence[str],
        shares: Mapping[str, float],
        place: Mapping[str, Any],
    ) -> Legend | None:
        """Replace a legend that covers too much by a shorter one; remove it where too few entries would fit.

        Returns the legend that is left.
        """
        from matplotlib.lines import Line2D

        important = sorted(range(len(texts)), key=lambda i: -shares.get(texts[i], np.inf))
        count, whole = len(texts), self.ax.get_window_extent()
        box = shown.get_window_extent()
        while box.width > _MAX_COVERED * whole.width or box.height > _MAX_COVERED * whole.height:
            shown.remove()
            # the last entry says how many are left out
            count = min(count - 1, int(_MAX_COVERED * whole.height / box.height * (count + 1)) - 1)
            if count < _MIN_ENTRIES:
                return None
            kept = sorted(important[:count])
            rest = Line2D([], [], linestyle="none")
            shown = self.ax.legend(
                [*(handles[i] for i in kept), rest],
                [*(texts[i] for i in kept), f"and {len(texts) - count} more"],
                **place,
            )
            box = shown.get_window_extent()
        return shown

    def write_reason(self, reason: str) -> None:
        """Write the reason why there is nothing to draw on the empty axes."""
        self.ax.set_axis_off()
        self.ax.text(0.5, 0.5, reason, transform=self.ax.transAxes, ha="center", va="center", wrap=True, fontsize=9)


def drawing(
    ax: Axes | None,
    legend: LegendPlace | None,
    labels: bool,
    shown_units: tuple[str, ...] = (),
    width: float = 9.0,
    height: float = 5.5,
    own_figure: bool | None = None,
) -> Drawing:
    """Return the drawing on the caller's axes, or on those of a new figure.

    For `legend=None` the legend is outside new axes. On the caller's axes it is inside; where it would cover most of
    them it is shortened, and left out if not even a few entries fit. In a style that has a width it is below them, if
    the figure has a layout that makes room for it. Axes that have data of results keep their units.
    """
    own_figure = ax is None if own_figure is None else own_figure
    ax = axes_or_new(ax, width, height)
    root = ax.get_figure(root=True)
    has_room = own_figure or (current_style().width and root is not None and root.get_layout_engine() is not None)
    place = legend or ("outside" if has_room else "inside")
    may_be_left_out = (not own_figure and legend is None) or (legend == "inside" and current_style().width is not None)
    return Drawing(
        ax, place, labels, (*units_along(ax.xaxis), *units_along(ax.yaxis), *shown_units), own_figure, may_be_left_out
    )


def draws(
    kind: type[Result], method: str = "plot", place: Callable[..., Any] = drawing, **size: float
) -> Callable[[F], F]:
    """Register the function that draws the picture of a method of a result.

    The function is called with the result, the drawing, and those arguments of the method that not every picture has.
    `place` makes the drawing; `size` is the width and height of a new figure on a screen. If the function fails, a new
    figure is closed.
    """

    def register(function: F) -> F:
        def drawn(result: Result, ax: Any, options: Mapping[str, Any], style: PictureStyle, **arguments: Any) -> Any:
            with drawing_in(STYLES[style]):
                target = place(ax, **options, **size)
                try:
                    axes = function(result, target, **arguments)
                    target.finish()
                    return axes
                except BaseException:
                    if ax is None:
                        from matplotlib import pyplot

                        pyplot.close(target.ax.get_figure(root=True))
                    raise

        PICTURES[kind, method] = drawn
        return function

    return register


def _look(handle: Artist) -> tuple[Hashable, ...]:
    """Return the properties by which legend entries with the same text may differ."""
    names = ("color", "facecolor", "marker", "linestyle")
    return tuple(str(getattr(handle, f"get_{name}")()) for name in names if hasattr(handle, f"get_{name}"))


def share_text(share: float) -> str:
    """Return a share in percent; a small share is "< 0.1%", not 0."""
    return "< 0.1%" if 0.0 < share < 0.0005 else f"{share:.1%}"


def chance_text(kind: str, chance: ChanceToSettle | None) -> str:
    """Return the end of the legend entry of chaotic motions, which says how many settle when followed; else ""."""
    if chance is None or kind != "chaotic":
        return ""
    return f", {chance.settled} of {chance.sampled} settle later"


def legend_square(ax: Axes, colour: str, text: str, edge: float = 0.4) -> None:
    """Add an entry to the legend: a square of a colour, with an edge of a width."""
    ax.plot([], [], "s", markersize=8, color=colour, markeredgecolor=INK, markeredgewidth=edge, label=text)


def rimmed(width: float, colour: str = PAPER) -> list[AbstractPathEffect]:
    """Return the path effects that give a line a rim, so that it is legible on colours; `width` includes the rim."""
    from matplotlib.patheffects import Normal, withStroke

    return [withStroke(linewidth=width * current_style().scale, foreground=colour), Normal()]


def cell_borders(values: Floats) -> Floats:
    """Return the borders of the cells around increasing values, shape (values + 1,)."""
    middle = (values[1:] + values[:-1]) / 2
    return np.concatenate([[2 * values[0] - middle[0]], middle, [2 * values[-1] - middle[-1]]])
