"""Theorems on bifurcations over one parameter, and on codimension-two points of the grazing curve.

Bifurcations are saddle-nodes, period doublings, symmetry breakings and grazes. Codimension-two points are simple zeros
of the impulse response and of its sums.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from flint import arb

from grazemap.checker.arithmetic import exact
from grazemap.checker.orbits import BoundaryProblem
from grazemap.checker.reading import RADIUS
from grazemap.checker.system import Inputs
from grazemap.checker.theorems import impulse
from grazemap_core.arrays import Floats
from grazemap_core.continuation.branch_switching import as_on_curve, merged
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.proofs.certificates import (
    Attempt,
    Document,
    ProofSearch,
    Undecided,
    core_clearance,
    decimals,
    exact_inputs,
    inputs,
    refine,
    text,
)
from grazemap_core.proofs.orbits import as_admitted, refined, sequence_theorem, starting_sequence
from grazemap_core.proofs.tolerances import DOUBLE_DIGITS, MORE_DIGITS, SIGN_SAMPLES


def prove_bifurcation(search: ProofSearch, request: Document) -> Iterator[Attempt]:
    """Yield the theorem on the bifurcation nearest to an orbit, along its branch over the parameter.

    The statement names the orbit at the bifurcation by its contacts, not the branch.
    """
    yield bifurcation(search, request, nearest_point(search, request))


def nearest_point(search: ProofSearch, request: Document) -> SpecialPoint:
    """Return the bifurcation of the requested type that lies nearest to the given orbit, in double precision."""
    parameter, place = request["parameter"], (float(request["omega"]), core_clearance(request["clearance"]))
    orbit = periodic_orbit(search.oscillator, *place, starting_sequence(search, request))
    start, stop = (float(bound) for bound in request["range"])
    branch = orbit_branch(search.oscillator, orbit, start, stop, parameter)
    of_type = [point for point in branch.special_points if point.type == request["type"]]
    points = [point for point in of_type if point.admissible]
    if not points:
        which = "no admissible" if of_type else "no"
        raise Undecided(f"{which} {request['type']} was found on the branch of the orbit between {start} and {stop}")
    here = ParameterPoint.of(search.oscillator, *place).value(parameter)
    return min(points, key=lambda point: abs(point.values.value(parameter) - here))


def bifurcation(search: ProofSearch, request: Document, point: SpecialPoint) -> Attempt:
    """Return the statement and the theorem on a special point that is known in double precision."""
    kind, parameter = request["type"], request["parameter"]
    statement = inputs(search, request) | {"type": kind, "parameter": parameter, "range": request["range"]}
    numbers = exact_inputs(statement)
    impacts, graze = as_on_curve(point)
    if graze is not None and len(impacts.stops) == 1:  # of the steady motion, which grazes both stops or one
        symmetric = as_admitted(search, numbers, replace(impacts, symmetric=True)).symmetric
        impacts = replace(impacts, period=1, symmetric=symmetric)
    if kind == "PD":  # at the end of a branch of orbits of twice the period
        impacts = merged(impacts, mirrored=False) or impacts
    if kind == "SB" and not impacts.symmetric:  # at the end of a branch of asymmetric orbits
        impacts = impacts.half()
    impacts = as_admitted(search, numbers, impacts)
    theorem = sequence_theorem(
        search, numbers, point.omega, impacts, value=text(point.values.value(parameter)), graze=graze
    )
    if graze is None:
        theorem["direction"] = [repr(x) for x in _perturbation(search, numbers, theorem, kind).tolist()]
    theorem = refined(search, numbers, theorem, kind)
    problem = BoundaryProblem(search.machine, numbers, theorem, kind)
    run = problem.run(problem.centre, checked=False)
    stops, times, velocities = problem.contacts(run, problem.centre[-1] if graze is not None else None)
    box = {
        "phases": decimals([time * run.system.omega for time in times], search.digits),
        "velocities": decimals(velocities, search.digits),
        "radius": RADIUS,
    }
    return Attempt(statement | {"period": problem.period, "stops": stops, **box}, "proven", theorem)


def _perturbation(search: ProofSearch, numbers: Inputs, theorem: Document, kind: str) -> Floats:
    """Return the perturbation that returns times the critical multiplier, to double precision."""
    problem = BoundaryProblem(search.machine, numbers, theorem, kind)
    rows = problem.run(problem.centre, checked=False).derivative.tolist()
    critical = problem.critical * np.eye(len(rows))
    vector: Floats = np.linalg.svd(np.array([[float(x) for x in row] for row in rows]) - critical)[2][-1]
    return vector


def prove_codimension_two(search: ProofSearch, request: Document) -> Iterator[Attempt]:
    """Yield the theorem on the first zero that is found in the range of frequencies.

    Where the maxima of the steady motion are not distinguished, the second statement is on the zero alone.
    """
    statement: Document = {name: request[name] for name in ("type", "order", "range", "stop") if name in request}

    def function(unknowns: list[arb]) -> list[arb]:
        return [impulse(search.machine, request["type"], unknowns[0], request["order"])]

    low, high = (exact(bound) for bound in request["range"])
    places = [low + (high - low) * k / SIGN_SAMPLES for k in range(SIGN_SAMPLES + 1)]
    values = [function([place])[0] for place in places]
    changes = [k for k in range(SIGN_SAMPLES) if values[k] * values[k + 1] < 0]
    if not changes:
        raise Undecided(f"no change of sign was found at {SIGN_SAMPLES + 1} frequencies of the range")
    near, share = changes[0], values[changes[0]] / (values[changes[0]] - values[changes[0] + 1])
    start = decimals([places[near] + share * (high - low) / SIGN_SAMPLES], DOUBLE_DIGITS)[0]
    theorem = refine(
        search,
        {"value": start},
        lambda now: ([exact(now["value"])], function),
        lambda now, unknowns: now | {"value": decimals(unknowns, search.digits + MORE_DIGITS)[0]},
    )
    yield Attempt(statement, "proven", theorem)
    if "stop" in statement:
        del statement["stop"]
        yield Attempt(statement, "proven", theorem)
