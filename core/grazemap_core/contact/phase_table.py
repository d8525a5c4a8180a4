"""The phase of the forcing at the boundaries of the cells, over half a period."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Complexes


def half_period_phases(cells: int) -> Complexes:
    """Return exp(2 pi i k / cells) for 0 <= k < cells/2, with an error of one or two roundings.

    Sines and cosines are computed at angles of at most pi/4.
    """
    k = np.arange(cells // 2)
    back = 4 * k > cells
    k = np.where(back, cells // 2 - k, k)
    steep = 8 * k > cells
    angle = np.where(steep, cells - 4 * k, 4 * k) * (math.pi / (2 * cells))
    c, s = np.cos(angle), np.sin(angle)
    return np.where(back, -1.0, 1.0) * np.where(steep, s, c) + 1j * np.where(steep, c, s)
