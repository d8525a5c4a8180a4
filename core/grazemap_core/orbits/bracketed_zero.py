"""The zero of a function between two numbers at which it has different signs."""

from __future__ import annotations

from collections.abc import Callable

from scipy.optimize import brentq

from grazemap_core.tolerances import EPSILON


def bracketed_zero(test: Callable[[float], float], low: float, high: float, accuracy: float) -> float | None:
    """Return where a function changes its sign, to an absolute accuracy; None where it has one sign at both ends.

    Raises
    ------
    ValueError
        The function is not a number somewhere on the way.
    """
    ends = test(low), test(high)
    if min(ends) > 0.0 or max(ends) < 0.0:
        return None
    return float(brentq(test, low, high, xtol=accuracy, rtol=4.0 * EPSILON))
