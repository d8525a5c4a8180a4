"""Tolerances that several packages share; the others are in the `tolerances` of their package.

All of them are relative to a scale of the problem at hand, so the same numbers serve SI and nondimensional
descriptions of one system.
"""

from __future__ import annotations

from typing import Final

EPSILON: Final = 2.220446049250313e-16
"""Distance from 1 to the next binary64 number; the relative error of one rounding is at most half of it."""

SMALLEST_NUMBER: Final = 1e-60

LARGEST_NUMBER: Final = 1e60
"""Range of the modulus of a number given by the user, if it is not 0: fourth powers of frequencies then neither
overflow nor underflow."""
