"""Every tolerance of the core, named, with the reason for its size.

All of them are relative to a scale of the problem at hand, so the same numbers serve SI and nondimensional
descriptions of one system.
"""

from __future__ import annotations

from typing import Final

EPSILON: Final = 2.220446049250313e-16
"""Distance from 1 to the next binary64 number; one rounding errs by at most half of it."""

# --- modal model --------------------------------------------------------------------------------------------------

MODAL_CONDITION_LIMIT: Final = 1.0e5
"""Largest condition number of the (column-scaled, energy-weighted) matrix of modes that is accepted.

States are rebuilt from modal coordinates with an error of about this times EPSILON: 2e-11 at the limit. Only two
blocks that are nearly defective *together* come near it; a critical mode alone is one block and perfectly conditioned.
"""

MODAL_REFINEMENT_STEPS: Final = 6
"""Newton steps allowed to the decomposition; two or three are used, since they converge quadratically."""

MODAL_REFINEMENT_GOAL: Final = 4.0 * EPSILON
"""Relative residual of the decomposition at which another Newton step would only move roundings about."""

UNDAMPED_RATIO: Final = 8.0 * EPSILON
"""A block of a chain with a list of dampings is undamped when decay/frequency is at most this.

Decays are computed to a few times EPSILON of the frequency; a mode whose damped links do not stretch has exactly zero.
"""

PROPORTIONAL_SPREAD: Final = 2.0 * EPSILON
"""A list of link dampings is proportional when all c_i/k_i agree to this: the roundings of two quotients."""
