"""The interval of a probability that was measured on a sample (Clopper & Pearson 1934).

References
----------
C. J. Clopper, E. S. Pearson, Biometrika 26 (1934) 404-413.
"""

from __future__ import annotations

from typing import Final

from scipy.special import betaincinv

CONFIDENCE: Final = 0.95
"""Minimum probability with which the interval contains the probability that was measured."""


def interval(count: int, sampled: int) -> tuple[float, float]:
    """Return the ends of the interval of a probability, if `count` of `sampled` independent trials have the outcome."""
    tail = (1.0 - CONFIDENCE) / 2.0
    low = float(betaincinv(count, sampled - count + 1, tail)) if count else 0.0
    high = float(betaincinv(count + 1, sampled - count, 1.0 - tail)) if count < sampled else 1.0
    return low, high
