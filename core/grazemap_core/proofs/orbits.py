"""Theorems on periodic orbits: existence, uniqueness in a box, admissibility and multipliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flint import arb, ctx

from grazemap.checker.arithmetic import Refused, eigenvalues
from grazemap.checker.equations import Equations
from grazemap.checker.orbits import admissible_orbit, solution_of, system_of
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.proofs.certificates import Document, Search, Undecided, decimals, inputs
from grazemap_core.proofs.refinement import refine


def starting_sequence(
    search: Search, omega: str, clearance: str, period: int, stops: Sequence[int], guess: Document
) -> ImpactSequence:
    """Return the impacts from which the search starts: those given, or those of an orbit that is found."""
    place = float(omega), float(clearance)
    if guess.get("phases") is not None:
        given = ImpactSequence.create(period, stops, guess["phases"], guess["velocities"])
    else:
        found = sequence_of_stops(search.oscillator, *place, period, stops)
        if found is None:
            raise Undecided("no orbit of these stops was found; give its phases and velocities")
        given = found
    orbit = periodic_orbit(search.oscillator, *place, given)
    if not orbit.converged:
        raise Undecided(f"no orbit was found near the given impacts: {orbit.reason}")
    return orbit.impacts.half() if orbit.symmetric else orbit.impacts


def radius_of(search: Search, unknowns: Sequence[arb]) -> str:
    """Return the radius of the box, relative to the largest unknown."""
    size = max(float(abs(x).abs_upper()) for x in unknowns)
    return f"1e{int(np.floor(np.log10(size))) - search.digits}"


def sequence_theorem(search: Search, omega: str, clearance: str, impacts: ImpactSequence) -> Document:
    """Return the parts of a theorem that are its inputs and impacts, these to double precision."""
    return {
        **inputs(search, omega, clearance),
        "period": impacts.period,
        "symmetric": impacts.symmetric,
        "stops": impacts.stops.tolist(),
        "times": [repr(t) for t in (impacts.phases / float(omega)).tolist()],
        "velocities": [repr(v) for v in impacts.velocities.tolist()],
    }


def orbit_theorem(search: Search, omega: str, clearance: str, impacts: ImpactSequence) -> Document:
    """Return the inputs, the centre and the radius of the box of an orbit."""
    theorem = sequence_theorem(search, omega, clearance, impacts)
    with ctx.workprec(search.bits):
        system = system_of(search.data, theorem)

        def equations(unknowns: list[arb]) -> tuple[list[arb], list[list[arb]]]:
            here = Equations(solution_of(system, theorem, unknowns))
            return here.residual(), here.jacobian(here.values).tolist()

        start = [arb(x) for x in [*theorem["times"], *theorem["velocities"]]]
        centre = refine(search, start, equations)
    count = len(theorem["stops"])
    numbers = decimals(centre, search.digits + 6)
    return theorem | {"times": numbers[:count], "velocities": numbers[count:], "radius": radius_of(search, centre)}


def prove_orbit(search: Search, statement: Document) -> Document:
    """Return the theorem on the orbit near the given impacts."""
    omega, clearance = statement["omega"], statement["clearance"]
    impacts = starting_sequence(search, omega, clearance, statement["period"], statement["stops"], statement)
    theorem = orbit_theorem(search, omega, clearance, impacts)
    try:
        with ctx.workprec(search.bits):
            matrix = admissible_orbit(search.data, theorem)[2]
            unstable = sum(abs(m) > 1 for m in eigenvalues(matrix))
    except Refused as refused:
        raise Undecided(f"the orbit that was found: {refused}") from None
    return theorem | {"unstable": unstable}
