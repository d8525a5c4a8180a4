"""Theorems on attraction: the trajectory from an exact initial state enters a ball that a return map contracts."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from flint import arb, arb_mat

from grazemap.checker.arithmetic import Refused, column, exact, identity
from grazemap.checker.orbits import BoundaryProblem
from grazemap.checker.system import Inputs, System
from grazemap.checker.theorems import contracts
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.proofs.certificates import Attempt, Document, ProofSearch, Undecided, decimals, exact_inputs, inputs
from grazemap_core.proofs.orbits import as_admitted, orbit_theorem
from grazemap_core.proofs.simulation import ProvenImpact, Simulation
from grazemap_core.proofs.tolerances import (
    BALL_EXPONENTS,
    BITS_PER_IMPACT,
    FIRST_PERIODS,
    MAX_PERIOD,
    NORM_DIGITS,
    REPEATED,
    SQUARINGS,
    TIME_DIGITS,
)


def prove_attraction(search: ProofSearch, request: Document) -> Iterator[Attempt]:
    """Yield the theorem on the orbit that attracts the trajectory from the given state.

    The theorem proves the statement, or, if the statement has another label, disproves it.
    """
    names = ("displacement", "velocity", "phase", "label")
    statement = inputs(search, request) | {name: request[name] for name in names if name in request}
    numbers = exact_inputs(statement)
    system = System(search.machine, numbers)
    start = system.from_equilibrium(request["displacement"], request["velocity"])
    time = exact(request["phase"]) / system.omega
    run = Simulation(system, system.with_phase(start, time).mid(), time.mid(), search.bits)
    begin, turn, periods = float(time), float(system.turn), FIRST_PERIODS
    while True:
        run.run(begin + periods * turn)
        for impacts in repeated(run.impacts, turn, float(system.omega)):
            theorem = _arrival(search, numbers, run, replace(impacts, divisor=search.machine.divisor))
            if theorem is not None:
                name = BoundaryProblem(search.machine, numbers, theorem).label
                verdict = "proven" if request.get("label", name) == name else "disproven"
                yield Attempt(statement, verdict, theorem, search.bits + BITS_PER_IMPACT * len(run.impacts))
                return
        periods += periods // 2


def repeated(impacts: list[ProvenImpact], turn: float, omega: float) -> Iterator[ImpactSequence]:
    """Yield the impacts of the last n periods of the forces if they are those of the n periods before."""
    times = np.array([float(impact.time) for impact in impacts])
    speeds = np.array([float(impact.velocity) for impact in impacts])
    stops = np.array([impact.stop for impact in impacts], dtype=np.int64)
    for n in range(1, MAX_PERIOD + 1):
        count = int(np.sum(times > times[-1] - (n - 0.5 * REPEATED) * turn)) if len(times) else 0
        if count == 0 or len(times) < 2 * count:
            continue
        same = np.array_equal(stops[-count:], stops[-2 * count : -count])
        late = times[-count:] - times[-2 * count : -count] - n * turn
        change = speeds[-count:] - speeds[-2 * count : -count]
        if same and np.all(np.abs(late) < REPEATED * turn) and np.all(np.abs(change) < REPEATED * np.abs(speeds).max()):
            yield ImpactSequence.create(n, stops[-count:], omega * times[-count:], speeds[-count:])
            return


def _arrival(search: ProofSearch, numbers: Inputs, run: Simulation, impacts: ImpactSequence) -> Document | None:
    """Return the theorem if the trajectory has entered a ball that contracts, else None."""
    try:
        if impacts.mirrors(2.0 * REPEATED):
            impacts = as_admitted(search, numbers, impacts.half())
        theorem = orbit_theorem(search, numbers, float(run.system.omega), impacts)
        problem = BoundaryProblem(search.machine, numbers, theorem)
        size, norm = _ball(problem)
    except (Refused, Undecided):
        return None
    section, turn = exact(theorem["section"]), run.system.turn * problem.turns
    last = turns = math.floor(float((run.time - section) / turn))
    while last > 0 and section + turn * last > run.impacts[0].time:
        if not _inside(problem, run.state_at(section + turn * last), last, norm, exact(size)):
            break
        last -= 1
    if last == turns:
        return None
    transient = [impact for impact in run.impacts if impact.time < section + turn * (last + 1)]
    times = decimals([impact.time for impact in transient], TIME_DIGITS)
    arrival = {"stops": [impact.stop for impact in transient], "times": times, "turns": last + 1}
    return theorem | {"size": size, "norm": [decimals(row, NORM_DIGITS) for row in norm.tolist()], "transient": arrival}


def _ball(problem: BoundaryProblem) -> tuple[str, arb_mat]:
    """Return the size of the largest ball tried that contracts, and its norm."""
    run = problem.run(problem.centre, checked=False)
    power = run.derivative.mid()
    norm = identity(power.nrows())
    for _ in range(SQUARINGS):
        norm, power = (norm + power.transpose() * norm * power).mid(), (power * power).mid()
    length = max(abs(float(gap)) for gap in run.system.gaps.values() if gap is not None)
    if length == 0.0:  # the stop is at the equilibrium
        length = max(abs(float(speed)) for speed in problem.contacts(run)[2]) / float(run.system.omega)
    largest = math.floor(math.log10(length))
    for exponent in BALL_EXPONENTS:
        size = f"1e{largest - exponent}"
        try:
            if contracts(problem, problem.centre, norm, exact(size)):
                return size, norm
        except (Refused, ZeroDivisionError):
            continue
    raise Undecided("no ball around the orbit is shown to contract")


def _inside(problem: BoundaryProblem, state: arb_mat, turns: int, norm: arb_mat, size: arb) -> bool:
    """Return whether a trajectory is within half the size of the ball after so many crossings of the section."""
    away = state * problem.sign**turns - column(problem.state)
    return bool((away.transpose() * norm * away)[0, 0] < size * size / 4)
