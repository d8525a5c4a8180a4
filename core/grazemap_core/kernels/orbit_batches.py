"""Many periodic motions of one pattern, each from its own guess: solved, certified, judged."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap_core.kernels.compiled import kernel
from grazemap_core.kernels.orbit_contacts import GIVEN_UP, STACK, nearest_contact
from grazemap_core.kernels.orbit_equations import OrbitProblem
from grazemap_core.kernels.orbit_multipliers import orbit_multipliers
from grazemap_core.kernels.orbit_newton import CONVERGED, OrbitWork, certificate, solve_orbit
from grazemap_core.kernels.references import reference

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


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

    status: IntArray
    steps: IntArray
    contact: IntArray
    stop: IntArray
    residual: FloatArray
    kantorovich: FloatArray
    radius: FloatArray
    excess: FloatArray
    phase: FloatArray
    real: FloatArray
    imaginary: FloatArray
    before: FloatArray


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
    across: FloatArray
    states: FloatArray
    flow: FloatArray
    stack: FloatArray
    here: FloatArray
    matrix: FloatArray


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
    stops: FloatArray,
    clearances: FloatArray,
    phases: FloatArray,
    speeds: FloatArray,
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
    chain, told, room = reference(problem), reference(results), reference(scratch)
    work = room.newton
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
            room.across,
            room.states,
            room.flow,
            room.stack,
            room.here,
        )
        orbit_multipliers(chain, phases[i], speeds[i], work.before, room.matrix, told.real[i], told.imaginary[i])
        for k in range(stops.shape[0]):
            for column in range(3):
                told.before[i, k, column] = work.before[k, column]
