"""Newton's method for a periodic motion with impacts, and the Newton-Kantorovich theorem where it ends.

With b the norm of the inverse of the Jacobian, s the norm of the next Newton step and L a bound on the second
derivatives, there is exactly one solution within 2 s when ``b s L <= 1/2``. The round-off of the residual is added to
s; the round-off of the inverse is not bounded, so the statement is as certain as floating-point numbers allow.

References
----------
P. Deuflhard, *Newton Methods for Nonlinear Problems*, 2004, theorem 2.1.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits import tolerances
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, assemble, second_derivative_bound
from grazemap_core.records import NamedTuple

CONVERGED = 0
"""The residual is round-off."""
NOT_CONVERGED = 1
"""The residual is not round-off after ORBIT_NEWTON_STEPS, or steps no longer lower it."""
OUT_OF_ORDER = 2
"""The order of the impacts would have to change."""
SINGULAR = 3
"""The Jacobian is singular, or nearly so at a small residual that no step lowers: a saddle-node, or a resonant graze
near which there is no orbit."""


class NewtonScratch(NamedTuple):
    """Scratch for k impacts."""

    residual: Floats
    """(2 k,) Residuals of the equations."""
    jacobian: Floats
    """(2 k, 2 k + 1) Their derivatives."""
    system: Floats
    """(2 k, 4 k + 1) For elimination."""
    step: Floats
    """(2, k) Newton's step of phases and speeds."""
    trial: Floats
    """(2, k) Phases and speeds after the step."""
    before: Floats
    """(k, 3) Displacement, velocity and acceleration of the contact before every impact."""


def newton_scratch(impacts: int) -> NewtonScratch:
    """Return scratch for orbits of `impacts` impacts."""
    size = 2 * impacts
    return NewtonScratch(
        residual=np.zeros(size),
        jacobian=np.zeros((size, size + 1)),
        system=np.zeros((size, 2 * size + 1)),
        step=np.zeros((2, impacts)),
        trial=np.zeros((2, impacts)),
        before=np.zeros((impacts, 3)),
    )


@kernel
def _norm(vector: Floats) -> float:
    largest = 0.0
    for i in range(vector.shape[0]):
        if not abs(vector[i]) <= largest:
            largest = abs(vector[i])
    return largest


@kernel
def allowed_share(problem: OrbitProblem, phases: Floats, step: Floats) -> float:
    """Return the share, at most 1, of a step of the phases (k,) that leaves at least MIN_SPACING_RATIO of every gap."""
    count = phases.shape[0]
    share = 1.0
    for i in range(count):
        following = (i + 1) % count
        gap = phases[following] - phases[i] + (problem.turn if following <= i else 0.0)
        closing = step[i] - step[following]
        if closing * share > (1.0 - tolerances.MIN_SPACING_RATIO) * gap:
            share = (1.0 - tolerances.MIN_SPACING_RATIO) * gap / closing
    return share


@kernel
def solve_orbit(problem: OrbitProblem, impacts: OrbitImpacts, scratch: NewtonScratch) -> tuple[int, int, float, float]:
    """Solve for the motion near a guess of the phases and speeds of its impacts, in place.

    At a saddle-node the Jacobian is singular, and round-off in the residual makes a step of any length and direction.
    Such steps are not taken: numbers that solve the equations to round-off are the motion.

    Returns
    -------
    status : int
        CONVERGED, NOT_CONVERGED, OUT_OF_ORDER or SINGULAR.
    steps : int
    residual : float
        Largest residual, in units of length.
    terms : float
        As `assemble` returns it. After convergence `scratch` holds residual, Jacobian and states of the motion.
    """
    phases, speeds = impacts.phases, impacts.speeds
    count = phases.shape[0]
    size = 2 * count
    jacobian, system, step, trial = scratch.jacobian, scratch.system, scratch.step, scratch.trial
    tried = reference(OrbitImpacts(impacts.stops, impacts.sides, trial[0], trial[1]))
    terms = assemble(problem, impacts, scratch.residual, jacobian, scratch.before)
    norm = _norm(scratch.residual)
    shortened = 0
    settled = False
    for steps in range(tolerances.ORBIT_NEWTON_STEPS):
        if not np.isfinite(norm):
            return NOT_CONVERGED, steps, norm, terms
        if settled or norm <= tolerances.ORBIT_EXACT * terms:
            converged = norm <= tolerances.ORBIT_RESIDUAL * max(1.0, terms)
            return CONVERGED if converged else NOT_CONVERGED, steps, norm, terms
        for i in range(size):
            for j in range(size):
                system[i, j] = jacobian[i, j]
            system[i, size] = -scratch.residual[i]
        solved = norm <= RESPONSE_ROUNDOFF * terms
        if eliminate(system[:, : size + 1], size) == 0.0:
            return CONVERGED if solved else SINGULAR, steps, norm, terms
        for i in range(count):
            step[0, i] = system[i, size]
            step[1, i] = system[count + i, size]
        length = max(_norm(step[0]), _norm(step[1]))
        if solved and not length <= tolerances.ORBIT_SETTLED:
            return CONVERGED, steps, norm, terms
        share = allowed_share(problem, phases, step[0])
        if share < 1.0:
            shortened += 1
            if shortened > tolerances.ORBIT_HALVINGS:
                return OUT_OF_ORDER, steps, norm, terms
        nearly = norm <= tolerances.ORBIT_NEARLY_SOLVED * terms
        before = norm
        for _ in range(tolerances.ORBIT_HALVINGS):
            for i in range(count):
                trial[0, i] = phases[i] + share * step[0, i]
                trial[1, i] = speeds[i] + share * step[1, i]
            terms = assemble(problem, tried, scratch.residual, jacobian, scratch.before)
            norm = _norm(scratch.residual)
            if norm < before or norm <= RESPONSE_ROUNDOFF * terms:
                break
            share *= 0.5
        if not (norm < before or norm <= RESPONSE_ROUNDOFF * terms):
            return SINGULAR if nearly else NOT_CONVERGED, steps, before, terms
        for i in range(count):
            phases[i] = trial[0, i]
            speeds[i] = trial[1, i]
        # the next step would be round-off, because this step is short, or the residual was round-off before this step
        settled = solved or (share == 1.0 and length <= tolerances.ORBIT_SETTLED)
    return NOT_CONVERGED, tolerances.ORBIT_NEWTON_STEPS, norm, terms


@kernel
def newton_kantorovich(
    problem: OrbitProblem, impacts: OrbitImpacts, terms: float, scratch: NewtonScratch
) -> tuple[float, float]:
    """Return the Newton-Kantorovich quantity ``b s L`` and the radius 2 s; infinity for a singular Jacobian.

    `scratch` is as `solve_orbit` or `assemble` leaves it; `terms` is what `assemble` returns.
    """
    size = 2 * impacts.speeds.shape[0]
    system = scratch.system
    noise = RESPONSE_ROUNDOFF * terms
    for i in range(size):
        for j in range(size):
            system[i, j] = scratch.jacobian[i, j]
            system[i, size + 1 + j] = 1.0 if i == j else 0.0
        system[i, size] = scratch.residual[i]
    if eliminate(system, size) == 0.0:
        return np.inf, np.inf
    inverse, step = 0.0, 0.0
    for i in range(size):
        row = 0.0
        for j in range(size):
            row += abs(system[i, size + 1 + j])
        inverse = max(inverse, row)
        step = max(step, abs(system[i, size]))
    step += inverse * noise
    return inverse * step * second_derivative_bound(problem, impacts, 2.0 * step), 2.0 * step
