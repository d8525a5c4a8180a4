"""Many periodic orbits at once: one frequency and sequence of stops, each orbit with its own gaps and guess.

Impacts, multipliers and contacts are computed by compiled code for all orbits together.
`grazemap_core.orbits.periodic_orbits` computes more of a single orbit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, MEETS, NO_FURTHER_CONTACT, TOUCHES
from grazemap_core.orbits.kernels.batches import OrbitResults, orbit_results, orbit_scratch, solve_orbits
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED, NOT_CONVERGED, OUT_OF_ORDER, SINGULAR

ORBIT_REASONS = {
    CONVERGED: "",
    NOT_CONVERGED: "Newton's method does not converge from this guess. "
    "Remedy: a guess with phases and velocities, as from a trajectory near the motion.",
    OUT_OF_ORDER: "the order of the impacts would have to change: there is no orbit of this sequence near the guess. "
    "Remedy: another sequence of stops, or none, to solve for the motion that a trajectory settles to.",
    SINGULAR: "the equations are singular at the guess, as at a saddle-node or a resonant graze. "
    "Remedy: another frequency or clearance.",
}
"""Why an orbit is not found, and what to do, by status."""

CONTACTS = {NO_FURTHER_CONTACT: "none", MEETS: "some", TOUCHES: "undecided", GIVEN_UP: "not searched"}
"""Contacts of an orbit with a stop other than its impacts, by the code of `admissibility`."""


def solve_sequences(
    problem: OrbitProblem,
    sequence: ImpactSequence,
    stops: Sequence[Stops],
    phases: Floats,
    velocities: Floats,
    floor: float = -math.inf,
) -> tuple[Floats, Floats, OrbitResults]:
    """Return phases and speeds, (m, k) each, and all other results for orbits of one sequence, each from its guess.

    Speeds are in units of the problem's omega times length. Of `sequence` only the stops of the impacts are used. The
    guesses are `phases` and `velocities`, (m, k) each. `stops` are the stops of each orbit, of one at least, all with
    the same restitutions; `floor` is that of `admissibility.further_contact`.
    """
    count, blocks = len(sequence.stops), len(problem.decay)
    results, scratch = orbit_results(len(stops), count, blocks), orbit_scratch(count, blocks)
    phases = np.array(phases)
    speeds = velocities / (problem.omega * problem.length)
    gaps = np.array([[pair.right, pair.left] for pair in stops])
    impacts = OrbitImpacts(stops[0], sequence.stops.astype(np.float64), phases, speeds)
    # writes the solutions into phases and speeds
    solve_orbits(problem, impacts, gaps, floor, results, scratch)
    return phases, speeds, results
