"""Where texts and legends are: inside the canvas, off the data, and apart from each other."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

Floats = NDArray[np.float64]

# Inches between a legend below the axes and what is above it, and between a text and the edge of the canvas.
_GAP, _EDGE = 0.05, 0.04
# Share of a canvas that the axes always have.
_SHORT = 0.5
# Largest share of a canvas's width that a legend beside the axes has.
_MAX_BESIDE = 0.4
# Points along each segment of a line with few vertices that a legend inside the axes keeps off.
_BETWEEN, _FEW_VERTICES = 24, 400
Corner = Literal[
    "upper right", "upper left", "lower right", "lower left", "center right", "center left", "upper center",
    "lower center"
]  # fmt: skip
_CORNERS: tuple[Corner, ...] = get_args(Corner)
# Words of a text; a formula is a word, and so are the two sides of an equation or a product.
_WORDS = re.compile(r"(?:\$[^$]*\$|[^\s$]| (?=[=×])|(?<=[=×]) )+")
# Lengths of lines that are tried, relative to those of equal lines.
_LONGER = (1.0, 1.1, 1.2, 1.35)
# Most columns of a legend below the axes.
_MOST_COLUMNS = 4
# Space around a name relative to its size, and the share of its box that is over its region.
_ROOM_AROUND, _OVER_REGION = (1.1, 1.3), 0.75


def settle(figure: Figure) -> None:
    """Place the axes of a figure as it does when it is drawn; without a layout they stay where they are."""
    engine = figure.get_layout_engine()
    if engine is not None:
        with warnings.catch_warnings():
            # drawing the figure says so
            warnings.filterwarnings("ignore", message="constrained_layout not applied")
            engine.execute(figure)


def wrap(text: Text, length: float, vertical: bool = False) -> bool:
    """Break a text that is longer than a length in pixels into lines, and return whether it was longer."""
    whole = text.get_text()

    def size(line: str) -> float:
        text.set_text(line)
        box = text.get_window_extent()
        return float(box.height if vertical else box.width)

    def lines_of(words: Sequence[str], limit: float) -> list[str]:
        lines: list[str] = []
        for word in words:
            longer = f"{lines[-1]} {word}" if lines else word
            lines = [*lines[:-1], longer] if not lines or size(longer) <= limit else [*lines, word]
        return lines

    broken: list[str] = []
    for line in whole.split("\n"):
        words, long = _WORDS.findall(line), size(line)
        if len(words) < 2 or long <= length:
            broken.append(line)
            continue
        count = len(lines_of(words, length))
        limits = [*(min(length, long / count * longer) for longer in _LONGER), length]
        tried = (lines_of(words, limit) for limit in limits)
        broken += next(lines for lines in tried if len(lines) <= count)
    text.set_text("\n".join(broken))
    return len(broken) > whole.count("\n") + 1


def fits_anywhere(text: Text) -> bool:
    """Return whether a text is so short that there is room for it wherever the axes are."""
    box, canvas = text.get_window_extent(), text.get_figure(root=True).bbox  # type: ignore[union-attr]
    return bool(box.width < _SHORT * canvas.width and box.height < _SHORT * canvas.height)


def wrap_labels(ax: Axes, bars: Iterable[Axes], own_figure: bool) -> bool:
    """Break the title and the labels of axes, and those of scales beside them, where the canvas has no room for them.

    Returns whether one of them was too long. On a figure of the caller, other axes may be beside these, so that there
    is no more room than above them.
    """
    figure = _figure_of(ax)
    box, edge = ax.get_window_extent(), _EDGE * figure.dpi
    middle = (box.x0 + box.x1) / 2
    across = 2.0 * min(middle - edge, figure.bbox.width - edge - middle)
    if not own_figure and len(figure.axes) > 1:
        across = min(across, 1.15 * box.width)
    changed = [wrap(ax.title, across), wrap(ax.xaxis.label, across)]
    changed += [wrap(axes.yaxis.label, axes.get_window_extent().height * 1.05, vertical=True) for axes in (ax, *bars)]
    return any(changed)


def is_beside(legend: Legend, figure: Figure) -> bool:
    """Return whether there is room for a legend beside the axes."""
    return bool(legend.get_window_extent().width <= _MAX_BESIDE * figure.bbox.width)


def legend_below(ax: Axes, handles: Sequence[Artist], texts: Sequence[str], **look: Any) -> Legend:
    """Add a legend below the axes and their label, with the columns with which it is lowest."""
    from matplotlib.transforms import ScaledTranslation

    figure, box = _figure_of(ax), ax.get_window_extent()
    labels = ax.xaxis.get_tightbbox(None)
    drop = (0.0 if labels is None else box.y0 - labels.y0) / figure.dpi + _GAP
    left = ax.yaxis.get_tightbbox(None)
    # up to the left end of the labels of the vertical axis, which the layout keeps on the canvas
    width = box.x1 - min(box.x0, box.x0 if left is None else left.x0)
    below = ax.transAxes + ScaledTranslation(0.0, -drop, figure.dpi_scale_trans)
    place: dict[str, Any] = {
        "borderaxespad": 0.0,
        "borderpad": 0.2,
        "columnspacing": 1.0,
        "handletextpad": 0.6,
        "labelspacing": 0.35,
        "bbox_transform": below,
        **look,
    }

    def add(columns: int) -> Legend:
        legend: Legend = ax.legend(
            handles, texts, ncols=columns, loc="upper center", bbox_to_anchor=(0.5, 0.0), **place
        )
        _wrap_entries(legend, width, columns)
        return legend

    heights: dict[int, float] = {}
    for columns in range(min(len(texts), _MOST_COLUMNS), 0, -1):
        size = add(columns).get_window_extent()
        if size.width <= width or (columns == 1 and not heights):
            heights[columns] = size.height
    legend = add(min(heights, key=heights.__getitem__))
    if legend.get_window_extent().width > box.width:
        # to the left, over the labels of the vertical axis
        legend.set_bbox_to_anchor((1.0, 0.0), transform=below)
        legend.set_loc("upper right")
    return legend


def _wrap_entries(legend: Legend, width: float, columns: int) -> None:
    """Break the longest texts of a legend that is wider than there is room."""
    long = legend.get_window_extent().width
    if long <= width:
        return
    split = np.array_split([text.get_window_extent().width for text in legend.get_texts()], columns)
    widest = [float(column.max()) for column in split]
    room = width - (long - sum(widest))
    # narrow columns keep their texts, and the others share what they leave
    for left, narrowest in zip(range(columns, 0, -1), sorted(widest), strict=True):
        limit = room / left
        if narrowest > limit:
            break
        room -= narrowest
    for text in legend.get_texts():
        wrap(text, limit)


def emptiest_corner(ax: Axes, legend: Legend) -> Corner:
    """Return where a legend on the axes covers the fewest points of lines and symbols, and no name."""
    box, size = ax.get_window_extent(), legend.get_window_extent()
    pad = legend.borderaxespad * legend._fontsize * _figure_of(ax).dpi / 72.0  # type: ignore[attr-defined]
    points, names = points_of(ax), [text.get_window_extent() for text in ax.texts if text.get_text()]
    covered = []
    for corner in _CORNERS:
        up, _, across = corner.partition(" ")
        x = {"left": box.x0 + pad, "right": box.x1 - pad - size.width}.get(across, (box.x0 + box.x1 - size.width) / 2)
        y = {"lower": box.y0 + pad, "upper": box.y1 - pad - size.height}.get(up, (box.y0 + box.y1 - size.height) / 2)
        under = np.all((points >= (x, y)) & (points <= (x + size.width, y + size.height)), axis=1)
        hidden = sum(
            name.x0 < x + size.width and name.x1 > x and name.y0 < y + size.height and name.y1 > y for name in names
        )
        covered.append(int(np.count_nonzero(under)) + hidden)
    return _CORNERS[int(np.argmin(covered))]


def points_of(ax: Axes, drawn_before: int = 0) -> Floats:
    """Return the points of the lines and the symbols on axes in pixels, (points, 2), with some between few vertices.

    The first `drawn_before` lines of the axes are left out.
    """
    parts = [np.zeros((0, 2))]
    for line in ax.lines[drawn_before:]:
        points = np.asarray(line.get_transform().transform(line.get_xydata()), dtype=np.float64)
        if line.get_linestyle() not in ("None", "none", "") and 1 < len(points) < _FEW_VERTICES:
            share = np.linspace(0.0, 1.0, _BETWEEN, endpoint=False)[:, None, None]
            points = np.concatenate([(points[:-1] + share * np.diff(points, axis=0)).reshape(-1, 2), points[-1:]])
        parts.append(points)
    for drawn in ax.collections:
        offsets = np.asarray(drawn.get_offsets(), dtype=np.float64)
        if hasattr(drawn, "get_sizes") and len(offsets):
            parts.append(np.asarray(drawn.get_offset_transform().transform(offsets)))
    whole = np.concatenate(parts)
    kept: Floats = whole[np.isfinite(whole).all(axis=1)]
    return kept


@dataclass
class Name:
    """A name on axes."""

    text: Text
    """The text."""
    is_there: Callable[[Floats], NDArray[np.bool_]] | None = None
    """Returns which of some places (n, 2) on the axes are in the region that the name is of."""

    def is_beside_its_region(self, ax: Axes) -> bool:
        """Return whether too much of the name is not over its region."""
        if self.is_there is None:
            return False
        box = self.text.get_window_extent()
        across, up = np.meshgrid(np.linspace(box.x0, box.x1, 9), np.linspace(box.y0, box.y1, 3))
        places = np.column_stack([across.ravel(), up.ravel()])
        return bool(self.is_there(ax.transData.inverted().transform(places)).mean() < _OVER_REGION)


def remove_covered(ax: Axes, names: Iterable[Name]) -> None:
    """Remove names that another name or the legend covers, or that are partly outside of the axes or their region."""
    legend = ax.get_legend()
    taken: list[Bbox] = [] if legend is None else [legend.get_window_extent()]
    inside = ax.get_window_extent()
    for name in names:
        box = name.text.get_window_extent()
        beyond = box.x0 < inside.x0 or box.x1 > inside.x1 or box.y0 < inside.y0 or box.y1 > inside.y1
        around = box.expanded(*_ROOM_AROUND)
        if beyond or name.is_beside_its_region(ax) or any(around.overlaps(other) for other in taken):
            name.text.remove()
        else:
            taken.append(box)


def _figure_of(ax: Axes) -> Figure:
    figure = ax.get_figure(root=True)
    assert figure is not None
    return figure
