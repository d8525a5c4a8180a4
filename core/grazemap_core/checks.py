"""Checks of arguments that several packages share; each raises ParameterError."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.tolerances import LARGEST_NUMBER, LEAST_NUMBER


def checked_omega(omega: ArrayLike) -> Floats:
    """Return forcing frequencies as a contiguous array of shape (n,).

    Raises
    ------
    ParameterError
        They are not a list of finite numbers greater than 0.
    """
    values = np.ascontiguousarray(omega, dtype=np.float64)
    if values.ndim != 1:
        raise ParameterError("omega", "must be a list of numbers")
    if not np.all((values >= LEAST_NUMBER) & (values <= LARGEST_NUMBER)):
        raise ParameterError("omega", f"every number must lie between {LEAST_NUMBER:g} and {LARGEST_NUMBER:g}")
    return values


def checked_order(name: str, value: int, least: int) -> int:
    """Return `value`, or raise ParameterError when it is below `least`."""
    if value < least:
        raise ParameterError(name, f"must be {least} or greater")
    return value
