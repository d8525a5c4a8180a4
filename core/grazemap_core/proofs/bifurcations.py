"""Theorems on bifurcations: saddle-nodes, period doublings, symmetry breakings and grazes over one parameter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from flint import ctx

from grazemap.checker.orbits import BoundaryProblem
from grazemap_core.arrays import Floats
from grazemap_core.continuation.branch_switching import as_on_curve
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.proofs.certificates import Document, Search, Undecided, core_clearance, inputs, text
from grazemap_core.proofs.orbits import are_symmetric, halved, refined, sequence_theorem, starting_sequence


def prove_bifurcation(search: Search, statement: Document) -> Document:
    """Return the theorem on the bifurcation nearest to an orbit, along its branch over the parameter."""
    return bifurcation_theorem(search, statement, nearest_point(search, statement))


def nearest_point(search: Search, statement: Document) -> SpecialPoint:
    """Return the bifurcation of the stated type that lies nearest to the given orbit, in double precision."""
    omega, clearance, parameter = statement["omega"], statement["clearance"], statement["parameter"]
    impacts = starting_sequence(search, omega, clearance, statement["period"], statement["stops"], statement)
    place = float(omega), core_clearance(clearance)
    orbit = periodic_orbit(search.oscillator, *place, impacts)
    start, stop = (float(bound) for bound in statement["range"])
    branch = orbit_branch(search.oscillator, orbit, start, stop, parameter)
    of_type = [point for point in branch.special_points if point.type == statement["type"]]
    points = [point for point in of_type if point.admissible]
    if not points:
        which = "no admissible" if of_type else "no"
        raise Undecided(f"{which} {statement['type']} was found on the branch of the orbit between {start} and {stop}")
    here = ParameterPoint.of(search.oscillator, *place).value(parameter)
    return min(points, key=lambda point: abs(point.values.value(parameter) - here))


def bifurcation_theorem(search: Search, statement: Document, point: SpecialPoint) -> Document:
    """Return the theorem on a special point that is known in double precision."""
    given = inputs(search, statement["omega"], statement["clearance"])
    given |= {
        "kind": "bifurcation",
        "type": point.type,
        "parameter": statement["parameter"],
        "range": statement["range"],
    }
    given["value"] = text(point.values.value(statement["parameter"]))
    impacts, graze = as_on_curve(point)
    symmetric = are_symmetric(search, statement["clearance"])
    if graze is not None and len(impacts.stops) == 1 and symmetric:  # of the steady motion, which grazes both stops
        impacts = replace(impacts, period=1, symmetric=True)
    if point.type == "SB" and not impacts.symmetric:  # at the end of a branch of asymmetric orbits
        impacts = halved(search, statement["clearance"], impacts)
    with ctx.workprec(search.bits):
        theorem = sequence_theorem(search, given, point.omega, impacts, graze)
        if graze is None:
            theorem["direction"] = [repr(x) for x in _perturbation(search, theorem).tolist()]
        return refined(search, theorem)


def _perturbation(search: Search, theorem: Document) -> Floats:
    """Return the perturbation that returns times the critical multiplier, to double precision."""
    problem = BoundaryProblem(search.data, theorem)
    rows = problem.run(problem.centre, checked=False).derivative.tolist()
    critical = problem.critical * np.eye(len(rows))
    vector: Floats = np.linalg.svd(np.array([[float(x) for x in row] for row in rows]) - critical)[2][-1]
    return vector
