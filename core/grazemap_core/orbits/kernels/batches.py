"""Many periodic orbits of one sequence of stops, each from its own guess: impacts, multipliers and contacts."""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.numerics.jit.compiled import copy_matrix, kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, ContactScratch, contact_scratch, further_contact
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem
from grazemap_core.orbits.kernels.multipliers import orbit_multipliers
from grazemap_core.orbits.kernels.newton import (
    CONVERGED,
    NewtonScratch,
    newton_kantorovich,
    newton_scratch,
    solve_orbit,
)
from grazemap_core.records import NamedTuple


class OrbitResults(NamedTuple):
    """The results for m orbits of k impacts, of a structure with N blocks."""

    status: Integers
    """(m,) Status of `newton.solve_orbit`."""
    steps: Integers
    """(m,) Steps of `newton.solve_orbit`."""
    contact_status: Integers
    """(m,) Status of `admissibility.further_contact`."""
    excess_stop: Integers
    """(m,) Stop of the largest excess of the contact at a maximum between impacts; 0 without such a maximum."""
    residual: Floats
    """(m,) Largest residual, in units of `OrbitProblem.length`."""
    kantorovich: Floats
    """(m,) The Newton-Kantorovich quantity, as in `PeriodicOrbit`."""
    radius: Floats
    """(m,) Radius within which exactly one solution lies, as in `PeriodicOrbit`."""
    excess: Floats
    """(m,) Largest excess over a stop, in units of `OrbitProblem.length`; minus infinity without a maximum."""
    excess_phase: Floats
    """(m,) Phase of this maximum, radians; NaN without one."""
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
    contact: ContactScratch
    """For the search for contacts."""
    matrix: Floats
    """(2 N, 2 N) The Floquet matrix."""


def orbit_results(orbits: int, impacts: int, blocks: int) -> OrbitResults:
    """Return arrays for the results of `orbits` orbits of `impacts` impacts, not yet computed."""
    return OrbitResults(
        status=np.zeros(orbits, dtype=np.int64),
        steps=np.zeros(orbits, dtype=np.int64),
        contact_status=np.zeros(orbits, dtype=np.int64),
        excess_stop=np.zeros(orbits, dtype=np.int64),
        residual=np.full(orbits, np.nan),
        kantorovich=np.full(orbits, np.nan),
        radius=np.full(orbits, np.nan),
        excess=np.full(orbits, np.nan),
        excess_phase=np.full(orbits, np.nan),
        real=np.full((orbits, 2 * blocks), np.nan),
        imaginary=np.full((orbits, 2 * blocks), np.nan),
        before=np.full((orbits, impacts, 3), np.nan),
    )


def orbit_scratch(impacts: int, blocks: int) -> OrbitScratch:
    """Return scratch for orbits of `impacts` impacts."""
    return OrbitScratch(
        newton=newton_scratch(impacts),
        contact=contact_scratch(impacts, blocks),
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
    impacts : OrbitImpacts
        `sides` (k,) are the stops of the impacts of every orbit. `phases` and `speeds`, (m, k) each, are guesses and
        become the solutions. `stops` are those of all orbits but for their gaps.
    gaps : (m, 2)
        Gap of the right and of the left stop of each orbit.
    floor : float
        As in `admissibility.further_contact_from`.
    results : OrbitResults
        As `orbit_results` returns them. Only status, steps, residual and contact_status are written for an orbit that
        does not converge.
    """
    problem, results, scratch = reference(problem), reference(results), reference(scratch)
    newton = scratch.newton
    stops, sides, phases, speeds = impacts.stops, impacts.sides, impacts.phases, impacts.speeds
    for i in range(gaps.shape[0]):
        orbit_stops = Stops(
            gaps[i, 0],
            gaps[i, 1],
            stops.restitution_right,
            stops.restitution_left,
            stops.unit,
            stops.chatter_impacts,
            stops.settling_chatter,
            stops.symmetric,
        )
        orbit = reference(OrbitImpacts(orbit_stops, sides, phases[i], speeds[i]))
        status, steps, residual, terms = solve_orbit(problem, orbit, newton)
        results.status[i], results.steps[i], results.residual[i] = status, steps, residual
        results.contact_status[i] = GIVEN_UP
        if status != CONVERGED:
            continue
        results.kantorovich[i], results.radius[i] = newton_kantorovich(problem, orbit, terms, newton)
        contact_status, excess, excess_phase, excess_stop = further_contact(problem, orbit, floor, scratch.contact)
        results.contact_status[i], results.excess_stop[i] = contact_status, excess_stop
        results.excess[i], results.excess_phase[i] = excess, excess_phase
        orbit_multipliers(problem, orbit, newton.before, scratch.matrix, results.real[i], results.imaginary[i])
        copy_matrix(results.before[i], newton.before)
