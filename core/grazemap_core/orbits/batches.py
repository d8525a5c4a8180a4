"""Many periodic orbits at once: one frequency and sequence of stops, each orbit with its own clearance and guess.

Impacts, multipliers and contacts are computed by compiled code for all orbits together.
`grazemap_core.orbits.periodic_orbits` computes more of a single orbit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Booleans, Complexes, Floats, Integers
from grazemap_core.errors import ParameterError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import CLEAR, GIVEN_UP, MEETS, TOUCHES
from grazemap_core.orbits.kernels.batches import OrbitResults, orbit_results, orbit_scratch, solve_orbits
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED, NOT_CONVERGED, OUT_OF_ORDER, SINGULAR
from grazemap_core.orbits.tolerances import MAX_KANTOROVICH, ORBIT_FLOOR
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

REASONS = {
    CONVERGED: "",
    NOT_CONVERGED: "Newton's method does not converge from this guess",
    OUT_OF_ORDER: "the order of the impacts would have to change: there is no orbit of this sequence near the guess",
    SINGULAR: "the equations are singular at the guess, as at a saddle-node or a resonant graze",
}
"""Why an orbit is not found, by status."""

CONTACTS = {CLEAR: "none", MEETS: "some", TOUCHES: "undecided", GIVEN_UP: "not searched"}
"""Contacts of an orbit with a stop other than its impacts, by the code of `admissibility`."""


@dataclass(frozen=True, eq=False)
class PeriodicOrbits:
    """m orbits of one sequence of stops at one frequency; fields as in `periodic_orbits.PeriodicOrbit`.

    Attributes
    ----------
    clearance : (m,)
    phases, velocities : (m, k)
    converged, isolated, admissible, stable, verified : bool (m,)
    status : int (m,)
        A key of `REASONS`.
    contacts : int (m,)
        A key of `CONTACTS`.
    residual, kantorovich, radius : (m,)
    multipliers : complex (m, 2N)
        By decreasing modulus; those below about 1e-15 of the largest are round-off. Those of symmetric motions are over
        half the period, followed by the mirror image.
    """

    clearance: Floats
    phases: Floats
    velocities: Floats
    converged: Booleans
    isolated: Booleans
    admissible: Booleans
    stable: Booleans
    verified: Booleans
    status: Integers
    contacts: Integers
    residual: Floats
    kantorovich: Floats
    radius: Floats
    multipliers: Complexes


def periodic_orbits(
    oscillator: Oscillator,
    omega: float,
    clearance: ArrayLike,
    guess: ImpactSequence,
    phases: ArrayLike | None = None,
    velocities: ArrayLike | None = None,
) -> PeriodicOrbits:
    """Return many orbits of one sequence of stops, each from its own guess.

    Parameters
    ----------
    oscillator, omega
        As for `periodic_orbits.periodic_orbit`.
    clearance : (m,)
    guess : ImpactSequence
        Stops and period of all orbits; phases and velocities where these are not given.
    phases, velocities : (m, k)
        Guesses, one row for every clearance.

    Raises
    ------
    ParameterError
        As `periodic_orbits.periodic_orbit`, or an array does not have one row per clearance.
    """
    gaps = np.ascontiguousarray(clearance, dtype=np.float64)
    if gaps.ndim != 1 or gaps.size == 0:
        raise ParameterError("clearance", "must be a list of at least one number")
    for gap in (np.min(gaps), np.max(gaps)):
        check_parameters(omega, float(gap))
    rows = []
    for name, values, own in (("phases", phases, guess.phases), ("velocities", velocities, guess.velocities)):
        array = np.tile(own, (gaps.size, 1)) if values is None else np.array(values, dtype=np.float64)
        if array.shape != (gaps.size, len(guess.stops)) or not np.all(np.isfinite(array)):
            raise ParameterError(name, "must have a row of finite numbers for every clearance, one per stop")
        rows.append(array)
    family = OrbitFamily.of(oscillator, guess.period, guess.symmetric)
    steady = family.steady(omega)
    problem = family.problem(omega, max(abs(steady[0]), float(np.max(gaps))), steady)
    found, speeds, results = solve_sequences(problem, guess, gaps, rows[0], rows[1], floor=-ORBIT_FLOOR)
    multipliers = results.real + 1j * results.imaginary
    order = np.argsort(-np.abs(multipliers), axis=1, kind="stable")
    multipliers = np.take_along_axis(multipliers, order, axis=1)
    converged = results.status == CONVERGED
    isolated = converged & (results.kantorovich <= MAX_KANTOROVICH)
    admissible = results.contact == CLEAR
    stable = np.all(np.abs(multipliers) < 1.0, axis=1)
    impact_velocities = speeds * (problem.omega * problem.length)
    verified = isolated & admissible & stable
    for i in np.flatnonzero(verified):
        orbit = ImpactSequence(guess.period, guess.stops, found[i], impact_velocities[i], guess.symmetric)
        verified[i] = orbit.repeats_after() == guess.period
    return PeriodicOrbits(
        clearance=gaps,
        phases=found,
        velocities=impact_velocities,
        converged=converged,
        isolated=isolated,
        admissible=admissible,
        stable=stable,
        verified=verified,
        status=results.status,
        contacts=results.contact,
        residual=results.residual,
        kantorovich=results.kantorovich,
        radius=results.radius,
        multipliers=multipliers,
    )


def solve_sequences(
    problem: OrbitProblem,
    guess: ImpactSequence,
    clearances: Floats,
    phases: Floats,
    velocities: Floats,
    floor: float = -math.inf,
) -> tuple[Floats, Floats, OrbitResults]:
    """Return phases and speeds, (m, k) each, and all other results for orbits of one sequence, each from its guess.

    Speeds are in the problem's units; `floor` is that of `admissibility.further_contact`.
    """
    count, blocks = len(guess.stops), len(problem.decay)
    results, scratch = orbit_results(len(clearances), count, blocks), orbit_scratch(count, blocks)
    phases = np.array(phases)
    speeds = velocities / (problem.omega * problem.length)
    solve_orbits(problem, guess.stops.astype(np.float64), clearances, phases, speeds, floor, results, scratch)
    return phases, speeds, results


def check_parameters(omega: float, clearance: float) -> None:
    """Raise ParameterError where a frequency or a clearance is out of range."""
    for name, value in (("omega", omega), ("clearance", clearance)):
        if not SMALLEST_NUMBER <= value <= LARGEST_NUMBER:
            raise ParameterError(name, f"must lie between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g}")
