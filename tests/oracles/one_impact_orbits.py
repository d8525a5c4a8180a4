"""Single orbits on a branch of one-impact motions in closed form: a state to start from, and every Floquet multiplier.

An orbit is chosen by its angle on the branch, or by its clearance (theory, "One impact a period"). States and
multipliers are in 50 digits, rounded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb

from tests.oracles.closed_form import OneImpactBranch
from tests.oracles.fifty_digits import digits


@dataclass(frozen=True, eq=False)
class OneImpactOrbit:
    """A periodic motion with one impact in n forcing periods, or one on each stop, just before an impact.

    Attributes
    ----------
    omega, clearance : float
    multiple : int
        n.
    symmetric : bool
        One impact on each stop.
    stop : int
        Stop of the impact at t = 0: +1 (A) or -1 (C).
    angle : float
        Angle on the branch, radians in (-pi/2, pi/2).
    impact_velocity : float
        Speed of mass 1 before the impact, > 0.
    displacement, velocity : ndarray of shape (N,)
        State just before the impact. `trajectory.trajectory`, started there, begins with the impact.
    phase : float
        Forcing phase there, in (-pi, pi].
    multipliers : ndarray of complex, shape (2N,)
        Floquet multipliers over n forcing periods, by decreasing modulus.
    half_multipliers : ndarray of complex, shape (2N,), or None
        Symmetric motions only: those of half the period followed by the mirror image; their squares are the
        multipliers. At a saddle-node one is +1; where the symmetry breaks, -1.
    stable : bool
        Every multiplier has a modulus below 1.
    admissible : bool
        There is no contact with a stop other than its impacts. An orbit that is not admissible solves the equations,
        but is no motion.
    """

    omega: float
    clearance: float
    multiple: int
    symmetric: bool
    stop: int
    angle: float
    impact_velocity: float
    displacement: Any
    velocity: Any
    phase: float
    multipliers: Any
    half_multipliers: Any
    stable: bool
    admissible: bool


def orbit_at(branch: OneImpactBranch, angle: float, stop: int = 1) -> OneImpactOrbit:
    """Return the orbit at an angle of a branch.

    Parameters
    ----------
    branch : OneImpactBranch
    angle : float
        Above ``branch.lowest`` and below pi/2.
    stop : {1, -1}
        The stop that is struck at t = 0; with -1 the orbit is the mirror image.
    """
    assert max(branch.lowest, -0.5 * math.pi) < angle < 0.5 * math.pi
    return _orbit(branch, angle, branch.clearance(angle), branch.impact_velocity(angle), stop)


def orbits_at_clearance(branch: OneImpactBranch, clearance: float, stop: int = 1) -> list[OneImpactOrbit]:
    """Return the orbits of a branch with this clearance, by rising impact velocity: none, one, or two."""
    return [
        _orbit(branch, angle, float(clearance), branch.impact_velocity(angle), stop)
        for angle in branch.angles(clearance)
    ]


def _orbit(branch: OneImpactBranch, angle: float, clearance: float, speed: float, stop: int) -> OneImpactOrbit:
    phase, count = angle - branch.phase, branch.oscillator.size
    with digits():
        exact = arb(angle) - branch.exact_phase
        state = branch.motions.state(exact)
        signed = np.array(branch.motions.multipliers(exact))
        numbers = np.array([float(state[i, 0]) for i in range(2 * count)])
    displacement, velocity = numbers[:count], numbers[count:]
    # mass 1 is on its stop, and strikes it with that speed, exactly
    displacement[0], velocity[0] = clearance, speed
    if stop < 0:
        displacement, velocity, phase = -displacement, -velocity, phase + math.pi
    phase = math.remainder(phase, 2.0 * math.pi)

    signed = signed[np.argsort(-np.abs(signed), kind="stable")]
    symmetric = branch.pattern.symmetric
    multipliers = signed * signed if symmetric else signed
    return OneImpactOrbit(
        omega=branch.omega,
        clearance=clearance,
        multiple=branch.pattern.multiple,
        symmetric=symmetric,
        stop=stop,
        angle=angle,
        impact_velocity=speed,
        displacement=displacement,
        velocity=velocity,
        phase=phase if phase > -math.pi else math.pi,
        multipliers=multipliers,
        half_multipliers=signed if symmetric else None,
        stable=bool(np.all(np.abs(multipliers) < 1.0)),
        admissible=angle > branch.admissible_above,
    )
