"""Many periodic motions of one pattern, each from its own guess: solved, certified, judged."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.numerics.jit.by_reference import reference
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, STACK, nearest_contact
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.multipliers import orbit_multipliers
from grazemap_core.orbits.kernels.newton import CONVERGED, OrbitWork, certificate, solve_orbit


class OrbitResults(NamedTuple):
    """What is told of m motions.

    Attributes
    ----------
    status, steps, contact, stop : int (m,)
        Of `orbit_newton` and `orbit_contacts`.
    residual, kantorovich, radius, excess, phase : (m,)
    real, imaginary : (m, 2 N)
        Multipliers, in no order.
    before : (m, k, 3)
        Displacement, velocity and acceleration of mass 1 before every impact.
    """

    status: Integers
    steps: Integers
    contact: Integers
    stop: Integers
    residual: Floats
    kantorovich: Floats
    radius: Floats
    excess: Floats
    phase: Floats
    real: Floats
    imaginary: Floats
    before: Floats


class OrbitScratch(NamedTuple):
    """Scratch for k impacts and N blocks.

    Attributes
    ----------
    newton : OrbitWork
    across, states, flow, stack, here : (k, N, 4), (4, N, 2), (N, 4), (STACK, 2), (3, 4)
        Of `orbit_contacts.nearest_on_way`.
    matrix : (2 N, 2 N)
    """

    newton: OrbitWork
    across: Floats
    states: Floats
    flow: Floats
    stack: Floats
    here: Floats
    matrix: Floats


def orbit_results(number: int, count: int, blocks: int) -> OrbitResults:
    """Return room for what is told of `number` motions of `count` impacts."""
    return OrbitResults(
        status=np.zeros(number, dtype=np.int64),
        steps=np.zeros(number, dtype=np.int64),
        contact=np.zeros(number, dtype=np.int64),
        stop=np.zeros(number, dtype=np.int64),
        residual=np.full(number, np.nan),
        kantorovich=np.full(number, np.nan),
        radius=np.full(number, np.nan),
        excess=np.full(number, np.nan),
        phase=np.full(number, np.nan),
        real=np.full((number, 2 * blocks), np.nan),
        imaginary=np.full((number, 2 * blocks), np.nan),
        before=np.full((number, count, 3), np.nan),
    )


def orbit_scratch(count: int, blocks: int) -> OrbitScratch:
    """Return scratch for motions of `count` impacts."""
    size = 2 * count
    newton = OrbitWork(
        residual=np.zeros(size),
        jacobian=np.zeros((size, size + 2)),
        system=np.zeros((size, 2 * size + 1)),
        step=np.zeros((2, count)),
        trial=np.zeros((2, count)),
        before=np.zeros((count, 3)),
    )
    return OrbitScratch(
        newton,
        np.zeros((count, blocks, 4)),
        np.zeros((4, blocks, 2)),
        np.zeros((blocks, 4)),
        np.zeros((STACK, 2)),
        np.zeros((3, 4)),
        np.zeros((2 * blocks,) * 2),
    )


@kernel
def solve_orbits(
    problem: OrbitProblem,
    stops: Floats,
    clearances: Floats,
    phases: Floats,
    speeds: Floats,
    floor: float,
    results: OrbitResults,
    scratch: OrbitScratch,
) -> None:
    """Solve for every motion, and write what there is to say of it into results.

    Parameters
    ----------
    stops : (k,)
    clearances : (m,)
    phases, speeds : (m, k)
        Guesses; become the solutions.
    floor : float
        As in `orbit_contacts.nearest_on_way`.
    """
    chain, told, scratch = reference(problem), reference(results), reference(scratch)
    work = scratch.newton
    for i in range(clearances.shape[0]):
        status, steps, residual, terms = solve_orbit(chain, stops, clearances[i], phases[i], speeds[i], work)
        told.status[i], told.steps[i], told.residual[i] = status, steps, residual
        told.contact[i], told.stop[i] = GIVEN_UP, 0
        if status != CONVERGED:
            for j in range(told.real.shape[1]):
                told.real[i, j], told.imaginary[i, j] = math.nan, math.nan
            continue
        told.kantorovich[i], told.radius[i] = certificate(chain, speeds[i], terms, work)
        told.contact[i], told.excess[i], told.phase[i], told.stop[i] = nearest_contact(
            chain,
            stops,
            clearances[i],
            phases[i],
            speeds[i],
            floor,
            scratch.across,
            scratch.states,
            scratch.flow,
            scratch.stack,
            scratch.here,
        )
        orbit_multipliers(chain, phases[i], speeds[i], work.before, scratch.matrix, told.real[i], told.imaginary[i])
        for k in range(stops.shape[0]):
            for column in range(3):
                told.before[i, k, column] = work.before[k, column]
