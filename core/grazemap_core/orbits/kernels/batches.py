"""Many periodic orbits of one sequence of stops, each from its own guess: impacts, multipliers and contacts."""

from __future__ import annotations

import math

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, ContactScratch, contact_scratch, further_contact
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem
from grazemap_core.orbits.kernels.multipliers import orbit_multipliers
from grazemap_core.orbits.kernels.newton import CONVERGED, NewtonScratch, newton_kantorovich, solve_orbit
from grazemap_core.records import NamedTuple


class OrbitResults(NamedTuple):
    """The results for m orbits of k impacts, of a structure with N blocks."""

    status: Integers
    """(m,) Of `newton.solve_orbit`."""
    steps: Integers
    """(m,) Steps of `newton.solve_orbit`."""
    contact: Integers
    """(m,) Status of `admissibility.further_contact`."""
    stop: Integers
    """(m,) As `PeriodicOrbit.excess_stop`."""
    residual: Floats
    """(m,) As in `PeriodicOrbit`."""
    kantorovich: Floats
    """(m,) As in `PeriodicOrbit`."""
    radius: Floats
    """(m,) As in `PeriodicOrbit`."""
    excess: Floats
    """(m,) As in `PeriodicOrbit`."""
    phase: Floats
    """(m,) As `PeriodicOrbit.excess_phase`."""
    real: Floats
    """(m, 2 N) Real parts of the multipliers, in no particular order."""
    imaginary: Floats
    """(m, 2 N) Imaginary parts of these multipliers."""
    before: Floats
    """(m, k, 3) Displacement, velocity and acceleration of the contact before every impact."""


class OrbitScratch(NamedTuple):
    """Scratch for k impacts and N blocks."""

    newton: NewtonScratch
    """For Newton's method."""
    flow_between: Floats
    """(k, N, 4) Each block's flow from every impact to the next one."""
    contact: ContactScratch
    """For the search for contacts."""
    matrix: Floats
    """(2 N, 2 N) The Floquet matrix."""


def orbit_results(number: int, count: int, blocks: int) -> OrbitResults:
    """Return arrays for the results of `number` orbits of `count` impacts, not yet computed."""
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
    """Return scratch for orbits of `count` impacts."""
    size = 2 * count
    newton = NewtonScratch(
        residual=np.zeros(size),
        jacobian=np.zeros((size, size + 1)),
        system=np.zeros((size, 2 * size + 1)),
        step=np.zeros((2, count)),
        trial=np.zeros((2, count)),
        before=np.zeros((count, 3)),
    )
    return OrbitScratch(
        newton=newton,
        flow_between=np.zeros((count, blocks, 4)),
        contact=contact_scratch(blocks),
        matrix=np.zeros((2 * blocks, 2 * blocks)),
    )


@kernel
def solve_orbits(
    problem: OrbitProblem,
    impacts: OrbitImpacts,
    gaps: Floats,
    floor: float,
    results: OrbitResults,
    scratch: OrbitScratch,
) -> None:
    """Solve for every orbit, and write its multipliers, contacts and error bounds into results.

    Parameters
    ----------
    impacts : Impacts
        Stops (k,); phases and speeds, (m, k), are guesses and become the solutions. The restitutions of `stops` are
        those of all orbits.
    gaps : (m, 2)
        Gap of the right and of the left stop of each orbit.
    floor : float
        As in `admissibility.further_contact_from`.
    """
    structure, solutions, scratch = reference(problem), reference(results), reference(scratch)
    work = scratch.newton
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    for i in range(gaps.shape[0]):
        between = Stops(
            gaps[i, 0],
            gaps[i, 1],
            stops.restitution_right,
            stops.restitution_left,
            stops.unit,
            stops.chatter_impacts,
            stops.settling_chatter,
            stops.symmetric,
        )
        status, steps, residual, terms = solve_orbit(structure, sides, between, phases[i], speeds[i], work)
        solutions.status[i], solutions.steps[i], solutions.residual[i] = status, steps, residual
        solutions.contact[i], solutions.stop[i] = GIVEN_UP, 0
        if status != CONVERGED:
            for j in range(solutions.real.shape[1]):
                solutions.real[i, j], solutions.imaginary[i, j] = math.nan, math.nan
            continue
        solutions.kantorovich[i], solutions.radius[i] = newton_kantorovich(
            structure, sides, between, speeds[i], terms, work
        )
        solutions.contact[i], solutions.excess[i], solutions.phase[i], solutions.stop[i] = further_contact(
            structure, sides, between, phases[i], speeds[i], floor, scratch.flow_between, scratch.contact
        )
        orbit_multipliers(
            structure,
            OrbitImpacts(between, sides, phases[i], speeds[i]),
            work.before,
            scratch.matrix,
            solutions.real[i],
            solutions.imaginary[i],
        )
        for k in range(sides.shape[0]):
            for column in range(3):
                solutions.before[i, k, column] = work.before[k, column]
