"""Samples of the points of a result: which are drawn, and what they tell of all of them.

References
----------
C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404-413.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import betaincinv

from grazemap_core.arrays import Floats, Integers
from grazemap_core.maps.tolerances import CONFIDENCE, RUN_ON, RUN_ON_PERIODS, RUN_ON_SAMPLE, SIDE_BY_SIDE


def interval(count: int, sampled: int) -> tuple[float, float]:
    """Return the ends of the interval of a probability, if `count` of `sampled` independent trials have the outcome.

    The interval is that of Clopper and Pearson; it contains the probability with CONFIDENCE at least.
    """
    tail = (1.0 - CONFIDENCE) / 2.0
    low = float(betaincinv(count, sampled - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, sampled - count, 1.0 - tail)) if count < sampled else 1.0
    return low, high


def binomial_error(share: Floats, sampled: int) -> Floats:
    """Return the standard errors of shares of independent trials."""
    return np.asarray(np.sqrt(share * (1.0 - share) / sampled))


def sample(chaotic: int, watched: int) -> Integers:
    """Return the positions of the sample among a number of chaotic motions, in the order of a result's arrays."""
    return _spread(chaotic, max(1, RUN_ON_PERIODS // (RUN_ON * watched)), RUN_ON_SAMPLE)


def sample_of_groups(groups: Sequence[Integers], watched: int) -> Integers:
    """Return the sample among chaotic motions that are simulated side by side in groups of their positions.

    Where groups are large enough, the sample has SIDE_BY_SIDE motions of each chosen group, as these are simulated
    together; groups are chosen in proportion to their size. Otherwise it is that of `sample`.
    """
    motions = sum(map(len, groups))
    evenly = sample(motions, watched)
    together = min(SIDE_BY_SIDE, len(evenly))
    group_of = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    chosen, times = np.unique(group_of[_spread(motions, len(evenly) // together)], return_counts=True)
    of_groups = np.concatenate(
        [groups[k][_spread(len(groups[k]), together * count)] for k, count in zip(chosen, times, strict=True)]
    )
    enough = len(of_groups) >= together * (len(evenly) // together)  # groups may be small
    return np.sort(of_groups) if enough and len(evenly) < motions else evenly


def _spread(length: int, *most: int) -> Integers:
    """Return evenly spaced positions in a list of a length: all of them, or as many as the smallest of `most`."""
    number = min(length, *most)
    return (2 * np.arange(number) + 1) * length // (2 * number)
