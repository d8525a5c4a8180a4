"""Theorems on bifurcations: saddle-nodes, period doublings, symmetry breakings and grazes over one parameter."""

from __future__ import annotations

import numpy as np
from flint import arb, ctx

from grazemap.checker.bifurcations import bifurcation_system, critical
from grazemap_core.arrays import Floats
from grazemap_core.continuation.branch_switching import as_on_curve
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.proofs.certificates import Document, Search, Undecided, decimals, text
from grazemap_core.proofs.orbits import radius_of, sequence_theorem, starting_sequence
from grazemap_core.proofs.refinement import refine


def prove_bifurcation(search: Search, statement: Document) -> Document:
    """Return the theorem on the bifurcation nearest to an orbit, along its branch over the parameter."""
    return bifurcation_theorem(search, statement, nearest_point(search, statement))


def nearest_point(search: Search, statement: Document) -> SpecialPoint:
    """Return the bifurcation of the stated type that lies nearest to the given orbit, in double precision."""
    omega, clearance, parameter = statement["omega"], statement["clearance"], statement["parameter"]
    impacts = starting_sequence(search, omega, clearance, statement["period"], statement["stops"], statement)
    orbit = periodic_orbit(search.oscillator, float(omega), float(clearance), impacts)
    start, stop = (float(bound) for bound in statement["range"])
    branch = orbit_branch(search.oscillator, orbit, start, stop, parameter)
    of_type = [point for point in branch.special_points if point.type == statement["type"]]
    points = [point for point in of_type if point.admissible]
    if not points:
        which = "no admissible" if of_type else "no"
        raise Undecided(f"{which} {statement['type']} was found on the branch of the orbit between {start} and {stop}")
    here = {"omega": float(omega), "clearance": float(clearance), "restitution": search.oscillator.restitution}
    return min(points, key=lambda point: abs(getattr(point, parameter) - here[parameter]))


def bifurcation_theorem(search: Search, statement: Document, point: SpecialPoint) -> Document:
    """Return the theorem on a special point that is known in double precision."""
    parameter = statement["parameter"]
    impacts, graze = as_on_curve(point)
    theorem = sequence_theorem(search, statement["omega"], statement["clearance"], impacts)
    theorem["times"] = [repr(t) for t in (impacts.phases / point.omega).tolist()]
    theorem |= {"type": point.type, "parameter": parameter, "range": statement["range"]}
    theorem["value"] = text(float(getattr(point, parameter)))
    if graze is not None:
        theorem["graze"] = graze
        theorem["velocities"][graze] = "0"
    with ctx.workprec(search.bits):
        theorem["direction"] = [] if graze is not None else [repr(x) for x in _perturbation(search, theorem).tolist()]
        centre, _, equations = bifurcation_system(search.data, theorem)
        found = refine(search, centre, equations)
    numbers, count = decimals(found, search.digits + 6), len(theorem["stops"])
    if graze is not None:
        numbers.insert(count + graze, "0")
    times, velocities, direction = numbers[:count], numbers[count : 2 * count], numbers[2 * count + 1 :]
    solved = {"times": times, "velocities": velocities, "value": numbers[2 * count], "direction": direction}
    return theorem | solved | {"radius": radius_of(search, found)}


def _perturbation(search: Search, theorem: Document) -> Floats:
    """Return the perturbation that returns times the critical multiplier, to double precision."""
    centre, at, _ = bifurcation_system(search.data, theorem | {"direction": ["1"] * (2 * len(theorem["stops"]))})
    here = at([arb(x) for x in centre])
    matrix = here.jacobian(here.observed(here.orbit.sign * critical(theorem)))
    rows = np.array([[float(x) for x in row] for row in matrix.tolist()])
    vector: Floats = np.linalg.svd(rows)[2][-1]
    return vector
