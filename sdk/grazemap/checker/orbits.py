"""Periodic orbits: existence, uniqueness, admissibility, least period and multipliers."""

from __future__ import annotations

from typing import Any

from flint import acb, arb, arb_mat

from grazemap.checker.arithmetic import column, eigenvalues, exact, identity, rational, require
from grazemap.checker.equations import Equations, Solution, newton
from grazemap.checker.system import System

SIDES = ("gaps", "restitutions")
"""What has a value for each stop."""


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
    same = all(None not in theorem[name] and len(set(map(rational, theorem[name]))) == 1 for name in SIDES)
    require(same or not symmetric, "a symmetric orbit needs two equal gaps and two equal restitutions")
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
    for i, stop in enumerate(orbit.stops):
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
