"""Newton's method for a periodic motion with impacts, and how sure one can be that there is one where it ends.

A guess of phases and speeds flows in; out flow those of the motion, a status, and the number of Newton and Kantorovich:
with b the norm of the inverse matrix, s that of the next step and L a bound on second derivatives, there is exactly one
solution within 2 s when ``b s L <= 1/2``. Round-off of the residual is added to s; the inverse itself is rounded.

References
----------
P. Deuflhard, *Newton Methods for Nonlinear Problems*, 2004, theorem 2.1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.model.tolerances import RESPONSE_ROUNDOFF
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits.kernels.equations import OrbitProblem, assemble, curvature
from grazemap_core.orbits.tolerances import ORBIT_GAP, ORBIT_HALVINGS, ORBIT_NEWTON_STEPS, ORBIT_RESIDUAL, ORBIT_SETTLED

CONVERGED = 0
"""The residual is round-off."""
NOT_CONVERGED = 1
"""It is not after ORBIT_NEWTON_STEPS, or steps no longer lower it."""
OUT_OF_ORDER = 2
"""Impacts would have to change places."""
SINGULAR = 3
"""The matrix is singular: a saddle-node, or a resonant graze."""


class OrbitWork(NamedTuple):
    """Scratch for k impacts and N blocks.

    Attributes
    ----------
    residual : (2 k,)
    jacobian : (2 k, 2 k + 2)
    system : (2 k, 4 k + 1)
    step : (2, k)
    trial : (2, k)
    before : (k, 3)
    """

    residual: Floats
    jacobian: Floats
    system: Floats
    step: Floats
    trial: Floats
    before: Floats


@kernel
def _norm(vector: Floats) -> float:
    largest = 0.0
    for i in range(vector.shape[0]):
        if not abs(vector[i]) <= largest:
            largest = abs(vector[i])
    return largest


@kernel
def allowed_share(problem: OrbitProblem, phases: Floats, step: Floats) -> float:
    """Return the share, up to 1, of a step of the phases (k,) that leaves every gap at least ORBIT_GAP of itself."""
    count = phases.shape[0]
    share = 1.0
    for i in range(count):
        following = (i + 1) % count
        gap = phases[following] - phases[i] + (problem.turn if following <= i else 0.0)
        closing = step[i] - step[following]
        if closing * share > (1.0 - ORBIT_GAP) * gap:
            share = (1.0 - ORBIT_GAP) * gap / closing
    return share


@kernel
def solve_orbit(
    problem: OrbitProblem,
    stops: Floats,
    clearance: float,
    phases: Floats,
    speeds: Floats,
    work: OrbitWork,
) -> tuple[int, int, float, float]:
    """Move a guess, phases (k,) and speeds (k,), onto the motion.

    Returns
    -------
    status : int
        CONVERGED, NOT_CONVERGED, OUT_OF_ORDER or SINGULAR.
    steps : int
    residual : float
        Largest one left, in lengths.
    terms : float
        As `assemble` returns it. Once converged, `work` holds residual, matrix and states of the motion.
    """
    count = stops.shape[0]
    size = 2 * count
    jacobian, system, step, trial = work.jacobian, work.system, work.step, work.trial
    terms = assemble(problem, stops, clearance, phases, speeds, work.residual, jacobian, work.before)
    norm = _norm(work.residual)
    shortened = 0
    settled = False
    for steps in range(ORBIT_NEWTON_STEPS):
        if not np.isfinite(norm):
            return NOT_CONVERGED, steps, norm, terms
        if settled or norm <= RESPONSE_ROUNDOFF * terms * 0.01:
            converged = norm <= ORBIT_RESIDUAL * max(1.0, terms)
            return CONVERGED if converged else NOT_CONVERGED, steps, norm, terms
        for i in range(size):
            for j in range(size):
                system[i, j] = jacobian[i, j]
            system[i, size] = -work.residual[i]
        if eliminate(system[:, : size + 1], size) == 0.0:
            return SINGULAR, steps, norm, terms
        for i in range(count):
            step[0, i] = system[i, size]
            step[1, i] = system[count + i, size]
        share = allowed_share(problem, phases, step[0])
        if share < 1.0:
            shortened += 1
            if shortened > ORBIT_HALVINGS:
                return OUT_OF_ORDER, steps, norm, terms
        length = max(_norm(step[0]), _norm(step[1]))
        before = norm
        for _ in range(ORBIT_HALVINGS):
            for i in range(count):
                trial[0, i] = phases[i] + share * step[0, i]
                trial[1, i] = speeds[i] + share * step[1, i]
            terms = assemble(problem, stops, clearance, trial[0], trial[1], work.residual, jacobian, work.before)
            norm = _norm(work.residual)
            if norm < before or norm <= RESPONSE_ROUNDOFF * terms:
                break
            share *= 0.5
        if not (norm < before or norm <= RESPONSE_ROUNDOFF * terms):
            return NOT_CONVERGED, steps, norm, terms
        for i in range(count):
            phases[i] = trial[0, i]
            speeds[i] = trial[1, i]
        # after a step this short the next would be round-off, and so was this one where the residual was before
        settled = (share == 1.0 and length <= ORBIT_SETTLED) or before <= RESPONSE_ROUNDOFF * terms
    return NOT_CONVERGED, ORBIT_NEWTON_STEPS, norm, terms


@kernel
def certificate(problem: OrbitProblem, speeds: Floats, terms: float, work: OrbitWork) -> tuple[float, float]:
    """Return the number of Newton and Kantorovich of an orbit as `solve_orbit` leaves it, and the radius 2 s.

    `terms` is what `assemble` has returned. Infinity where the matrix is singular.
    """
    size = 2 * speeds.shape[0]
    system = work.system
    noise = RESPONSE_ROUNDOFF * terms
    for i in range(size):
        for j in range(size):
            system[i, j] = work.jacobian[i, j]
            system[i, size + 1 + j] = 1.0 if i == j else 0.0
        system[i, size] = work.residual[i]
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
    return inverse * step * curvature(problem, speeds, 2.0 * step), 2.0 * step
