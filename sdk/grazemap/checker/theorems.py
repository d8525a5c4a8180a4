"""What each kind of theorem requires of its orbit or point."""

from __future__ import annotations

from typing import Any

from flint import acb, acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import Refused, ball, column, definite, exact, identity, newton, require
from grazemap.checker.orbits import BoundaryProblem, Run, carry
from grazemap.checker.system import PARAMETERS, System, alike


def multipliers(run: Run, sign: int) -> list[acb]:
    """Return enclosures of the eigenvalues of the return map's derivative, with repetition."""
    try:
        return list(acb_mat(run.derivative * sign).eig(multiple=True))
    except ValueError:
        raise Refused("the eigenvalues are not enclosed at this precision") from None


def in_range(theorem: dict[str, Any], value: arb) -> None:
    """Require that a value lies in the stated range."""
    low, high = (exact(bound) for bound in theorem["range"])
    require(low < value and value < high, "the point is not shown to lie in the stated range")


def solved(data: dict[str, Any], theorem: dict[str, Any]) -> tuple[BoundaryProblem, list[arb], Run]:
    """Show that a solution exists, unique in its box, admissible, of this least period; return it and its run."""
    problem = BoundaryProblem(data, theorem)
    found = newton(problem.residual, problem.centre, exact(theorem["radius"]))
    run = problem.run(found)
    problem.require_least_period(run)
    return problem, found, run


def prove_orbit(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that an orbit exists, is unique in a box, is admissible, and so many of its multipliers are unstable."""
    problem, _, run = solved(data, theorem)
    found = multipliers(run, problem.sign)
    outside = sum(abs(m) > 1 for m in found)
    off = outside + sum(abs(m) < 1 for m in found) == len(found)
    require(off, "a multiplier is not shown to be off the unit circle")
    require(outside == theorem["unstable"], f"{outside} multipliers lie outside the unit circle")
    return problem.motion(run) | {"stable": outside == 0, "multipliers": [str(m) for m in found]}


def contracts(problem: BoundaryProblem, orbit: list[arb], norm: arb_mat, size: arb) -> bool:
    """Return whether the return map is shown to contract a ball around an orbit in a norm."""
    norm = (norm + norm.transpose()) / 2
    require(definite(norm), "the norm of the ball is not shown to be positive definite")
    inverse = norm.inv()
    box = [x + ball(size * inverse[i, i].sqrt()) for i, x in enumerate(orbit)]
    derivative = problem.run(box).derivative
    return definite(norm - derivative.transpose() * norm * derivative)


def prove_attraction(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that the trajectory from an exact initial state enters a ball around an orbit that the return map contracts.

    The orbit is in the ball, so the ball is mapped into itself, and all in it converges to the orbit.
    """
    problem, orbit, run = solved(data, theorem)
    norm, size = arb_mat([[exact(x) for x in row] for row in theorem["norm"]]), exact(theorem["size"])
    require(contracts(problem, orbit, norm, size), "the return map is not shown to contract on the ball")
    system, transient = run.system, theorem["transient"]
    start = system.from_equilibrium(theorem["displacement"], theorem["velocity"])
    turns = transient["turns"]
    require(type(turns) is int, "the number of returns is not an integer")
    span = exact(theorem["phase"]) / system.omega, exact(theorem["section"]) + problem.turn(system) * turns
    impacts = list(zip(transient["stops"], transient["times"], strict=True))
    final = carry(system, span, start, impacts, (0, 0))
    away = final.state * problem.sign**turns - column(orbit)
    require((away.transpose() * norm * away)[0, 0] < size**2, "the trajectory is not shown to enter the ball")
    return problem.motion(run) | {"stable": True}


def prove_bifurcation(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that a bifurcation of an orbit lies in an interval of a parameter, nondegenerate and transversal."""
    kind, known = theorem["type"], ("SN", "GR", "SB" if theorem["symmetric"] else "PD")
    require(theorem["parameter"] in (*PARAMETERS, "clearance", "restitution"), "there is no such parameter")
    require(kind in known, f"a {kind} of this orbit is not a bifurcation that can be shown")
    require((kind == "GR") == (theorem.get("graze", 0) != 0), "a GR, and only a GR, begins on a stop")
    problem, found, run = solved(data, theorem)
    size = len(problem.state)
    in_range(theorem, found[size])
    said = problem.motion(run) | {"value": str(found[size])}
    if problem.graze:
        stop, start = problem.graze, run.system.with_phase(found[:size], found[-1])
        require(stop * (run.system.rows * start)[2, 0] < 0, "the graze is not shown to be quadratic")
        regular = (run.derivative - identity(size) * problem.sign).det()
        require(not regular.contains(0), "the orbit without the graze is not shown to be regular")
        return said | {"stops_with_graze": problem.whole([problem.graze, *problem.stops])}
    require(any(not x.contains(0) for x in problem.direction), "the direction vanishes")
    near = [m for m in multipliers(run, problem.sign) if not (abs(m) > 1 or abs(m) < 1)]
    require(len(near) == 1, f"{len(near)} multipliers may lie on the unit circle")
    return said


TWISTS = {"g": 0, "h": 1, "h_s": -1}
"""By the function whose zero is a codimension-two point: g, or its sum over the multiples of the time."""


def impulse(data: dict[str, Any], theorem: dict[str, Any], omega: Any, order: int) -> Any:
    """Return the impulse response after so many half periods, or its sum with factors 1 or -1 over the multiples."""
    system = System(data, theorem, "omega", omega)
    flow = system.flow(arb.pi() * order / omega)
    kick, twist = column(system.kick.entries()[: system.size]), TWISTS[theorem["type"]]
    state = system.free(flow) * (identity(system.size) - system.free(flow) * twist).inv() * kick
    return (system.rows * column([*state.entries(), *system.still]))[0, 0]


def prove_codimension_two(data: dict[str, Any], theorem: dict[str, Any]) -> dict[str, Any]:
    """Show that a function has one zero in an interval of omega, a simple one, and that the steady motion grazes.

    It grazes both stops, after half periods, or the stop that the theorem names, after whole periods.
    """
    order, stop = theorem["order"], theorem.get("stop", 0)
    require(type(order) is int and order >= 1, "the order is not a number of half periods")
    require(stop in (1, -1, 0) and (order % 2 == 0 if stop else alike(data)), "the stops are not grazed so")
    centre, radius = [exact(theorem["value"])], exact(theorem["radius"])
    omega = newton(lambda unknowns: [impulse(data, theorem, unknowns[0], order)], centre, radius)[0]
    in_range(theorem, omega)
    system = System(data, theorem, "omega", omega)
    free, n = system.free(system.matrix), system.size
    amplitudes = []
    for i, k in enumerate(system.orders):
        pairs = [row[n + 2 * i : n + 2 * i + 2] for row in system.matrix.tolist()[:n]]
        push = acb_mat([[sine + cosine * acb(0, 1)] for sine, cosine in pairs]) * system.forced
        steady = (acb_mat(identity(n)) * acb(0, k * omega) - acb_mat(free)).solve(push)
        amplitudes.append(abs((acb_mat(system.rows) * acb_mat([*steady.tolist(), *([x] for x in system.still)]))[0, 0]))
    require(any(amplitude > 0 for amplitude in amplitudes), "the steady amplitude may vanish")
    shorter = range(2 if stop else 1, order if theorem["type"] == "g" else 1, 2 if stop else 1)
    earlier = [(-1) ** m * impulse(data, theorem, omega, m) for m in shorter]
    active = all(x > 0 for x in earlier)
    require(active or any(x < 0 for x in earlier), "whether an impact recurs earlier is undecided")
    found: dict[str, Any] = {"omega": str(omega)}
    if len(amplitudes) == 1:  # the largest displacement of several harmonics is not enclosed
        found["clearance"] = str(amplitudes[0] + stop * system.place if stop else amplitudes[0])
    return found | {"active": active}
