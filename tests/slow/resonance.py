"""Impacts near resonance against 60-digit arithmetic: `python -m tests.slow.resonance [CASES]`.

Chains, or other structures, without damping or with hardly any are forced at a natural frequency, or beside one. Every
impact of 50 forcing periods from rest, of a trajectory and of the lockstep kernel of maps, is compared with
`resonance_oracle`, or with `general_oracle`. Most of these motions are chaotic. So the errors are compared with the
change of the exact times by a relative change of every input by EPSILON, and an impact counts as predictable as long as
these changes are small. Nothing is compared after a complete chatter begins, as its impacts are not listed one by one.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from flint import acb, arb

from benchmarks.ensemble import first_impacts
from grazemap_core.contact.kernels.runs import CHATTER
from grazemap_core.contact.stops import Clearance
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.trajectories import trajectory
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.resonance_oracle import SLOWEST, ResonanceOracle

PERIODS = 50
OFFSETS = (0.0, 1e-15, -1e-13, 1e-13, 1e-11, -1e-9, 1e-9, 1e-7, -1e-5, 1e-4, -1e-3, 1e-3, 1e-2, -1e-1, 1e-1)
"""Distances of the forcing frequency from the natural one."""
ACCURACY = 1e-12
"""Largest error of an impact time, in forcing periods, apart from the growth of errors."""
ROUNDINGS = 64.0
"""Largest error in units of the change by EPSILON."""
PREDICTABLE = 1e-6
"""Largest error, in forcing periods, that is allowed: later impacts are not compared."""
CHANGE = 1e-35
CHANGES = 3
MOST_IMPACTS = 1000


class Case(NamedTuple):
    """An oscillator near resonance, at a distance from it; what runs it exactly, with its numbers.

    `reach` is about the displacement by which the resonant mode moves the contact in half a period.
    """

    oscillator: Oscillator
    omega: float
    clearance: Clearance
    offset: float
    reach: float
    oracle: Callable[..., ResonanceOracle | GeneralOracle]
    numbers: dict[str, Any]


class Outcome(NamedTuple):
    """Impacts of one run, and those that are compared; the largest error, in forcing periods and over that allowed.

    `wrong` impacts have a larger error or another stop, or are missed or false; `grazes` are undecided contacts.
    """

    impacts: int
    compared: int
    error: float
    share: float
    wrong: int
    grazes: int


def random_case(seed: int) -> Case:
    """Return a chain of one to three masses, undamped if the seed is even, forced near one of its modes."""
    rng = np.random.default_rng([seed, 7])
    size, offset = 1 + seed % 3, OFFSETS[seed % len(OFFSETS)]
    lists = [rng.uniform(0.5, 2.0, size).tolist() for _ in range(2)]
    forcing = rng.uniform(0.3, 1.0, size).tolist()
    gamma, restitution = 0.0 if seed % 2 == 0 else 1e-12, float(rng.uniform(0.6, 0.95))
    oscillator = Oscillator.create(*lists, gamma, forcing, restitution)
    model = modal_model(oscillator)
    mode = int(rng.integers(size))
    omega = float(np.sqrt(model.frequency_squared[mode])) + offset
    # the mode moves mass 1 by about this in half a period
    reach = abs(model.shape[0, mode, 0] * (model.shape[:, mode, 0] @ forcing)) * np.pi / (2.0 * omega**2)
    clearance = float(rng.uniform(0.3, 3.0) * reach)
    numbers = {"masses": lists[0], "stiffnesses": lists[1], "gamma": gamma, "forcing": forcing}
    numbers |= {"restitution": restitution, "omega": omega, "clearance": clearance}
    return Case(oscillator, omega, clearance, offset, reach, ResonanceOracle, numbers)


def exact_impacts(case: Case) -> tuple[ResonanceOracle | GeneralOracle, np.ndarray]:
    """Return the exact run, and the change of every impact time by a relative change of all inputs by EPSILON."""
    with digits(60):
        end = PERIODS * 2 * arb.pi() / arb(case.omega)
    exact = case.oracle(**case.numbers)
    exact.run(until=end)
    rng = np.random.default_rng(0)
    changes = np.zeros(len(exact.times))
    for _ in range(CHANGES):
        changed = case.oracle(**{name: _changed(value, rng) for name, value in case.numbers.items()})
        changed.run(until=end)
        with digits(60):
            both = list(zip(exact.times, changed.times, strict=False))
            moved = [abs(float(a - b)) / CHANGE * EPSILON for a, b in both]
        changes = np.maximum(changes, np.pad(moved, (0, len(changes) - len(moved)), constant_values=np.inf))
    return exact, np.maximum.accumulate(changes)


def _changed(value: Any, rng: np.random.Generator) -> Any:
    """Return the numbers of a run with every one of them changed; whole numbers and what is absent stay."""
    if isinstance(value, list | tuple):
        return [_changed(part, rng) for part in value]
    if value is None or isinstance(value, int):
        return value
    with digits(60):
        number = value if isinstance(value, acb) else arb(value)
        return number * (1 + arb(float(rng.choice([-1.0, 1.0]))) * arb(CHANGE))


def compare(case: Case, lockstep: bool, exact: ResonanceOracle | GeneralOracle, changes: np.ndarray) -> Outcome:
    """Compare the impacts of a trajectory, or of the lockstep kernel, with the exact ones."""
    oscillator, omega, clearance = case.oscillator, case.omega, case.clearance
    if lockstep:
        lanes = first_impacts(oscillator, omega, [clearance], PERIODS, MOST_IMPACTS)
        count = int(np.count_nonzero(lanes.half[0] >= 0))
        halves, times, stops, grazes = lanes.half[0], lanes.time[0], lanes.stop[0], 0
        chatters = np.flatnonzero(lanes.kind[0, :count] == CHATTER)
    else:
        impacts = trajectory(oscillator, omega, clearance, periods=PERIODS, samples_per_period=1).impacts
        halves, times, stops = 2 * impacts.period, impacts.phase_time, impacts.stop
        count, grazes = len(times), int(np.count_nonzero(impacts.kind == "graze"))
        chatters = np.flatnonzero(impacts.kind == "chatter")
    with digits(60):
        period = 2 * arb.pi() / arb(omega)
        inside = [time for time in exact.times if time < PERIODS * period]
        ends = len(chatters) > 0 or (bool(inside) and abs(float(exact.speeds[-1])) <= SLOWEST * omega * case.reach)
        unit = float(period)
        allowed = np.maximum(ACCURACY, ROUNDINGS * changes[: len(inside)] / unit)
        compared = min([int(np.count_nonzero(allowed < PREDICTABLE)), *(chatters[:1] + 1).tolist()])
        error = np.full(compared, np.inf)
        for k in range(min(compared, count)):
            error[k] = abs(float((arb(float(times[k])) + int(halves[k]) * period / 2 - exact.times[k]) / period))
    right = (error <= allowed[:compared]) & (np.resize(stops[:count], compared) == exact.stops[:compared])
    wrong = int(np.count_nonzero(~right))
    if compared == len(inside) and not ends:  # there are no more
        wrong += abs(count - compared)
    share = float(np.max(error / allowed[:compared], initial=0.0))
    return Outcome(count, compared, float(np.max(error, initial=0.0)), share, wrong, grazes)


def main(cases: int, find: Callable[[int], Case] = random_case) -> list[Outcome]:
    """Compare cases, print a table, and return the outcomes, of a trajectory and of the lockstep kernel in turn."""
    print("masses  omega - omega_j  kernel      impacts  compared  error/T  of allowed  wrong  grazes")
    outcomes = []
    for seed in range(cases):
        case = find(seed)
        exact, changes = exact_impacts(case)
        for lockstep in (False, True):
            outcome = compare(case, lockstep, exact, changes)
            name = "lockstep" if lockstep else "trajectory"
            print(
                f"{case.oscillator.size:6d} {case.offset:16.0e}  {name:10s} "
                f"{outcome.impacts:8d} {outcome.compared:9d} {outcome.error:8.0e} "
                f"{outcome.share:11.3f} {outcome.wrong:6d} {outcome.grazes:7d}",
                flush=True,
            )
            outcomes.append(outcome)
    print(f"{failed(outcomes)} of {len(outcomes)} runs have wrong impacts")
    return outcomes


def failed(outcomes: list[Outcome]) -> int:
    """Return how many runs have wrong impacts."""
    return sum(outcome.wrong > 0 or outcome.grazes > 0 for outcome in outcomes)


if __name__ == "__main__":
    sys.exit(failed(main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)) > 0)
