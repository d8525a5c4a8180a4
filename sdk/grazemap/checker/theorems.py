"""One function for each kind of theorem: it proves or disproves a statement.

A function takes the oscillator, the statement, the numbers of the theorem, and whether the statement is to be proven or
disproven. It returns the quantities that it has enclosed, and raises Refused where it cannot show something.
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

Document = dict[str, Any]
"""A statement, a theorem, or the enclosed quantities."""

MAX_DOUBLINGS = 80
"""How often `require_decay` doubles the time at most; by then the free motion must have decayed."""


def multipliers(run: Run, sign: int) -> list[Any]:
    """Return enclosures of the multipliers, each as often as its multiplicity; `sign` is that of `BoundaryProblem`."""
    try:
        return list(acb_mat(run.derivative * sign).eig(multiple=True))
    except ValueError:
        raise Refused("the eigenvalues are not enclosed at this precision") from None


def require_in_range(statement: Document, value: arb) -> None:
    """Require that a value lies in the stated range."""
    low, high = (exact(bound) for bound in statement["range"])
    require(low < value and value < high, "the point is not shown to lie in the stated range")


def solve(problem: BoundaryProblem, radius: Any) -> tuple[list[arb], Run]:
    """Return the only solution within a radius of a problem's centre, and the run of the solution.

    The solution is shown to be admissible, and the period of the problem to be its least period.
    """
    box_radius = exact(radius)
    solution = newton(problem.residual, problem.centre, box_radius, problem.jacobian(box_radius))
    run = problem.run(solution)
    problem.require_least_period(run)
    return solution, run


def count_unstable(values: list[Any]) -> int:
    """Return how many multipliers lie outside the unit circle, after showing that no multiplier lies on it."""
    outside: int = sum(abs(m) > 1 for m in values)
    all_off_circle = outside + sum(abs(m) < 1 for m in values) == len(values)
    require(all_off_circle, "a multiplier is not shown to be off the unit circle")
    return outside


def require_phases(statement: Document, machine: Machine) -> None:
    """Require that the phases of a statement increase within one period, and that their radius is below half of T."""
    phases = statement["phases"]
    require(all(a < b for a, b in pairwise(phases)), "the statement's phases do not increase")
    if phases:
        # T = 2 pi/(divisor omega), so omega T = 2 pi/divisor; pi is enclosed at the working precision
        span, period = exact(phases[-1] - phases[0]), 2 * arb.pi() * statement["period"] / machine.divisor
        require(span < period, "the statement's phases span a period or more")
        require(exact(statement["radius"]) * machine.divisor < arb.pi(), "the statement's radius is too large")


def box_radii(statement: Document) -> tuple[Fraction, Fraction]:
    """Return the radii of a statement's box: of the phases in radians, and of the velocities.

    The radius of the velocities is the same fraction of the largest velocity.
    """
    radius: Fraction = statement["radius"]
    return radius, radius * max((abs(v) for v in statement["velocities"]), default=Fraction(0))


def is_in_box(system: System, statement: Document, contacts: tuple[list[int], list[arb], list[arb]]) -> bool | None:
    """Return whether the contacts of a period lie in the box of a statement, or None where this is undecided.

    The list of contacts may begin with any contact of the period, and its times may be shifted by whole periods T.
    """
    stops, times, velocities = contacts
    if len(stops) != len(statement["stops"]):
        return False
    if not stops:
        return True
    stated_phases, stated_velocities = ([exact(x) for x in statement[name]] for name in ("phases", "velocities"))
    radii = [exact(radius) for radius in box_radii(statement) for _ in stops]
    period, undecided = system.turn * statement["period"], False
    for first in range(len(stops)):
        if stops[first:] + stops[:first] != statement["stops"]:
            continue
        rotated_times = [*times[first:], *(time + period for time in times[:first])]
        # the shift by whole T that brings the first phase nearest; the radius is below T/2, so no other shift can do
        shift = system.turn * round(float(((rotated_times[0] - stated_phases[0] / system.omega) / system.turn).mid()))
        distances = [abs((t - shift) * system.omega - x) for t, x in zip(rotated_times, stated_phases, strict=True)]
        rotated_velocities = [*velocities[first:], *velocities[:first]]
        distances += [abs(v - x) for v, x in zip(rotated_velocities, stated_velocities, strict=True)]
        if all(distance <= radius for distance, radius in zip(distances, radii, strict=True)):
            return True
        undecided = undecided or not any(x > radius for x, radius in zip(distances, radii, strict=True))
    return None if undecided else False


def motions_of_box(problem: BoundaryProblem, statement: Document) -> tuple[list[arb], list[arb]]:
    """Return enclosures, over all motions in the box of a statement: the impacts' times, the state on the section."""
    system = System(problem.machine, problem.inputs, scale=problem.scale)
    phase_radius, velocity_radius = map(exact, box_radii(statement))
    times = [(exact(phase) + ball(phase_radius)) / system.omega for phase in statement["phases"]]
    begin, end = exact(problem.section), exact(problem.section) + system.turn * problem.turns
    require(all(begin < time and time < end for time in times), "the section does not lie between the impacts")
    velocities = [exact(velocity) + ball(velocity_radius) for velocity in statement["velocities"]]
    impacts = list(zip(problem.stops, times, velocities, strict=True))
    return times, system.periodic_state(begin, problem.turns, 1, impacts).entries()


def require_only_orbit(problem: BoundaryProblem, statement: Document, radius: Any) -> None:
    """Show that the orbit in the theorem's box is the only orbit that can be the orbit of the statement.

    Every motion of the statement's box crosses the section in the theorem's box, and each such motion has the impacts
    of the theorem. Without impacts the equations are linear, so they have no other solution anywhere.
    """
    require(not problem.symmetric, "a theorem on half the period of a symmetric orbit excludes no asymmetric orbit")
    require(problem.period == statement["period"], "the theorem's orbit has another period")
    require(problem.stops == statement["stops"], "the theorem has other impacts than the statement, or another order")
    if not problem.stops:
        return
    require("radius" in statement, "the statement has no phases and no radius, so it names no orbit to contradict")
    times, states = motions_of_box(problem, statement)
    box_radius = exact(radius)
    inside = all(abs(x - middle) < box_radius for x, middle in zip(states, problem.state, strict=True))
    require(inside, "the theorem's box does not contain every motion of the statement's box")
    # how far the theorem's time of an impact is from the time in any motion of the statement's box
    isolation = [(time - exact(t)).abs_upper() for time, (_, t) in zip(times, problem.impacts, strict=True)]
    problem.run([x + ball(box_radius) for x in problem.state], checked=False, isolation=isolation)


def prove_orbit(machine: Machine, statement: Document, theorem: Document, to_prove: bool) -> Document:
    """Show that an orbit exists, is unique in a box, and is admissible; return its motion and whether it is stable.

    A statement is proven if this orbit is the orbit of the statement. It is disproven if this orbit contradicts it, and
    no other orbit can be the orbit of the statement.
    """
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem)
    if "phases" in statement:
        require_phases(statement, machine)
    _, run = solve(problem, theorem["radius"])
    values = multipliers(run, problem.sign)
    stable, contacts = count_unstable(values) == 0, problem.contacts(run)
    in_box = "phases" not in statement or is_in_box(run.system, statement, contacts)
    if to_prove:
        require(problem.period == statement["period"], "the orbit has another period than that of the statement")
        rotations = [contacts[0][i:] + contacts[0][:i] for i in range(max(len(contacts[0]), 1))]
        require(statement["stops"] in rotations, "the orbit has other impacts than those of the statement")
        require(in_box is True, "the orbit is not shown to lie in the statement's box")
        require(stable == statement["stable"], f"the orbit is {'' if stable else 'not '}stable")
    else:
        require_only_orbit(problem, statement, theorem["radius"])
        contradicts = stable != statement["stable"] or in_box is False
        require(contradicts, "the orbit does not contradict the statement")
    of_period = [m * m for m in values] if problem.symmetric else values
    return problem.motion(contacts) | {"stable": stable, "multipliers": [str(m) for m in of_period]}


def contracts(problem: BoundaryProblem, orbit: list[arb], norm: arb_mat, radius: arb) -> bool:
    """Return whether the return map is shown to contract a ball around an orbit in a norm."""
    norm = (norm + norm.transpose()) / 2
    require(definite(norm), "the norm of the ball is not shown to be positive definite")
    inverse = norm.inv()
    box = [x + ball(radius * inverse[i, i].sqrt()) for i, x in enumerate(orbit)]
    derivative = problem.run(box).derivative
    return definite(norm - derivative.transpose() * norm * derivative)


def prove_attraction(machine: Machine, statement: Document, theorem: Document, to_prove: bool) -> Document:
    """Show that the trajectory from an exact initial state converges to a stable orbit.

    The return map contracts a ball around the orbit, and the trajectory enters this ball. The orbit is in the ball, so
    the ball is mapped into itself, and all states in it converge to the orbit.
    """
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem)
    orbit, run = solve(problem, theorem["radius"])
    norm, ball_size = arb_mat([[exact(x) for x in row] for row in theorem["norm"]]), exact(theorem["size"])
    require(contracts(problem, orbit, norm, ball_size), "the return map is not shown to contract on the ball")
    system, transient = run.system, theorem["transient"]
    start, turns = system.from_equilibrium(statement["displacement"], statement["velocity"]), transient["turns"]
    span = exact(statement["phase"]) / system.omega, exact(theorem["section"]) + system.turn * problem.turns * turns
    impacts = list(zip(transient["stops"], transient["times"], strict=True))
    final = carry(system, span, start, impacts, (0, 0))
    offset = final.state * problem.sign**turns - column(orbit)
    require((offset.transpose() * norm * offset)[0, 0] < ball_size**2, "the trajectory is not shown to enter the ball")
    shown = problem.motion(problem.contacts(run))
    agrees = statement.get("label", shown["label"]) == shown["label"]
    require(agrees == to_prove, f"the trajectory is attracted by {shown['label']}")
    return shown | {"stable": True}


def prove_bifurcation(machine: Machine, statement: Document, theorem: Document, to_prove: bool) -> Document:
    """Show that a bifurcation of an orbit lies in an interval of a parameter; return its orbit and the value.

    The Jacobian of the equations is regular at the point. So a saddle-node is quadratic, and at a PD or SB a multiplier
    passes its critical value with nonzero speed. A graze is shown to be quadratic and transversal.
    """
    require(to_prove, "a bifurcation in a range cannot be disproven: one point does not exclude another in the range")
    require("phases" in statement, "the statement does not name the orbit at the point, by its phases and velocities")
    require_phases(statement, machine)
    kind, graze = statement["type"], "graze" in theorem
    require((kind == "GR") == graze and graze != ("direction" in theorem), "GR has `graze`, any other type `direction`")
    types = ("SN", "GR", "SB" if theorem["symmetric"] else "PD")
    require(kind in types, f"a {kind} of this orbit is not a bifurcation that can be shown")
    problem = BoundaryProblem(machine, Inputs.of(statement), theorem, kind)
    size = len(problem.state)
    solution, run = solve(problem, theorem["radius"])
    state, value, time = solution[:size], solution[size], solution[-1] if graze else None
    require_in_range(statement, value)
    require(problem.period == statement["period"], "the orbit has another period than that of the statement")
    contacts = problem.contacts(run, time)
    shown = problem.motion(contacts) | {"value": str(value)}
    if graze:
        start = run.system.with_phase(state, time)
        require(problem.graze * (run.system.rows * start)[2, 0] < 0, "the graze is not shown to be quadratic")
        regular = (run.derivative - identity(size) * problem.sign).det()
        require(not regular.contains(0), "the orbit without the graze is not shown to be regular")
    else:
        require(any(not x.contains(0) for x in problem.direction), "the direction vanishes")
        critical = [m for m in multipliers(run, problem.sign) if not (abs(m) > 1 or abs(m) < 1)]
        require(len(critical) == 1, f"{len(critical)} multipliers may lie on the unit circle")
    require(is_in_box(run.system, statement, contacts) is True, "the orbit is not shown to lie in the statement's box")
    return shown


TWISTS = {"g": 0, "h": 1, "h_s": -1}
"""By the type of a codimension-two point: g has one term (0), h sums all terms (1), h_s is the alternating sum (-1)."""
FREE = Inputs(VARIED, (None, None), (Fraction(0), Fraction(0)))
"""Inputs of codimension-two points, which depend neither on the stops nor on their restitutions."""


def impulse(machine: Machine, kind: str, omega: Any, order: int) -> Any:
    """Return g, h or h_s at a frequency.

    With r(m), the impulse response after m times `order` T/2, g is r(1), h is r(1) + r(2) + r(3) + ..., and h_s is
    r(1) - r(2) + r(3) - ...
    """
    system = System(machine, FREE, omega)
    flow = system.free_block(system.flow(system.turn * order / 2))
    kick = column(system.kick.entries()[: system.size])
    state = flow * (identity(system.size) - flow * TWISTS[kind]).inv() * kick
    return (system.rows * column([*state.entries(), *system.force_zeros]))[0, 0]


def require_decay(machine: Machine) -> None:
    """Show that every free motion decays: the flow over some time is a contraction."""
    system = System(machine, FREE, arb(1))
    flow = system.free_block(system.flow(1 / system.scale))
    for _ in range(MAX_DOUBLINGS):
        if all(sum((abs(x) for x in row), arb(0)) < 1 for row in flow.tolist()):
            return
        flow = flow * flow
    raise Refused("the free motion is not shown to decay, on which the sums of the impulse response depend")


def prove_codimension_two(machine: Machine, statement: Document, theorem: Document, to_prove: bool) -> Document:
    """Show that g, h or h_s, the impulse response or its sum, has a simple zero in an interval of omega.

    If the statement has a `stop`, 1 or -1 for one stop and 0 for both, show also that the steady motion at this omega
    grazes it, or both, once in T. Then the clearance is returned, and for a zero of g whether no impact recurs earlier.
    """
    require(to_prove, "a point in a range cannot be disproven: one zero does not exclude another in the range")
    kind, order, stop = statement["type"], statement["order"], statement.get("stop")
    require_decay(machine)
    omega = newton(lambda u: [impulse(machine, kind, u[0], order)], [exact(theorem["value"])], exact(theorem["radius"]))
    require_in_range(statement, omega[0])
    shown: Document = {"omega": str(omega[0])}
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
