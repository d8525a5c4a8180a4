"""A law of cost against size, fitted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.result import Law


def fit(size: Sequence[float], seconds: Sequence[float]) -> Law:
    """Fit a straight line, every point weighing by its relative error, and a power law."""
    x, y = np.array(size, dtype=np.float64), np.array(seconds, dtype=np.float64)
    slope, constant = np.polyfit(x, y, 1, w=1.0 / y)
    exponent, _ = np.polyfit(np.log(x), np.log(y), 1)
    return Law(
        constant=float(constant),
        slope=float(slope),
        exponent=float(exponent),
        largest_deviation=float(np.max(np.abs((constant + slope * x) / y - 1.0))),
    )
