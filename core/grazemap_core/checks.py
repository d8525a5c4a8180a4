"""Validation of arguments that several packages take; every function raises ParameterError."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER


def checked_omega(omega: ArrayLike) -> Floats:
    """Return forcing frequencies as a contiguous array of shape (n,).

    Raises
    ------
    ParameterError
        The values are not a list of numbers in the range [SMALLEST_NUMBER, LARGEST_NUMBER].
    """
    values = np.ascontiguousarray(omega, dtype=np.float64)
    if values.ndim != 1:
        raise ParameterError("omega", "must be a list of numbers")
    check_range("omega", values)
    return values


def check_range(name: str, values: Floats, low: float = SMALLEST_NUMBER, high: float = LARGEST_NUMBER) -> None:
    """Raise ParameterError when a number is outside the range [low, high]."""
    if not np.all((values >= low) & (values <= high)):
        raise ParameterError(name, f"every number must lie between {low:g} and {high:g}")


def check_point(omega: float, clearance: float) -> None:
    """Raise ParameterError when a frequency or a clearance is outside the range [SMALLEST_NUMBER, LARGEST_NUMBER]."""
    for name, value in (("omega", omega), ("clearance", clearance)):
        if not SMALLEST_NUMBER <= value <= LARGEST_NUMBER:
            raise ParameterError(name, f"must lie between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}")


def checked_order(name: str, value: int, minimum: int) -> int:
    """Return `value`, or raise ParameterError when it is below `minimum`."""
    if value < minimum:
        raise ParameterError(name, f"must be {minimum} or greater")
    return value
