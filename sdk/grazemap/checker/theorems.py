"""The theorems, a function for each kind, which show that a statement is true or false.

A function takes the oscillator, the statement, the numbers of the theorem, and whether the statement is to be proven or
disproven. It returns further quantities that it has shown, and raises Refused where it cannot show something.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import acb_mat, arb, arb_mat

from grazemap.checker.arithmetic import Refused, ball, column, definite, exact, identity, newton, require
from grazemap.checker.orbits import BoundaryProblem, Run, carry
from grazemap.checker.reading import VARIED
from grazemap.checker.steady import harmonic_amplitudes, maximum
from grazemap.checker.system import Inputs, Machine, System

Numbers = dict[str, Any]

MAX_DOUBLINGS = 80
"""Doublings of the time after which the free motion must have decayed."""


def multipliers(run: Run, sign: int) -> list[Any]:
    """Return enclosures of the eigenvalues of the return map's derivative, with repetition."""
    try:
        return list(acb_mat(run.derivative * sign).eig(multiple=True))
    except ValueError:
        raise Refused("the eigenvalues are not enclosed at this precision") from None


def require_in_range(statement: Numbers, value: arb) -> None:
    """Require that a value lies in the stated range."""
    low, high = (exact(bound) for bound in statement["range"])
    require(low < value and value < high, "the point is not shown to lie in the stated range")


def solved(problem: BoundaryProblem, radius: Any) -> tuple[list[arb], Run]:
    """Show that a solution exists, unique in its box, admissible, of this least period; return it and its run."""
    size = exact(radius)
    solution = newton(problem.residual, problem.centre, size, problem.jacobian(size))
    run = problem.run(solution)
    problem.require_least_period(run)
    return solution, run


def count_unstable(values: list[Any]) -> int:
    """Return how many multipliers lie outside the unit circle, where none is on it."""
    outside: int = sum(abs(m) > 1 for m in values)
    off = outside + sum(abs(m) < 1 for m in values) == len(values)
    require(off, "a multiplier is not shown to be off the unit circle")
    return outside


def require_phases(statement: Numbers, machine: Machine) -> None:
    """Require that the phases of a statement are those of one period, and their radius below half of T."""
    phases = statement["phases"]
    require(all(a < b for a, b in pairwise(phases)), "the statement's phases do not increase")
    if phases:
        # pi is enclosed at the working precision
        span, whole = exact(phases[-1] - phases[0]), 2 * arb.pi() * statement["period"] / machine.divisor
        require(span < whole, "the statement's phases span a period or more")
        require(exact(statement["radius"]) * machine.divisor < arb.pi(), "the statement's radius is too large")


def box_sizes(statement: Numbers) -> tuple[Fraction, Fraction]:
    """Return how far the phases, and the velocities, of an orbit may be from those of a statement."""
    radius: Fraction = statement["radius"]
    return radius, radius * max((abs(v) for v in statement["velocities"]), default=Fraction(0))


def is_in_box(system: System, statement: Numbers, contacts: tuple[list[int], list[arb], list[arb]]) -> bool | None:
    """Return whether the contacts of a period lie in the box of a statement, or None where this is undecided.

    The contacts may begin with any of them, and be moved by any number of periods of the forces.
    """
    stops, times, velocities = contacts
    if len(stops) != len(statement["stops"]):
        return False
    if not stops:
        return True
    phases, speeds = ([exact(x) for x in statement[name]] for name in ("phases", "velocities"))
    reaches = [exact(reach) for reach in box_sizes(statement) for _ in stops]
    whole, undecided = system.turn * statement["period"], False
    for first in range(len(stops)):
        if stops[first:] + stops[:first] != statement["stops"]:
            continue
        turned = [*times[first:], *(time + whole for time in times[:first])]
        # of the phases moved by whole T, no others can be within a radius below T/2
        moved = system.turn * round(float(((turned[0] - phases[0] / system.omega) / system.turn).mid()))
        away = [(time - moved) * system.omega - phase for time, phase in zip(turned, phases, strict=True)]
        away += [v - speed for v, speed in zip([*velocities[first:], *velocities[:first]], speeds, strict=True)]
        if all(abs(x) <= reach for x, reach in zip(away, reaches, strict=True)):
            return True
        undecided = undecided or not any(abs(x) > reach for x, reach in zip(away, reaches, strict=True))
    return None if undecided else False


def motions_of_box(problem: BoundaryProblem, statement: Numbers) -> tuple[list[arb], list[arb]]:
    """Return the times of the impacts of all motions in the box of a statement, and their states on the section."""
    system = System(problem.machine, problem.inputs, scale=problem.scale)
    near, fast = map(exact, box_sizes(statement))
    times = [(exact(phase) + ball(near)) / system.omega for phase in statement["phases"]]
    begin, end = exact(problem.section), exact(problem.section) + system.turn * problem.turns
    require(all(begin < time and time < end for time in times), "the section does not lie between the impacts")
    speeds = [exact(speed) + ball(fast) for speed in statement["velocities"]]
    impacts = list(zip(problem.stops, times, speeds, strict=True))
    return times, system.periodic_state(begin, problem.turns, 1, impacts).entries()


def require_only_orbit(problem: BoundaryProblem, statement: Numbers, radius: Any) -> None:
    """Show that no other orbit than the one in the theorem's box can be the orbit of a statement.

    Every motion of the statement's box crosses the section in the theorem's box, and its impacts are those of the
    theorem. Without impacts the equations are linear, so they have no other solution anywhere.
    """
    require(not problem.symmetric, "other orbits are excluded only by equations of the whole period")
    require(problem.period == statement["period"], "the theorem's orbit has another period")
    require(problem.stops == statement["stops"], "the theorem's impacts do not begin as those of the statement")
    if not problem.stops:
        return
    require("radius" in statement, "an orbit contradicts only a statement that names its impacts")
    times, states = motions_of_box(problem, statement)
    size = exact(radius)
    inside = all(abs(x - middle) < size for x, middle in zip(states, problem.state, strict=True))
    require(inside, "the theorem's box does not contain every motion of the statement's box")
    around = [(time - exact(near)).abs_upper() for time, (_, near) in zip(times, problem.impacts, strict=True)]
    problem.run([x + ball(size) for x in problem.state], checked=False, isolation=around)


def prove_orbit(machine: Machine, statement: Numbers, theorem: Numbers, proven: bool) -> Numbers:
    """Show that an orbit exists, is unique in a box, is admissible, and how many of its multipliers are unstable.

    A statement is proven if this orbit is the orbit of the statement. It is disproven if this orbit contradicts it, and
    no other orbit can be the orbit of the statement.
    """
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem)
    if "phases" in statement:
        require_phases(statement, machine)
    _, run = solved(problem, theorem["radius"])
    values = multipliers(run, problem.sign)
    stable, contacts = count_unstable(values) == 0, problem.contacts(run)
    near = "phases" not in statement or is_in_box(run.system, statement, contacts)
    if proven:
        require(problem.period == statement["period"], "the orbit has another period than that of the statement")
        turned = [contacts[0][i:] + contacts[0][:i] for i in range(max(len(contacts[0]), 1))]
        require(statement["stops"] in turned, "the orbit has other impacts than those of the statement")
        require(near is True, "the orbit is not shown to lie in the statement's box")
        require(stable == statement["stable"], f"the orbit is {'' if stable else 'not '}stable")
    else:
        require_only_orbit(problem, statement, theorem["radius"])
        contradicts = stable != statement["stable"] or near is False
        require(contradicts, "the orbit does not contradict the statement")
    whole = [m * m for m in values] if problem.symmetric else values
    return problem.motion(contacts) | {"stable": stable, "multipliers": [str(m) for m in whole]}


def contracts(problem: BoundaryProblem, orbit: list[arb], norm: arb_mat, size: arb) -> bool:
    """Return whether the return map is shown to contract a ball around an orbit in a norm."""
    norm = (norm + norm.transpose()) / 2
    require(definite(norm), "the norm of the ball is not shown to be positive definite")
    inverse = norm.inv()
    box = [x + ball(size * inverse[i, i].sqrt()) for i, x in enumerate(orbit)]
    derivative = problem.run(box).derivative
    return definite(norm - derivative.transpose() * norm * derivative)


def prove_attraction(machine: Machine, statement: Numbers, theorem: Numbers, proven: bool) -> Numbers:
    """Show that the trajectory from an exact initial state enters a ball around an orbit that the return map contracts.

    The orbit is in the ball, so the ball is mapped into itself, and all states in it converge to the orbit.
    """
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem)
    orbit, run = solved(problem, theorem["radius"])
    norm, size = arb_mat([[exact(x) for x in row] for row in theorem["norm"]]), exact(theorem["size"])
    require(contracts(problem, orbit, norm, size), "the return map is not shown to contract on the ball")
    system, transient = run.system, theorem["transient"]
    start, turns = system.from_equilibrium(statement["displacement"], statement["velocity"]), transient["turns"]
    span = exact(statement["phase"]) / system.omega, exact(theorem["section"]) + system.turn * problem.turns * turns
    impacts = list(zip(transient["stops"], transient["times"], strict=True))
    final = carry(system, span, start, impacts, (0, 0))
    away = final.state * problem.sign**turns - column(orbit)
    require((away.transpose() * norm * away)[0, 0] < size**2, "the trajectory is not shown to enter the ball")
    shown = problem.motion(problem.contacts(run))
    agrees = statement.get("label", shown["label"]) == shown["label"]
    require(agrees == proven, f"the trajectory is attracted by {shown['label']}")
    return shown | {"stable": True}


def prove_bifurcation(machine: Machine, statement: Numbers, theorem: Numbers, proven: bool) -> Numbers:
    """Show that a bifurcation of an orbit lies in an interval of a parameter, nondegenerate and transversal."""
    require(proven, "one point does not exclude another one in the range")
    kind, graze = statement["type"], "graze" in theorem
    require((kind == "GR") == graze and graze != ("direction" in theorem), "a GR, and only a GR, begins on a stop")
    types = ("SN", "GR", "SB" if theorem["symmetric"] else "PD")
    require(kind in types, f"a {kind} of this orbit is not a bifurcation that can be shown")
    names_orbit = "phases" in statement
    if names_orbit:
        require_phases(statement, machine)
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem, kind)
    size = len(problem.state)
    solution, run = solved(problem, theorem["radius"])
    require_in_range(statement, solution[size])
    require(problem.period == statement["period"], "the orbit has another period than that of the statement")
    contacts = problem.contacts(run, solution[-1] if graze else None)
    shown = problem.motion(contacts) | {"value": str(solution[size])}
    if graze:
        start = run.system.with_phase(solution[:size], solution[-1])
        require(problem.graze * (run.system.rows * start)[2, 0] < 0, "the graze is not shown to be quadratic")
        regular = (run.derivative - identity(size) * problem.sign).det()
        require(not regular.contains(0), "the orbit without the graze is not shown to be regular")
    else:
        require(any(not x.contains(0) for x in problem.direction), "the direction vanishes")
        near = [m for m in multipliers(run, problem.sign) if not (abs(m) > 1 or abs(m) < 1)]
        require(len(near) == 1, f"{len(near)} multipliers may lie on the unit circle")
    require(names_orbit, "the statement does not name the orbit at the point, by its phases and velocities")
    require(is_in_box(run.system, statement, contacts) is True, "the orbit is not shown to lie in the statement's box")
    return shown


TWISTS = {"g": 0, "h": 1, "h_s": -1}
"""Factor of successive terms in the sum of the impulse response, by the type of a codimension-two point; 0: no sum."""
FREE = Inputs(VARIED, (None, None), (Fraction(0), Fraction(0)))
"""Inputs of codimension-two points, which depend neither on the stops nor on their restitutions."""


def impulse(machine: Machine, kind: str, omega: Any, order: int) -> Any:
    """Return the impulse response after `order` times T/2, or its sum with factors 1 or -1 over the multiples."""
    system = System(machine, FREE, omega)
    flow = system.free(system.flow(system.turn * order / 2))
    kick = column(system.kick.entries()[: system.size])
    state = flow * (identity(system.size) - flow * TWISTS[kind]).inv() * kick
    return (system.rows * column([*state.entries(), *system.still]))[0, 0]


def require_decay(machine: Machine) -> None:
    """Show that every free motion decays: the flow over some time is a contraction."""
    system = System(machine, FREE, arb(1))
    flow = system.free(system.flow(1 / system.scale))
    for _ in range(MAX_DOUBLINGS):
        if all(sum((abs(x) for x in row), arb(0)) < 1 for row in flow.tolist()):
            return
        flow = flow * flow
    raise Refused("the free motion is not shown to decay, on which the sums of the impulse response depend")


def prove_codimension_two(machine: Machine, statement: Numbers, theorem: Numbers, proven: bool) -> Numbers:
    """Show that a function has a simple zero in an interval of omega.

    If the statement names a stop, show also that the steady motion at this omega grazes that stop, or both stops, once
    in T. Then the clearance is returned, and for a zero of g whether it is the first one.
    """
    require(proven, "one zero does not exclude another one in the range")
    kind, order, stop = statement["type"], statement["order"], statement.get("stop")
    require_decay(machine)
    omega = newton(lambda u: [impulse(machine, kind, u[0], order)], [exact(theorem["value"])], exact(theorem["radius"]))
    require_in_range(statement, omega[0])
    shown: Numbers = {"omega": str(omega[0])}
    system = System(machine, FREE, omega[0])
    system.require_forces()
    if stop is None:
        return shown
    if stop:
        require(order % 2 == 0, "one stop is grazed after whole periods")
    else:
        require(machine.half_wave_symmetric and machine.place == 0, "the stops are not grazed at once")
    amplitudes = harmonic_amplitudes(system, machine.divisor)
    require(any(abs(x) > 0 for x in amplitudes.values()), "the steady motion may not move the contact")
    highest = maximum(amplitudes, stop or 1)
    shown["clearance"] = str(highest.value + stop * system.place)
    if kind == "g":
        step = 2 if stop else 1
        earlier = [(-1) ** m * impulse(machine, kind, omega[0], m) for m in range(step, order, step)]
        active = all(x > 0 for x in earlier)
        require(active or any(x < 0 for x in earlier), "whether an impact recurs earlier is undecided")
        shown["active"] = active
    return shown
