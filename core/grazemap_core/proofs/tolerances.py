"""Sizes, numbers of digits and limits of the search for proofs, each with the reason for its size.

None of them decides what is proven: the checker computes its own bounds from the numbers of a certificate.
"""

from __future__ import annotations

from typing import Final

DOUBLINGS: Final = 3
"""Numbers of digits tried, each twice the one before: more digits decide what is closer to a boundary, and each attempt
takes several times as long as the one before."""

BITS_PER_DIGIT: Final = 3.33
"""Bits of precision for each digit of an enclosure: log2(10), rounded up."""

BITS_LOST: Final = 128
"""Further bits of precision, for what Newton's method and the impacts of an orbit lose."""

BITS_PER_IMPACT: Final = 2
"""Further bits of precision for each impact of a transient; about one is lost."""

MORE_DIGITS: Final = 6
"""Digits of a solution beyond those of the enclosures, so that its error is far inside the box."""

DOUBLE_DIGITS: Final = 20
"""Digits of a solution to double precision, of which three are more than a double has."""

TIME_DIGITS: Final = 25
"""Digits of the impact times of a transient, which the checker refines."""

NORM_DIGITS: Final = 12
"""Digits of the matrix of a norm: any matrix near it gives a norm in which the same balls contract."""

RADIUS_DIGITS: Final = 4
"""Digits of a radius, which need not be accurate."""

NEWTON_STEPS: Final = 30
"""Maximum number of Newton steps; from double precision three or four are needed."""

LARGEST_STEP: Final = 0.2
"""Relative step above which Newton's method leaves its starting point."""

LAST_STEP: Final = 1e-3
"""Step of Newton's method, in radii of the box, after which the solution is well inside it."""

WIDER: Final = 1.01
"""Size of the box in which an orbit is shown to be the only one, over that of the states that a statement admits."""

SIGN_SAMPLES: Final = 64
"""Parts of a range of frequencies in which a change of sign is looked for. Two zeros in one part are not found."""

MAX_PERIOD: Final = 32
"""Largest period of an orbit that is looked for."""

REPEATED: Final = 1e-3
"""Relative difference up to which impacts count as repeated: close enough for Newton's method to start from them."""

FIRST_PERIODS: Final = 16
"""Periods of the forces after which an orbit is first looked for; then after 1.5 times as many, again and again."""

BALL_EXPONENTS: Final = range(2, 17)
"""Negative powers of ten that are tried as the size of a ball, in units of the clearance: down to double precision."""

SQUARINGS: Final = 60
"""Squarings of the return map's derivative in the norm of a ball, the sum of D^T^n D^n: 2^60 returns, after which a
multiplier that is below 1 in double precision has become negligible."""

TAYLOR_TERMS: Final = 30
"""Terms of the Taylor series on which impacts are found: with SERIES_STEP the first one that is omitted is below
2^30/30! = 4e-24 of the amplitude."""

SERIES_STEP: Final = 2.0
"""Length of a step of the series, in units of the equations' or the forcing's time scale, the shorter."""

SERIES_SAMPLES: Final = 65
"""Values of the series in a step, between which it changes its sign, or has a minimum, at most once in general."""

BISECTIONS: Final = 40
"""Halvings of the interval between two samples, to about the rounding of the series."""

IMPACT_STEPS: Final = 60
"""Maximum number of Newton steps for the time of an impact; more are needed only near a graze."""

IMPACT_BITS: Final = 40
"""Bits of the precision that the time of an impact may lack: at a slow impact Newton's steps end with fewer bits."""
