"""Theorems on periodic orbits: existence, uniqueness in a box, admissibility and multipliers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from flint import arb

from grazemap.checker.arithmetic import Refused, exact
from grazemap.checker.orbits import BoundaryProblem
from grazemap.checker.reading import STATEMENTS
from grazemap.checker.system import Inputs, System
from grazemap.checker.theorems import motions_of_box
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import explicit_sequences, sequence_of_stops
from grazemap_core.proofs.certificates import (
    Attempt,
    Document,
    Equations,
    ProofSearch,
    Undecided,
    core_clearance,
    decimals,
    exact_inputs,
    inputs,
    refine,
)
from grazemap_core.proofs.tolerances import DOUBLE_DIGITS, MORE_DIGITS, RADIUS_DIGITS, WIDER


def starting_sequence(search: ProofSearch, request: Document) -> ImpactSequence:
    """Return the impacts from which the search starts: those given, or those of an orbit that is found."""
    period, stops = request["period"], request["stops"]
    if "phases" in request:
        guess, *speeds = ([float(x) for x in request[name]] for name in ("phases", "velocities"))
        return _converged(search, request, ImpactSequence.create(period, stops, guess, speeds[0]))
    sequence = sequence_of_stops(search.oscillator, *_place(request), period, stops)
    if sequence is None:
        raise Undecided("no orbit of these stops was found; give its phases and velocities")
    return _converged(search, request, sequence)


def _place(request: Document) -> tuple[float, Any]:
    return float(request["omega"]), core_clearance(request["clearance"])


def _converged(search: ProofSearch, request: Document, guess: ImpactSequence) -> ImpactSequence:
    """Return the impacts of the orbit near a guess, half of them where the orbit is symmetric."""
    orbit = periodic_orbit(search.oscillator, *_place(request), guess)
    if not orbit.converged:
        raise Undecided(f"no orbit was found near the given impacts: {orbit.reason}")
    return orbit.impacts.half() if orbit.symmetric else orbit.impacts


def as_admitted(search: ProofSearch, numbers: Inputs, impacts: ImpactSequence) -> ImpactSequence:
    """Return the impacts of a symmetric orbit as half of them, if the oscillator is exactly symmetric, else all."""
    try:
        numbers.require_symmetric(search.machine)
    except Refused:
        return impacts.whole
    return impacts


def sequence_theorem(
    search: ProofSearch,
    numbers: Inputs,
    omega: float,
    impacts: ImpactSequence,
    *,
    value: str | None = None,
    graze: int | None = None,
    first: int | None = None,
) -> Document:
    """Return the impacts and the state on a section, to double precision.

    The section is before the impact `first`, at a graze, which is one of the impacts, or else in the middle of the
    longest flight. `value` is that of the parameter of a bifurcation.
    """
    sign, turns = (-1, 0.5 * impacts.period) if impacts.symmetric else (1, float(impacts.period))
    turn = 2.0 * np.pi * turns / (omega * search.machine.divisor)
    stops, times, speeds = impacts.stops, impacts.phases / omega, impacts.velocities
    if graze is not None:
        first = graze
    elif first is None:
        first = int(np.argmax(np.diff(times, prepend=times[-1] - turn)))
    stops, speeds = (np.concatenate([x[first:], sign * x[:first]]) for x in (stops, speeds))
    times = np.concatenate([times[first:], times[:first] + turn])
    section = times[0] if graze is not None else 0.5 * (times[-1] - turn + times[0])
    theorem: Document = {
        "period": impacts.period,
        "symmetric": impacts.symmetric,
        "section": repr(float(section)),
        "scale": str(search.machine.scale),
    }
    if graze is not None:
        theorem["graze"], stops, times, speeds = int(stops[0]), stops[1:], times[1:], speeds[1:]
    theorem |= {"stops": stops.tolist(), "times": [repr(t) for t in times.tolist()]}
    system = System(search.machine, numbers, None if value is None else exact(value))
    contacts = [
        (stop, arb(time), arb(speed))
        for stop, time, speed in zip(stops.tolist(), times.tolist(), speeds.tolist(), strict=True)
    ]
    state = system.periodic_state(arb(theorem["section"]), arb(turns), sign, contacts)
    return theorem | {"state": decimals(state.entries(), DOUBLE_DIGITS)} | ({} if value is None else {"value": value})


def refined(search: ProofSearch, numbers: Inputs, theorem: Document, bifurcation: str | None = None) -> Document:
    """Return a theorem with the state, the impacts' times and the other unknowns in many digits."""

    def equations(now: Document) -> Equations:
        problem = BoundaryProblem(search.machine, numbers, now, bifurcation)
        return problem.centre, problem.residual

    def renewed(now: Document, unknowns: list[arb]) -> Document:
        problem = BoundaryProblem(search.machine, numbers, now, bifurcation)
        texts = decimals(unknowns, search.digits + MORE_DIGITS)
        size, others = len(problem.state), len(problem.state) + len(problem.names)
        times = problem.run(unknowns, checked=False).times
        new = {"state": texts[:size], "times": decimals(times, search.digits + MORE_DIGITS)}
        if problem.direction:
            new["direction"] = texts[others:]
        return now | dict(zip(problem.names, texts[size:], strict=False)) | new

    return refine(search, theorem, equations, renewed)


def orbit_theorem(
    search: ProofSearch, numbers: Inputs, omega: float, impacts: ImpactSequence, first: int | None = None
) -> Document:
    """Return the centre and the radius of the box of an orbit."""
    return refined(search, numbers, sequence_theorem(search, numbers, omega, impacts, first=first))


def prove_orbit(search: ProofSearch, request: Document) -> Iterator[Attempt]:
    """Yield theorems on the orbits near the given impacts, or with the given stops, and then what contradicts it."""
    names = ("period", "stops", "stable", "phases", "velocities", "radius")
    statement = inputs(search, request) | {name: request[name] for name in names if name in request}
    numbers, (omega, clearance) = exact_inputs(statement), _place(request)
    impacts = starting_sequence(search, request)
    failed: Undecided | Refused | None = None
    try:
        theorem = orbit_theorem(search, numbers, omega, as_admitted(search, numbers, impacts))
    except (Undecided, Refused) as reason:
        failed = reason
    else:
        yield Attempt(statement, "proven", theorem)
    if "phases" in statement:
        if failed is not None:
            raise failed
        theorem = _only_orbit(search, numbers, statement, impacts.whole)
        yield Attempt(statement, "disproven", theorem)
        return
    for other in explicit_sequences(search.oscillator, omega, clearance, request["period"], impacts.whole.stops):
        try:
            yield Attempt(statement, "proven", orbit_theorem(search, numbers, omega, other))
        except (Undecided, Refused):
            continue
    if failed is not None:
        raise failed


def _only_orbit(search: ProofSearch, numbers: Inputs, statement: Document, impacts: ImpactSequence) -> Document:
    """Return the theorem on an orbit in a box of states that holds all motions of a statement's box."""
    omega = float(statement["omega"])
    turn = 2.0 * np.pi / search.machine.divisor
    ahead = round((float(statement["phases"][0]) - float(impacts.phases[0])) / turn)
    impacts = replace(impacts, phases=impacts.phases + turn * ahead)
    theorem = orbit_theorem(search, numbers, omega, impacts, first=0)
    problem = BoundaryProblem(search.machine, numbers, theorem)
    _, states = motions_of_box(problem, STATEMENTS["orbit"](statement, "the statement"))
    reach = max((abs(x - middle).abs_upper() for x, middle in zip(states, problem.state, strict=True)), key=float)
    return theorem | {"radius": (WIDER * reach).str(RADIUS_DIGITS, radius=False)}
