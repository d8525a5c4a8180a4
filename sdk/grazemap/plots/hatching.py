"""The hatching of sensitive points in maps and basins."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import rimmed, share_text
from grazemap.plots.palette import INK
from grazemap.plots.pen import Pen

# Distance between strokes and their greatest length, in typographic points: many form a hatching. The lengths are so
# many parts of the greatest one, of which the smallest is visible.
_SPACING, _LENGTH, _LENGTHS = 4.0, 4.5, 4
_POINTS_PER_INCH = 72.0


def hatch_sensitive(
    pen: Pen, horizontal: NDArray[np.float64], vertical: NDArray[np.float64], sensitive: NDArray[np.bool_]
) -> None:
    """Draw strokes on the sensitive points of a plane, and give their share in the legend.

    Every stroke is on a sensitive point, so that single points are visible. Where points are closer together than
    strokes, a block of points has one stroke, which is the shorter the fewer of them are sensitive.

    Parameters
    ----------
    horizontal, vertical
        The coordinates of the points.
    sensitive : (vertical, horizontal)
        Nothing is drawn if no point is sensitive.
    """
    if not sensitive.any():
        return
    ax = pen.ax
    sides = np.array([ax.bbox.height, ax.bbox.width]) / ax.figure.dpi * _POINTS_PER_INCH
    height, width = np.ceil(sensitive.shape / np.maximum(sides / _SPACING, 1.0)).astype(int)
    rows, columns, shares = one_in_each_block(sensitive, height, width)
    style: dict[str, Any] = {
        "linestyle": "none",
        "marker": [(-1, -1), (1, 1)],
        "markeredgewidth": 0.8,
        "color": INK,
        "path_effects": rimmed(1.6),
        "zorder": 1.5,
    }
    ax.plot([], [], markersize=_LENGTH, label=f"sensitive ({share_text(sensitive.mean())})", **style)
    # as long as the side of a square with all sensitive points of the block
    parts = np.ceil(np.sqrt(shares) * _LENGTHS)
    for part in np.unique(parts):
        chosen = parts == part
        size = part / _LENGTHS * _LENGTH
        pen.plot(horizontal[columns[chosen]], vertical[rows[chosen]], markersize=size, **style)


def one_in_each_block(
    mask: NDArray[np.bool_], height: int, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Return rows and columns of the true entries nearest to the middle of their block, one for each block with any.

    The third array has the share of true entries of each of these blocks.
    """
    rows, columns = np.nonzero(mask)
    block = rows // height * mask.shape[1] + columns // width
    away = np.hypot(rows % height - (height - 1) / 2, columns % width - (width - 1) / 2)
    order = np.lexsort([away, block])
    _, first, counts = np.unique(block[order], return_index=True, return_counts=True)
    chosen = order[first]
    return rows[chosen], columns[chosen], counts / (height * width)
