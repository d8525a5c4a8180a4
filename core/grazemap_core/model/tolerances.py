"""Tolerances and limits of the modal model and the responses, each with the reason for its size."""

from __future__ import annotations

import math
from typing import Final

from grazemap_core.tolerances import EPSILON

MODAL_CONDITION_LIMIT: Final = 1.0e5
"""Largest condition number of the (column-scaled, energy-weighted) matrix of modes that is accepted.

The error of states computed from modal coordinates is about this times EPSILON: 2e-11 at the limit. Only two blocks
that are nearly defective *together* come close to it; a critical mode alone is one block and perfectly conditioned.
"""

MODAL_REFINEMENT_STEPS: Final = 6
"""Maximum number of Newton steps for the decomposition; two or three are usual, as they converge quadratically."""

MODAL_REFINEMENT_GOAL: Final = 4.0 * EPSILON
"""Relative residual of the decomposition at which another Newton step would change roundings only."""

MODAL_REFINEMENT_REACH: Final = 0.1
"""Largest relative correction from which Newton's method for the decomposition converges."""

EQUAL_EXPONENTS: Final = 1e-8
"""Singular values of the equations that separate two blocks, relative to the largest one, below which the blocks have
equal exponents, if Newton's method does not separate them otherwise: round-off over this is still a small update."""

SEPARATING_CHANGE: Final = 1e-9
"""Random change of the exponents, relative to the largest ones, that separates equal ones: far more than round-off, and
little enough for Newton's method."""

SEPARATING_TRIALS: Final = 8
"""Random changes that are tried one after another, as one may order equal exponents badly."""

UNDAMPED_RATIO: Final = 8.0 * EPSILON
"""A block is undamped if decay/frequency is at most this, unless ``C = 2 gamma K`` says it.

Decays are computed to a few times EPSILON of the frequency; a mode in which no damper moves has exactly zero."""

PROPORTIONAL_SPREAD: Final = 2.0 * EPSILON
"""A list of link dampings is proportional if all c_i/k_i agree to this: the roundings of two quotients."""

RESONANCE_ROUNDING: Final = 1e-6
"""Round-off of the steady motion of the contact, in units of `Stops.unit`, above which motions are unresolved: states
are relative to it, or with resonant modes to the response of half a period."""

RESONANT_GAIN: Final = 30.0
"""Steady motion of a mode, in units of its response within half a forcing period, above which it is resonant.

The rounding of a smaller steady motion adds no more to the error of impact times than that of the inputs does. A mode
with a damping ratio above 1/(2 pi RESONANT_GAIN) = 0.0053 is never resonant.
"""

HELD_RESONANT_GAIN: Final = 1e6
"""The same for the structure that moves while the contact rests on a stop: there trajectories end that come to rest, as
larger steady motions would cost more than six digits."""

STEADY_REFINEMENT_STEPS: Final = 10
"""Maximum number of refinement steps of a linear solve; one is usual, a resonance with decay/frequency < 1e-8 needs
more."""

STEADY_ACCURACY: Final = EPSILON / 16.0
"""Remaining relative error of a coordinate at which refinement stops: rounding to a double hides it."""

STEADY_DIVERGED: Final = 1.0e-13
"""Remaining error, relative to the solution, above which refinement has not converged: a resonance without damping."""

RESPONSE_ROUNDOFF: Final = 16.0 * EPSILON
"""Round-off of an impulse response or periodic sum, relative to its terms plus time times the terms of its derivative.

Frequencies and decays carry up to about 6 roundings (3 units of EPSILON), sines and exponentials and their sums as
many again; measured errors stay below a third of this bound (tests/unit/core/test_impulse_response.py). It is
multiplied by the conditioning of the modal model.
"""

BOUND_SAFETY: Final = 1.0 + 1.0e-9
"""Factor on bounds of derivatives that covers the rounding errors of the bounds."""

REFINEMENT_CONDITION_FACTOR: Final = 1e3
"""Condition number, in units of MODAL_CONDITION_LIMIT, above which refinement stops: the first approximation may be
worse conditioned than the refined blocks, but at most by this factor."""

ASYMMETRY: Final = 16.0 * EPSILON
"""Largest difference of M and its transpose, relative to its largest number, that is taken as rounding."""

FLOOR_OF_WEIGHTS: Final = 16.0 * EPSILON
"""Smallest squared frequency, relative to the largest one, by which displacements are weighted in the refinement."""

CLASSICAL_COUPLING: Final = 16.0 * EPSILON
"""Damping between two modes, relative to the largest entry of the damping in modal coordinates times N, up to which
a damping matrix is taken as diagonal in the modes: the roundings of its numbers and of the shapes."""

FREE_MODE: Final = 16.0 * EPSILON
"""Eigenvalue or singular value of a stiffness matrix, over the largest one and N, up to which it is the rounding of 0
and its mode is free; and force along a free mode, over the largest force and N, up to which it is the rounding of 0.
The error of the decompositions is a few EPSILON times N and the largest value."""

GROWTH: Final = math.sqrt(EPSILON)
"""Largest real part of an exponent, over the largest exponent, that is not taken as growth: by so much round-off
separates two equal exponents."""

VANISHING_WEIGHT: Final = 16.0 * EPSILON
"""Weight of the contact in a mode, relative to the sum of its terms, up to which it is the rounding of 0."""
