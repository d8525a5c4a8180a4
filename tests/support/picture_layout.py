"""What is wrong with the layout of a picture: what is cut off, covered by a legend, or written over another text."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.text import Text

# Pixels by which boxes may overlap: the anti-aliased rim of letters.
_RIM = 1.0


def faults(figure: Any) -> list[str]:
    """Return what is wrong with a figure, as it is drawn."""
    figure.canvas.draw()
    return [*_cut(figure), *_covered(figure), *_written_over(figure)]


def _texts(figure: Any) -> list[tuple[str, Any]]:
    """Return all texts that are drawn, with their boxes."""
    hidden = set(itertools.chain.from_iterable(map(_hidden, [*figure.axes, *_inset(figure)])))
    seen = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text() and text not in hidden]
    return [(text.get_text(), text.get_window_extent()) for text in seen]


def _inset(figure: Any) -> list[Any]:
    return [inset for ax in figure.axes for inset in ax.child_axes]


def _hidden(ax: Any) -> Iterator[Text]:
    """Yield the texts of ticks beyond the ends of an axis, and all of axes that are off; they are not drawn."""
    for axis in (ax.xaxis, ax.yaxis):
        drawn = axis._update_ticks() if ax.axison else []
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks()):
            if tick not in drawn:
                yield from (tick.label1, tick.label2)
        if not ax.axison:
            yield from (axis.label, axis.offsetText)


def _cut(figure: Any) -> Iterator[str]:
    canvas = figure.bbox
    boxes = _texts(figure)
    for ax in figure.axes:
        boxes.append(("the axes", ax.get_tightbbox()))
        if ax.get_legend() is not None:
            boxes.append(("the legend", ax.get_legend().get_window_extent()))
    for name, box in boxes:
        beyond = max(-box.x0, -box.y0, box.x1 - canvas.width, box.y1 - canvas.height)
        if beyond > _RIM:
            yield f"{name!r} is {beyond:.0f} pixels beyond the canvas"


def _points(ax: Any) -> np.ndarray:
    parts = [np.zeros((0, 2)), *(line.get_transform().transform(line.get_xydata()) for line in ax.lines)]
    symbols = [drawn for drawn in ax.collections if hasattr(drawn, "get_sizes") and len(drawn.get_offsets())]
    parts += [drawn.get_offset_transform().transform(drawn.get_offsets()) for drawn in symbols]
    points = np.ma.filled(np.concatenate(parts), np.nan)
    box = ax.get_window_extent()
    inside = np.all((points >= (box.x0, box.y0)) & (points <= (box.x1, box.y1)), axis=1)
    return points[inside]


def _covered(figure: Any) -> Iterator[str]:
    for legend in (ax.get_legend() for ax in figure.axes):
        if legend is None:
            continue
        box = legend.get_window_extent()
        for ax in figure.axes:
            points = _points(ax)
            under = np.all((points > (box.x0, box.y0)) & (points < (box.x1, box.y1)), axis=1)
            if under.any():
                yield f"a legend covers {np.count_nonzero(under)} points"


def _written_over(figure: Any) -> Iterator[str]:
    for (first, one), (second, other) in itertools.combinations(_texts(figure), 2):
        across = min(one.x1, other.x1) - max(one.x0, other.x0)
        up = min(one.y1, other.y1) - max(one.y0, other.y0)
        if across > _RIM and up > _RIM:
            yield f"{first!r} and {second!r} overlap"
