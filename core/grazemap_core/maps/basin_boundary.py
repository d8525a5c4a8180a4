"""The boundary of basins of attraction as numbers: basin entropy and uncertainty exponent of a rectangle of states.

Both are computed from the labels of evenly spaced initial states. States whose motion is unresolved count nowhere.

References
----------
A. Daza, A. Wagemakers, B. Georgeot, D. Guery-Odelin, M. A. F. Sanjuan, Basin entropy: a new tool to analyze uncertainty
in dynamical systems, Scientific Reports 6 (2016) 31416.
C. Grebogi, S. W. McDonald, E. Ott, J. A. Yorke, Final state sensitivity: an obstruction to predictability, Physics
Letters A 99 (1983) 415-418.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.maps.tolerances import (
    ENTROPY_BOX,
    ENTROPY_SURE,
    EVEN_SPACING,
    FEWEST_DISTANCES,
    UNCERTAINTY_REACH,
)
from grazemap_core.records import dataclass

DIMENSION: Final = 2
"""Dimension of the rectangle of initial states."""


@dataclass(frozen=True)
class BasinEntropy:
    """How mixed the motions are in the boxes of a rectangle."""

    box: int
    """Number of states along a side of a box."""
    boxes: int
    """Number of boxes with resolved states."""
    boundary_boxes: int
    """Number of those that lead to more than one attractor."""
    entropy: float
    """S_b: mean over the boxes of the entropy, in nats, of the shares of the attractors in a box."""
    boundary_entropy: float
    """S_bb: the mean over the boundary boxes, NaN without any."""
    standard_error: float
    """Standard error of S_bb from the spread of the boxes, NaN of fewer than two."""
    fractal: bool
    """Whether S_bb exceeds log 2 by more than ENTROPY_SURE standard errors. Boxes on a smooth boundary have two
    motions, but for a few where more basins meet, so that S_bb is at most log 2. The converse does not hold: where this
    is false the boundary may be fractal too, and of two attractors S_bb never exceeds log 2."""


@dataclass(frozen=True)
class Uncertainty:
    """The share of uncertain states by distance, and its power law f ~ distance^exponent."""

    distance: Integers
    """(k,) In steps of the rectangle, along either side."""
    share: Floats
    """(k,) Share of the resolved states that are uncertain: another one within the distance along both sides leads to
    another attractor."""
    exponent: float
    """Slope of the least-squares line through log share over log distance; NaN with fewer than FEWEST_DISTANCES
    distances that have uncertain states. The finite rectangle adds a bias: the exponent of smooth boundaries is some
    hundredths below 1."""
    standard_error: float
    """Standard error of the line's slope from the residuals; NaN likewise."""
    boundary_dimension: float
    """Box dimension of the boundary in the rectangle: 2 - exponent."""


def evenly_spaced(values: ArrayLike) -> bool:
    """Return whether values (n,) are equally spaced, but for EVEN_SPACING steps."""
    steps = np.diff(np.asarray(values, dtype=np.float64))
    return bool(np.all(np.abs(steps - np.mean(steps)) <= EVEN_SPACING * np.abs(np.mean(steps))))


def basin_entropy(label: NDArray[Any]) -> BasinEntropy | None:
    """Return the basin entropy of labels (n, m), -1 where unresolved; None if no box fits or none has resolved states.

    Boxes have ENTROPY_BOX states a side, from the first state on; rows and columns that are left over do not count.
    """
    rows, columns = (size // ENTROPY_BOX for size in label.shape)
    boxed = label[: rows * ENTROPY_BOX, : columns * ENTROPY_BOX].astype(np.int64)
    boxed = boxed.reshape(rows, ENTROPY_BOX, columns, ENTROPY_BOX).swapaxes(1, 2)
    boxed = boxed.reshape(rows * columns, ENTROPY_BOX**2)
    box, _ = np.nonzero(boxed >= 0)
    if not box.size:
        return None
    kinds = int(boxed.max()) + 1
    pairs, counts = np.unique(box * kinds + boxed[boxed >= 0], return_counts=True)
    of_pair = pairs // kinds
    share = counts / np.bincount(box, minlength=len(boxed))[of_pair]
    every = np.bincount(of_pair, weights=-share * np.log(share), minlength=len(boxed))
    different = np.bincount(of_pair, minlength=len(boxed))
    mixed, boxes = every[different > 1], int(np.count_nonzero(different))
    of_boundary = float(np.mean(mixed)) if mixed.size else np.nan
    error = float(np.std(mixed, ddof=1) / np.sqrt(mixed.size)) if mixed.size > 1 else np.nan
    return BasinEntropy(
        box=ENTROPY_BOX,
        boxes=boxes,
        boundary_boxes=len(mixed),
        entropy=float(np.sum(every) / boxes),
        boundary_entropy=of_boundary,
        standard_error=error,
        fractal=bool(of_boundary > np.log(2.0) + ENTROPY_SURE * error),
    )


def uncertainty(label: NDArray[Any]) -> Uncertainty | None:
    """Return the uncertainty exponent of labels (n, m), -1 where unresolved; None if the rectangle is too small.

    Distances are powers of two, up to the UNCERTAINTY_REACH-th part of the shorter side.
    """
    longest = min(label.shape) // UNCERTAINTY_REACH
    distance = 1 << np.arange(longest.bit_length())
    counted = int(np.count_nonzero(label >= 0))
    if len(distance) < FEWEST_DISTANCES or not counted:
        return None
    share = np.array([np.count_nonzero(_uncertain(label, d)) for d in distance.tolist()]) / counted
    exponent, error = _power(distance[share > 0.0], share[share > 0.0])
    return Uncertainty(distance, share, exponent, error, DIMENSION - exponent)


def _uncertain(label: NDArray[Any], distance: int) -> Booleans:
    """Return which resolved states have one within a distance that leads to another attractor."""
    none = np.iinfo(label.dtype).max
    highest = maximum_filter(label, 2 * distance + 1, mode="nearest")
    lowest = minimum_filter(np.where(label < 0, none, label), 2 * distance + 1, mode="nearest")
    return np.asarray((label >= 0) & (highest != lowest))


def _power(distance: Integers, share: Floats) -> tuple[float, float]:
    """Return the exponent of a power law through points, and its standard error."""
    if len(distance) < FEWEST_DISTANCES:
        return np.nan, np.nan
    x, y = np.log(distance), np.log(share)
    x, y = x - np.mean(x), y - np.mean(y)
    spread = float(x @ x)
    slope = float(x @ y) / spread
    residual = y - slope * x
    return slope, float(np.sqrt(residual @ residual / (len(x) - 2) / spread))
