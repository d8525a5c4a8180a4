"""Tolerances and limits of numerical kernels, each with the reason for its size."""

from __future__ import annotations

from typing import Final

TAYLOR_DEGREE: Final = 18
"""Degree of the local series of x1. With steps of at most CELL_REACH / |lambda| the first term left out is below
1/19! = 8e-18 of a mode's amplitude; its bound is added to the contact test all the same."""

QR_STEPS: Final = 60
"""QR steps after which an eigenvalue is given up; two or three are the rule, every tenth has an exceptional shift."""
