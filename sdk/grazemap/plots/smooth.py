"""Curves through computed points, drawn smooth.

Points of a branch or a bifurcation curve are as far apart as Newton's method allows: the tangents at neighbouring
points may differ by 18 degrees. Between the points a cubic spline is drawn, whose parameter is the length along the
curve. It has more pieces where the curve turns. The points lie on the line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_TURN = np.radians(2.0)
_MAX_PIECES = 24


def smooth_pieces(path: Floats, drawn: Floats) -> list[Floats]:
    """Return the line from every point to the next, both included.

    Parameters
    ----------
    path : (n, d)
        Coordinates in which length is measured, each on its own scale. They may be more than those that are drawn: a
        curve can be smooth where its picture has a cusp.
    drawn : (n, m)
        The coordinates that are drawn.

    Returns
    -------
    list of (pieces + 1, m), n - 1 of them
    """
    if len(path) < 2:
        return []
    extent = np.ptp(path, axis=0)
    steps = np.linalg.norm(np.diff(path, axis=0) / np.where(extent > 0.0, extent, 1.0), axis=1)
    if steps.sum() == 0.0:
        return [drawn[i : i + 2] for i in range(len(drawn) - 1)]
    # points that coincide have a step of no consequence between them
    steps = np.maximum(steps, 1e-9 * float(steps.sum()))
    slopes = np.diff(drawn, axis=0) / steps[:, None]
    derivatives = _derivatives(steps, slopes)
    size = np.ptp(drawn, axis=0)
    scale = np.where(size > 0.0, size, 1.0)
    pieces = []
    for i, step in enumerate(steps):
        turn = _angle(derivatives[i] / scale, slopes[i] / scale) + _angle(slopes[i] / scale, derivatives[i + 1] / scale)
        count = int(np.clip(np.ceil(turn / _TURN), 1, _MAX_PIECES))
        t = np.linspace(0.0, 1.0, count + 1)[:, None]
        start, end = drawn[i], drawn[i + 1]
        first, last = step * derivatives[i] - (end - start), (end - start) - step * derivatives[i + 1]
        line = start + t * (end - start) + t * (1.0 - t) * ((1.0 - t) * first + t * last)
        line[-1] = end
        pieces.append(line)
    return pieces


def smooth_line(path: Floats, drawn: Floats, shown: NDArray[np.bool_] | None = None) -> Floats:
    """Return the line through all points, (pieces + 1, m), NaN at and beside points that are not `shown`, (n,).

    `path` and `drawn` are those of `smooth_pieces`.
    """
    is_shown = np.ones(len(drawn), dtype=bool) if shown is None else shown
    knots = np.where(is_shown[:, None], drawn, np.nan)
    between = is_shown[:-1] & is_shown[1:]
    parts = [knots[:1]]
    for piece, visible, end in zip(smooth_pieces(path, drawn), between, knots[1:], strict=True):
        parts += [np.where(visible, piece[1:-1], np.nan), end[None]]
    return np.concatenate(parts)


def _derivatives(steps: Floats, slopes: Floats) -> Floats:
    """Return the derivative at every point of the cubic spline whose first and last piece are parabolas."""
    count = len(steps) + 1
    lower, diagonal, upper = np.ones(count), np.ones(count), np.ones(count)
    lower[1:-1], diagonal[1:-1], upper[1:-1] = steps[1:], 2.0 * (steps[:-1] + steps[1:]), steps[:-1]
    right = np.empty((count, slopes.shape[1]))
    right[0], right[-1] = 2.0 * slopes[0], 2.0 * slopes[-1]
    right[1:-1] = 3.0 * (steps[1:, None] * slopes[:-1] + steps[:-1, None] * slopes[1:])
    if count == 2:  # both conditions are the same
        return np.repeat(slopes, 2, axis=0)
    for i in range(1, count):
        share = lower[i] / diagonal[i - 1]
        diagonal[i] -= share * upper[i - 1]
        right[i] -= share * right[i - 1]
    right[-1] /= diagonal[-1]
    for i in range(count - 2, -1, -1):
        right[i] = (right[i] - upper[i] * right[i + 1]) / diagonal[i]
    return right


def _angle(first: Floats, second: Floats) -> float:
    lengths = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(np.arccos(np.clip(first @ second / lengths, -1.0, 1.0))) if lengths > 0.0 else 0.0
