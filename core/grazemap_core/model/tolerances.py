"""Tolerances and limits of the modal model and the responses, each with the reason for its size."""

from __future__ import annotations

from typing import Final

from grazemap_core.tolerances import EPSILON

MODAL_CONDITION_LIMIT: Final = 1.0e5
"""Largest condition number of the (column-scaled, energy-weighted) matrix of modes that is accepted.

States are rebuilt from modal coordinates with an error of about this times EPSILON: 2e-11 at the limit. Only two
blocks that are nearly defective *together* come near it; a critical mode alone is one block and perfectly conditioned.
"""

MODAL_REFINEMENT_STEPS: Final = 6
"""Newton steps allowed to the decomposition; two or three are used, since they converge quadratically."""

MODAL_REFINEMENT_GOAL: Final = 4.0 * EPSILON
"""Relative residual of the decomposition at which another Newton step would only move roundings about."""

MODAL_REFINEMENT_REACH: Final = 0.1
"""Largest relative correction from which Newton's method on the decomposition is trusted to converge."""

UNDAMPED_RATIO: Final = 8.0 * EPSILON
"""A block of a chain with a list of dampings is undamped when decay/frequency is at most this.

Decays are computed to a few times EPSILON of the frequency; a mode whose damped links do not stretch has exactly zero.
"""

PROPORTIONAL_SPREAD: Final = 2.0 * EPSILON
"""A list of link dampings is proportional when all c_i/k_i agree to this: the roundings of two quotients."""

RESONANCE_ROUNDING: Final = 1e-6
"""Round-off of the steady motion of mass 1, in units of the clearance, from which on nothing is said about a motion:
states are relative to the steady one, which grows beyond all bounds toward a resonance without damping."""

STEADY_REFINEMENT_STEPS: Final = 10
"""Refinement steps allowed to one linear solve; one is the rule, a resonance with decay/frequency < 1e-8 takes more."""

STEADY_ACCURACY: Final = EPSILON / 16.0
"""Error left in x_1, relative to x_1, at which refinement stops: invisible once x_1 is rounded to a double."""

STEADY_DIVERGED: Final = 1.0e-13
"""Error left, relative to the solution, above which refinement has not converged: a resonance without damping."""

RESPONSE_ROUNDOFF: Final = 16.0 * EPSILON
"""Round-off of an impulse response or periodic sum, relative to its terms plus time times the terms of its derivative.

Frequencies and decays carry up to about 6 roundings (3 units of EPSILON), sines and exponentials and their sums as
many again; measured errors stay below a third of this bound (tests/core/test_impulse_response.py). It is multiplied by
the conditioning of the modal model.
"""

BOUND_SAFETY: Final = 1.0 + 1.0e-9
"""Factor on bounds of derivatives that covers the roundings made in computing the bound."""
