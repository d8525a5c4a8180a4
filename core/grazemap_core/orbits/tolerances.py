"""Tolerances and limits of periodic orbits, each with the reason for its size."""

from __future__ import annotations

from typing import Final

ORBIT_RESIDUAL: Final = 1e-12
"""Largest residual, relative to the terms that it is a sum of, with which an orbit counts as solved; round-off of an
orbit with tens of impacts is a hundredth of it."""

ORBIT_SETTLED: Final = 1e-8
"""Newton step, in radians of phase and in units of omega times length, behind which the next one is round-off."""

ORBIT_NEWTON_STEPS: Final = 40
"""Newton steps from a guess; from a close one three to five are used, far ones are shortened a few times."""

ORBIT_HALVINGS: Final = 12
"""Halvings of one Newton step that does not lower the residual, and steps that may be cut short by a neighbour."""

ORBIT_GAP: Final = 0.2
"""Share of the time between two impacts that one Newton step leaves of it."""

ORBIT_FLOOR: Final = 1e-6
"""Distance from a stop, in lengths, beyond which maxima are not looked for where only contacts are asked for; far above
round-off of the distance."""

SAME_ORBIT: Final = 1e-7
"""Relative difference of phases and velocities up to which two halves, or parts, of an orbit are the same. Orbits with
a broken symmetry or a doubled period differ by the root of the distance from where they were born: here 1e-14 of it."""

KANTOROVICH: Final = 0.5
"""Largest number of Newton and Kantorovich with which a solution is certain to exist, and to be one."""

ORBIT_NEARBY: Final = 100.0
"""Distance of impacts of an orbit from those of a trajectory, in units of what its returns extrapolate to, up to which
the trajectory goes to that orbit: stiff modes and slow impacts stretch it."""

MOST_PROVEN_IMPACTS: Final = 128
"""Impacts of a motion up to which it is proven: the time that takes grows with their square."""

PROOF_STEPS: Final = 8
"""Newton steps from a trajectory to the motion that it is close to: three are used, more where an impact is slow."""

SURELY_STABLE: Final = 1.0 - 1e-6
"""Largest modulus of the multipliers of an orbit that is stable: two that meet are good to the root of round-off."""
