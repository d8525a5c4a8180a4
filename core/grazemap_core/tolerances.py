"""Tolerances that several packages share; the others stand in the `tolerances` of their package.

All of them are relative to a scale of the problem at hand, so the same numbers serve SI and nondimensional
descriptions of one system.
"""

from __future__ import annotations

from typing import Final

EPSILON: Final = 2.220446049250313e-16
"""Distance from 1 to the next binary64 number; one rounding errs by at most half of it."""

LEAST_NUMBER: Final = 1e-60

LARGEST_NUMBER: Final = 1e60
"""Sizes of given numbers other than 0. Fourth powers of frequencies then neither overflow nor vanish."""
