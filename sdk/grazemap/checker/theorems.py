"""The theorems, and what is verified of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flint import acb, acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import ball, column, definite, eigenvalues, exact, identity, require
from grazemap.checker.equations import Equations, Solution, newton
from grazemap.checker.system import System


def system_of(data: dict[str, Any], theorem: dict[str, Any], parameter: str | None = None, value: Any = None) -> System:
    """Return the equations of motion of a theorem, with the value of a bifurcation's parameter."""
    gaps = [None if gap is None else exact(gap) for gap in theorem["gaps"]]
    gaps = [value, value] if parameter == "clearance" else gaps
    restitutions = [value] * 2 if parameter == "restitution" else [exact(r) for r in theorem["restitutions"]]
    return System(data, value if parameter == "omega" else exact(theorem["omega"]), gaps, restitutions)


def solution_of(system: System, theorem: dict[str, Any], unknowns: list[arb]) -> Solution:
    """Return an orbit with these times and velocities."""
    period, symmetric, stops = theorem["period"], theorem["symmetric"], theorem["stops"]
    require(type(period) is int and period >= 1, "the period is not a number of forcing periods")
    require(not (symmetric and period % 2 == 0), "a symmetric orbit has an odd period")
    require(len(stops) > 0 and all(stop in (1, -1) for stop in stops), "a stop is not 1 or -1")
    turn = arb.pi() * (period if symmetric else 2 * period) / system.omega
    count = len(stops)
    return Solution(system, -1 if symmetric else 1, turn, stops, unknowns[:count], unknowns[count : 2 * count])


def centre_of(theorem: dict[str, Any]) -> list[arb]:
    """Return the centre of the box: times, then velocities."""
    require(len(theorem["stops"]) == len(theorem["times"]) == len(theorem["velocities"]), "lists differ in length")
    return [exact(x) for x in theorem["times"] + theorem["velocities"]]


def states_of(equations: Equations) -> list[arb_mat]:
    """Return the states just before the impacts."""
    system, force = equations.orbit.system, equations.force.entries()
    responses, found = equations.responses(equations.orbit.sign), []
    for i, time in enumerate(equations.orbit.times):
        turning = acb(0, system.omega * time).exp()
        steady = system.response[0] * turning
        places = [x.imag for x in steady.entries()]
        rates = [(x * acb(0, system.omega)).imag / system.scale for x in steady.entries()]
        kicks = sum((responses[i][j] * force[j] for j in range(equations.count)), arb_mat(2 * system.size, 1))
        found.append(system.with_phase(column(places + rates) - kicks, time))
    return found


def follow(orbit: Solution, states: list[arb_mat], graze: int | None = None) -> arb_mat:
    """Show that an orbit has its impacts and no other contact; return the monodromy matrix (none with a graze)."""
    system, count = orbit.system, len(orbit.stops)
    whole = identity(2 * system.size)
    for i, stop in enumerate(orbit.stops):
        require(i == graze or stop * orbit.velocities[i] > 0, f"impact {i + 1} moves away from its stop")
        last = i == count - 1
        end = orbit.times[0] + orbit.turn if last else orbit.times[i + 1]
        following = orbit.sign * orbit.stops[0] if last else orbit.stops[i + 1]
        after, saltation = states[i], whole
        if i != graze:
            after, saltation = system.strike(states[i], stop)
        length = end - orbit.times[i]
        system.fly(after, length, stop, following, f"the flight after impact {i + 1}")
        if graze is None:
            whole = system.flow(length, free=True) * saltation * whole
    return whole * orbit.sign


def least(orbit: Solution, period: int) -> None:
    """Show that the impacts do not repeat after a divisor of the period."""
    halves = range(2 if orbit.sign < 0 else 1)
    times = [t + h * orbit.turn for h in halves for t in orbit.times]
    stops = [s * orbit.sign**h for h in halves for s in orbit.stops]
    count, forcing = len(times), 2 * arb.pi() / orbit.system.omega
    for parts in (p for p in range(2, period + 1) if period % p == 0):
        if count % parts == 0:
            ahead = [(i + count // parts, i) for i in range(count - count // parts)]
            late = [times[i] - times[j] - forcing * (period // parts) for i, j in ahead]
            differ = any(stops[i] != stops[j] for i, j in ahead) or any(t > 0 or t < 0 for t in late)
            require(differ, f"the impacts may repeat after {period // parts} periods")


def motion(orbit: Solution, theorem: dict[str, Any]) -> dict[str, Any]:
    """Return what identifies a motion: period, stops of a period, and the impacts."""
    stops = orbit.stops + ([-stop for stop in orbit.stops] if orbit.sign < 0 else [])
    said = {"period": theorem["period"], "symmetric": theorem["symmetric"], "stops": stops}
    said |= {"impacts_right": stops.count(1), "impacts_left": stops.count(-1)}
    shown = {"times": [str(t) for t in orbit.times], "velocities": [str(v) for v in orbit.velocities]}
    return said | shown


def admissible_orbit(data: dict[str, Any], theorem: dict[str, Any]) -> tuple[Solution, list[arb_mat], arb_mat]:
    """Show that an orbit exists, is unique in its box and admissible; return it, its states and its monodromy."""
    system = system_of(data, theorem)

    def equations(unknowns: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        here = Equations(solution_of(system, theorem, unknowns))
        return here.residual(), here.jacobian(here.values).tolist()

    orbit = solution_of(system, theorem, newton(centre_of(theorem), exact(theorem["radius"]), equations))
    states = states_of(Equations(orbit))
    matrix = follow(orbit, states)
    least(orbit, theorem["period"])
    return orbit, states, matrix


def prove_orbit(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that an orbit exists, is unique in a box, is admissible, and so many of its multipliers are unstable."""
    orbit, _, matrix = admissible_orbit(data, theorem)
    found = eigenvalues(matrix)
    outside = sum(abs(m) > 1 for m in found)
    require(
        outside + sum(abs(m) < 1 for m in found) == len(found), "a multiplier is not shown to be off the unit circle"
    )
    require(outside == theorem["unstable"], f"{outside} multipliers lie outside the unit circle")
    return motion(orbit, theorem) | {"stable": outside == 0, "multipliers": [str(m) for m in found]}


def pass_impact(system: System, state: arb_mat, start: arb, time: arb, radius: arb, stop: int, name: str) -> Any:
    """Return time, state after and saltation of the next impact, of all motions through a set; none comes before."""
    taken, reached = system.impact(state, time - start, radius, stop, name)
    system.fly(state, taken, 0, stop, f"the flight to {name}")
    return start + taken, *system.strike(reached, stop), taken


def contracts(orbit: Solution, states: list[arb_mat], matrix: arb_mat, section: arb, size: arb) -> tuple[Any, arb_mat]:
    """Show that a ball around an orbit is mapped into itself, contracting; return its norm and its centre."""
    system, n = orbit.system, 2 * orbit.system.size
    start = system.flow(section - orbit.times[0]) * states[0]
    base = system.flow(section - orbit.times[0], free=True)
    power = (base * matrix * base.inv()).mid()
    norm = identity(n)
    for _ in range(60):
        norm = (norm + power.transpose() * norm * power).mid()
        power = (power * power).mid()
    norm = ((norm + norm.transpose()) * arb(0.5)).mid()
    require(definite(norm), "the norm of the ball is not shown to be positive definite")
    inverse = norm.inv()
    box = column([ball(arb(0), (size * inverse[i, i].sqrt()).upper()) for i in range(n)])
    total, now = identity(n), section
    for i, stop in enumerate(orbit.stops):
        last = i == len(orbit.stops) - 1
        mean = start if i == 0 else system.flow(now - orbit.times[i]) * states[i]
        state = mean + column([*(total * box).entries(), 0, 0])
        name = f"impact {i + 1} of the ball"
        reach = arb(0)
        for x in (system.row * system.flow(orbit.times[i] - now) * state).entries():
            reach = 3 * x.rad() / abs(orbit.velocities[i]).lower()
        hit, after, saltation, taken = pass_impact(system, state, now, orbit.times[i].mid(), reach.upper(), stop, name)
        following = section + orbit.turn if last else ((orbit.times[i] + orbit.times[i + 1]) / 2).mid()
        system.fly(after, following - hit, stop, 0, f"the flight after {name}")
        total = system.flow(following - hit, free=True) * saltation * system.flow(taken, free=True) * total
        now = following
    require(definite(norm - total.transpose() * norm * total), "the return map is not shown to contract on the ball")
    return norm, start


def prove_attraction(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that the trajectory from an exact initial state is attracted by an orbit."""
    orbit, states, matrix = admissible_orbit(data, theorem)
    system, section, size = orbit.system, exact(theorem["section"]), exact(theorem["size"])
    require(orbit.times[-1] - orbit.turn < section and section < orbit.times[0], "the section is not before impact 1")
    norm, centre = contracts(orbit, states, matrix, section, size)
    places, rates = ([exact(x) for x in theorem[name]] for name in ("displacement", "velocity"))
    time = exact(theorem["phase"]) / system.omega
    state = system.with_phase(column(places + [v / system.scale for v in rates]), time)
    q = (system.row * state)[0, 0]
    inside = all(gap is None or stop * q < gap for stop, gap in system.gaps.items())
    require(inside, "the initial state is not shown to lie between the stops")
    left, transient = 0, theorem["transient"]
    radius, turns = exact(transient["radius"]), transient["turns"]
    require(type(turns) is int, "the number of returns is not an integer")
    for i, (stop, when) in enumerate(zip(transient["stops"], transient["times"], strict=True)):
        name = f"transient impact {i + 1}"
        taken, reached = system.impact(state, exact(when) - time, radius, stop, name)
        system.fly(state, taken, left, stop, f"the flight to {name}")
        time, left = time + taken, stop
        state, _ = system.strike(reached, stop)
    arrival = section + orbit.turn * turns
    system.fly(state, arrival - time, left, 0, "the flight to the section")
    distance = system.flow(arrival - time) * state * orbit.sign**turns - centre
    away = column(distance.entries()[: 2 * system.size])
    require((away.transpose() * norm * away)[0, 0] < size**2, "the trajectory is not shown to enter the ball")
    return motion(orbit, theorem) | {"stable": True}


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


THEOREMS: dict[str, Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}
