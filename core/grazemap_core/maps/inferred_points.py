"""How many of the points that a refinement has inferred are wrong, measured on a random sample of them."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.maps.binomial import interval
from grazemap_core.maps.refinement import UNRESOLVED, Refinement
from grazemap_core.maps.tolerances import INFERRED_SAMPLE
from grazemap_core.records import dataclass


@dataclass(frozen=True)
class InferredWrong:
    """How many of the inferred points of an adaptive map are wrong, from a random sample of them that was computed.

    A point is wrong if it was inferred to have a motion, or to be chaotic, and the full map has another motion there,
    or is unresolved or sensitive. The share is that before the sample was computed. Afterwards its points are computed
    ones, and so are points next to a wrong one that were inferred to have another label than it.
    """

    inferred: int
    """Number of points that were inferred to have a motion, or to be chaotic, before the sample was computed."""
    sampled: int
    """Number of points in the sample."""
    wrong: int
    """Number of wrong points in the sample."""
    low: float
    """Lower end of the interval of the share of wrong ones (`binomial.interval`)."""
    high: float
    """Upper end of this interval."""


def check_sample(grid: Refinement, most: int) -> InferredWrong | None:
    """Compute a random sample of the inferred points, and return how many of them were wrong; None without any."""
    named = np.flatnonzero(~grid.computed & (grid.label != UNRESOLVED))
    sampled = min(len(named), most, math.ceil(INFERRED_SAMPLE * np.count_nonzero(grid.computed)))
    if not sampled:
        return None
    # the same sample whenever the map is assembled
    chosen = np.random.default_rng(grid.label.shape).choice(named, sampled, replace=False)
    rows, columns = np.unravel_index(chosen, grid.label.shape)
    wrong = grid.check(rows, columns)
    low, high = interval(wrong, sampled)
    return InferredWrong(len(named), sampled, wrong, low, high)
