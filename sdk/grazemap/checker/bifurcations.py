"""Bifurcations of periodic orbits, and codimension-two points of the grazing curve."""

from __future__ import annotations

from typing import Any

from flint import acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import column, eigenvalues, exact, identity, require
from grazemap.checker.equations import Equations, newton
from grazemap.checker.orbits import centre_of, follow, least, motion, solution_of, states_of, system_of


def in_range(theorem: dict[str, Any], value: arb) -> None:
    """Require that a value lies in the stated range."""
    low, high = (exact(bound) for bound in theorem["range"])
    require(low < value and value < high, "the point is not shown to lie in the stated range")


def bifurcation_system(data: dict[str, Any], theorem: dict[str, Any]) -> tuple[list[arb], Any, Any]:
    """Return the centre of the box, and functions of the unknowns: the orbit's equations, and the extended system.

    Unknowns are times, velocities (but not that of a graze), the parameter and, unless it is a graze, a perturbation w.
    The system is that of the orbit, J(mu) w = 0, and a normalization of w.
    """
    parameter, graze, count = theorem["parameter"], theorem.get("graze"), len(theorem["stops"])
    direction = [] if graze is not None else [exact(x) for x in theorem["direction"]]
    centre = [*centre_of(theorem), exact(theorem["value"]), *direction]
    if graze is not None:
        require(theorem["velocities"][graze] == "0", "the graze has a velocity")
        del centre[count + graze]

    def at(unknowns: list[arb]) -> Equations:
        full = unknowns if graze is None else [*unknowns[: count + graze], arb(0), *unknowns[count + graze :]]
        system = system_of(data, theorem, parameter, full[2 * count])
        return Equations(solution_of(system, theorem, full), parameter)

    def equations(unknowns: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        here = at(unknowns)
        twist = here.orbit.sign * critical(theorem)
        vector = unknowns[2 * count + 1 :] or [arb(0)] * (2 * count)
        by_parameter, change = here.by_parameter(twist, vector)
        rows = [[*row, by] for row, by in zip(here.jacobian(here.values).tolist(), by_parameter, strict=True)]
        if graze is not None:
            return here.residual(), [row[: count + graze] + row[count + graze + 1 :] for row in rows]
        twisted = here.observed(twist)
        matrix, by_orbit = here.jacobian(twisted), here.by_orbit(twisted, vector).tolist()
        rows = [row + [arb(0)] * (2 * count) for row in rows]
        rows += [[*row, x, *m] for row, x, m in zip(by_orbit, change, matrix.tolist(), strict=True)]
        rows.append([arb(0)] * (2 * count + 1) + direction)
        length = sum((a * (b - a) for a, b in zip(direction, vector, strict=True)), arb(0))
        return [*here.residual(), *(matrix * column(vector)).entries(), length], rows

    return centre, at, equations


def critical(theorem: dict[str, Any]) -> int:
    """Return the multiplier on the unit circle."""
    return 1 if theorem["type"] == "SN" else -1


def prove_bifurcation(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that a bifurcation of an orbit lies in an interval of a parameter, nondegenerate and transversal."""
    parameter, kind, graze, count = theorem["parameter"], theorem["type"], theorem.get("graze"), len(theorem["stops"])
    require(parameter in ("omega", "clearance", "restitution"), "there is no such parameter")
    known = kind in ("SN", "GR") or kind == ("SB" if theorem["symmetric"] else "PD")
    require(known, f"a {kind} of this orbit is not a bifurcation that can be shown")
    require((kind == "GR") == (graze in range(count)), "a graze, and only a graze, has an impact of velocity 0")
    centre, at, equations = bifurcation_system(data, theorem)
    require(kind == "GR" or any(x > 0 or x < 0 for x in centre[2 * count + 1 :]), "the direction vanishes")
    found = newton(centre, exact(theorem["radius"]), equations)
    here: Equations = at(found)
    value = found[2 * count - (graze is not None)]
    in_range(theorem, value)
    matrix = follow(here.orbit, states_of(here), graze)
    least(here.orbit, theorem["period"])
    said = motion(here.orbit, theorem) | {"value": str(value)}
    if graze is not None:
        require(here.orbit.stops[graze] * here.motion[2][graze, 0] < 0, "the graze is not shown to be quadratic")
        kept = [i for i in range(2 * count) if i % count != graze]
        rows = here.jacobian(here.values)
        minor = arb_mat([[rows[i, j] for j in kept] for i in kept]).det() if kept else arb(1)
        require(minor > 0 or minor < 0, "the orbit without the graze is not shown to be regular")
        return said | {"stops_without_graze": [stop for i, stop in enumerate(said["stops"]) if i % count != graze]}
    near = [m for m in eigenvalues(matrix) if not (abs(m) > 1 or abs(m) < 1)]
    require(len(near) == 1, f"{len(near)} multipliers may lie on the unit circle")
    return said


def impulse(data: dict[str, Any], theorem: dict[str, Any], omega: arb, order: int, twist: int) -> tuple[arb, arb]:
    """Return g at so many half periods, or its sum with factors twist^k over the multiples k, and its derivative."""
    system = system_of(data, theorem, "omega", omega)
    flow = system.flow(arb.pi() * order / omega, free=True)
    inverse = (identity(2 * system.size) - flow * twist).inv()
    state = flow * inverse * system.kick
    rows = system.rows(2)
    return (rows * state)[0, 0], (rows * (inverse * state))[1, 0]


TWISTS = {"g": 0, "h": 1, "h_s": -1}
"""By the function whose zero is a codimension-two point: g, or its sum over the multiples of the time."""


def prove_codimension_two(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that a function has one zero in an interval of omega, a simple one, and that the steady motion grazes."""
    low, high = (exact(x) for x in theorem["interval"])
    order, twist = theorem["order"], TWISTS[theorem["type"]]
    require(low < high and type(order) is int and order >= 1, "the interval is empty")
    in_range(theorem, low.union(high))
    ends = [impulse(data, theorem, omega, order, twist)[0] for omega in (low, high)]
    require(ends[0] * ends[1] < 0, "the function is not shown to change its sign over the interval")
    interval = low.union(high)
    slope = impulse(data, theorem, interval, order, twist)[1]
    require(slope > 0 or slope < 0, "the zero is not shown to be simple")
    system = system_of(data, theorem, "omega", interval)
    contact = acb_mat(arb_mat([system.row.entries()[: system.size]]))
    amplitude = abs((contact * system.response[0])[0, 0])
    require(amplitude > 0, "the steady amplitude may vanish")
    earlier = [(-1) ** m * impulse(data, theorem, interval, m, 0)[0] for m in range(1, order if twist == 0 else 1)]
    active = all(x > 0 for x in earlier)
    require(active or any(x < 0 for x in earlier), "whether an impact recurs earlier is undecided")
    return {"omega": str(interval), "clearance": str(amplitude), "active": active}
