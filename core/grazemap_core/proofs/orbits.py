"""Theorems on periodic orbits: existence, uniqueness in a box, admissibility and multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from flint import arb, ctx

from grazemap.checker.arithmetic import column, identity
from grazemap.checker.orbits import BoundaryProblem
from grazemap.checker.system import System, alike
from grazemap.checker.theorems import multipliers
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.proofs.certificates import Document, Search, Undecided, core_clearance, decimals, inputs
from grazemap_core.proofs.refinement import Equations, refine


def starting_sequence(
    search: Search, omega: str, clearance: Any, period: int, stops: Sequence[int], guess: Document
) -> ImpactSequence:
    """Return the impacts from which the search starts: those given, or those of an orbit that is found."""
    place = float(omega), core_clearance(clearance)
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
    return halved(search, clearance, orbit.impacts) if orbit.symmetric else orbit.impacts


def halved(search: Search, clearance: Any, impacts: ImpactSequence) -> ImpactSequence:
    """Return half of the impacts of a symmetric orbit, where the checker takes it as one, else all of them."""
    return impacts.half() if are_symmetric(search, clearance) else impacts.whole


def are_symmetric(search: Search, clearance: Any) -> bool:
    """Return whether the stops and the forces are symmetric to the checker, which admits no bias."""
    given = inputs(search, "1", clearance)
    return alike(search.data) and all(one == other for one, other in (given["gaps"], given["restitutions"]))


def sequence_theorem(
    search: Search, given: Document, omega: float, impacts: ImpactSequence, graze: int | None = None
) -> Document:
    """Return the inputs given, the impacts and the state on a section, to double precision.

    The section is in the middle of the longest flight, or at a graze, which is one of the impacts.
    """
    sign, turn = (-1, np.pi / omega) if impacts.symmetric else (1, 2.0 * np.pi / omega)
    turn *= impacts.period
    stops, times, speeds = impacts.stops, impacts.phases / omega, impacts.velocities
    first = int(np.argmax(np.diff(times, prepend=times[-1] - turn))) if graze is None else graze
    stops, speeds = (np.concatenate([x[first:], sign * x[:first]]) for x in (stops, speeds))
    times = np.concatenate([times[first:], times[:first] + turn])
    theorem = given | {"period": impacts.period, "symmetric": impacts.symmetric}
    theorem["section"] = repr(float(0.5 * (times[-1] - turn + times[0]) if graze is None else times[0]))
    if graze is not None:
        theorem["graze"], stops, times, speeds = int(stops[0]), stops[1:], times[1:], speeds[1:]
    theorem |= {"stops": stops.tolist(), "times": [repr(t) for t in times.tolist()]}
    system = System(
        search.data, theorem, theorem.get("parameter"), arb(theorem["value"]) if "value" in theorem else None
    )
    now, state = arb(theorem["section"]), system.with_phase([0] * system.size, arb(theorem["section"]))
    for stop, time, speed in zip(stops.tolist(), times.tolist(), speeds.tolist(), strict=True):
        state, now = system.flow(time - now) * state - system.kick * (system.rebound[stop] * speed), arb(time)
    state = system.flow(arb(theorem["section"]) + turn - now) * state
    around = identity(system.size) - system.free(system.flow(turn)) * sign
    fixed = around.solve(column(state.entries()[: system.size]) * sign)
    return theorem | {"state": decimals(fixed.entries(), 20)}


def refined(search: Search, theorem: Document) -> Document:
    """Return a theorem with the state, the impacts' times and the other unknowns in many digits."""

    def equations(now: Document) -> Equations:
        problem = BoundaryProblem(search.data, now)
        return problem.centre, problem.residual

    def renewed(now: Document, unknowns: list[arb]) -> Document:
        problem, numbers = BoundaryProblem(search.data, now), decimals(unknowns, search.digits + 6)
        size, others = len(problem.state), len(problem.state) + len(problem.names)
        times = problem.run(unknowns, checked=False).times
        found = {"state": numbers[:size], "times": decimals(times, search.digits + 6), "direction": numbers[others:]}
        return now | dict(zip(problem.names, numbers[size:], strict=False)) | found

    return refine(search, theorem, equations, renewed)


def orbit_theorem(search: Search, omega: str, clearance: Any, impacts: ImpactSequence) -> Document:
    """Return the inputs, the centre and the radius of the box of an orbit."""
    with ctx.workprec(search.bits):
        return refined(search, sequence_theorem(search, inputs(search, omega, clearance), float(omega), impacts))


def prove_orbit(search: Search, statement: Document) -> Document:
    """Return the theorem on the orbit near the given impacts."""
    omega, clearance = statement["omega"], statement["clearance"]
    impacts = starting_sequence(search, omega, clearance, statement["period"], statement["stops"], statement)
    theorem = orbit_theorem(search, omega, clearance, impacts)
    with ctx.workprec(search.bits):
        problem = BoundaryProblem(search.data, theorem)
        found = multipliers(problem.run(problem.centre, checked=False), problem.sign)
    return theorem | {"unstable": sum(abs(m) > 1 for m in found)}
