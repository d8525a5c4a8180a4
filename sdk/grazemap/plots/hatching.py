"""The hatching of sensitive points in maps and basins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import rimmed, share_text
from grazemap.plots.palette import INK
from grazemap.plots.pen import Pen

# Distance between strokes and their length, in typographic points: single strokes are visible, many form a hatching.
_SPACING, _LENGTH = 4.0, 4.5
_POINTS_PER_INCH = 72.0


def hatch_sensitive(
    pen: Pen, horizontal: NDArray[np.float64], vertical: NDArray[np.float64], sensitive: NDArray[np.bool_]
) -> None:
    """Draw strokes on the sensitive points of a plane, and give their share in the legend.

    Every stroke is on a sensitive point, so that single points are visible. Where points are closer together than
    strokes, a block of points has one stroke.

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
    rows, columns = one_in_each_block(sensitive, height, width)
    pen.plot(
        horizontal[columns],
        vertical[rows],
        linestyle="none",
        marker=[(-1, -1), (1, 1)],
        markersize=_LENGTH,
        markeredgewidth=0.8,
        color=INK,
        path_effects=rimmed(1.6),
        zorder=1.5,
        label=f"sensitive ({share_text(sensitive.mean())})",
    )


def one_in_each_block(mask: NDArray[np.bool_], height: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows and columns of the true entries nearest to the middle of their block, one for each block with any."""
    rows, columns = np.nonzero(mask)
    block = rows // height * mask.shape[1] + columns // width
    away = np.hypot(rows % height - (height - 1) / 2, columns % width - (width - 1) / 2)
    order = np.lexsort([away, block])
    chosen = order[np.unique(block[order], return_index=True)[1]]
    return rows[chosen], columns[chosen]
