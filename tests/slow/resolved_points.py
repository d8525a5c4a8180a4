"""Points after long transients, resolved and run once more exactly: `python resolved_points.py POINTS [PROCESSES]`.

Maps of random chains, and of random general systems, with R = 0.9 to 0.999 are searched for periodic motions that
settle late: many of these transients are chaotic, and double precision does not decide where they go.
`sensitive_points` does, and every point that it decides is compared with a run of `general_oracle`, which shares
nothing with it: from rest, with as many digits as the less precise of the two runs that decided it, until the impacts
repeat. The label is read off these impacts alone. Here a motion and its mirror image are two answers.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np

from grazemap_core.codes import ROUNDING_DECIDES
from grazemap_core.contact.stops import Clearance, both_clearances
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.sensitive_points import Resolver
from grazemap_core.model.equilibrium import contact_equilibrium, effective_gaps
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.general_oracle import GeneralOracle
from tests.slow.verified_points import DEFAULT, DIGITS, Point, clearance_of, impacts_in_digits, label_of
from tests.support.lines import column as column_of
from tests.support.random_chains import random_oscillator
from tests.support.random_systems import random_system

COLUMN = 48  # points of a map in which late motions are sought
LATE = 100  # forcing periods after which a motion settles late
MAX_PERIODS = 400
QUIET = 8  # forcing periods without an impact after which none comes
MOST_IMPACTS = 20_000  # of an exact run
DECIDED = "decided"
LEAST_SHARE = 0.95  # of points that are decided

Label = tuple[int, int, int, bool]

# after chaotic transients: in double precision to 2-12r-8l, the mirror image, and to 1-2r-1l
SENSITIVE = Point(DEFAULT, 0.285, 1.375, 2, 8, 12, False, 153, 0.0, 0.0)
ONE_MASS = Point(
    Oscillator.create([3.6716448818791587], [0.5817396920408142], [0.06904996083147477], [0.7754822078311886], 0.99),
    omega=0.8902137294606929,
    clearance=0.17161008122237378,
    period=3,
    right=4,
    left=4,
    symmetric=False,
    settled_after=326,
    least_velocity=0.0,
    multiplier=0.0,
)


class Outcome(NamedTuple):
    """Of one point: its label in the map and whether it counts there, the resolved label, and the exact one."""

    point: Point
    verified: bool
    sensitive: bool
    reason: str
    resolved: Label | None
    exact: Label | None
    bits: int
    seconds: float


class Points(NamedTuple):
    """An oscillator, a frequency, and clearances (n,) of equal stops, or (n, 2) of the right and the left one."""

    oscillator: Oscillator
    omega: float
    clearances: np.ndarray[Any, np.dtype[np.float64]]

    def clearance(self, i: int) -> Clearance:
        """Return one of the clearances, as trajectories take it."""
        return clearance_of(self.clearances[i])


def chain_column(rng: np.random.Generator) -> Points:
    """Return points of one frequency of a random chain between equal stops."""
    oscillator = random_oscillator(rng, int(rng.integers(1, 4)), bool(rng.integers(2)))
    oscillator = replace(oscillator, restitution=float(rng.uniform(0.9, 0.999)))
    omega = float(rng.uniform(0.3, 1.5))
    amplitude = float(grazing_curve(oscillator, np.array([omega]), max_order=1).clearance[0])
    return Points(oscillator, omega, amplitude * np.sort(rng.uniform(0.2, 1.02, COLUMN)))


def late_points(
    seed: int, most: int, random_column: Callable[[np.random.Generator], Points] = chain_column
) -> list[tuple[Point, bool, bool]]:
    """Points of a random map that are named late; whether they are verified, and whether a map would resolve them."""
    rng = np.random.default_rng(seed)
    while True:
        points = random_column(rng)
        oscillator, omega, clearances = points
        tile = column_of(oscillator, omega, clearances, MAX_PERIODS)
        column = {name: values[:, 0] for name, values in tile.items()}
        verified, sensitive = column["verified"], column["reason"] == ROUNDING_DECIDES
        late = np.flatnonzero((verified | sensitive) & (column["settled_after"] >= LATE))
        if len(late):
            return [
                (
                    Point.of(oscillator, omega, points.clearance(i), {k: v[i].item() for k, v in column.items()}),
                    bool(verified[i]),
                    bool(sensitive[i]),
                )
                for i in rng.permutation(late)[:most].tolist()
            ]


def general_points(seed: int, most: int) -> list[Point]:
    """Points that a map of a random general system with one to three degrees of freedom would resolve."""
    system, rng = random_system(6 * (seed // 3) + seed % 3), np.random.default_rng(seed)
    right, left = rng.uniform(0.9, 0.999, 2).tolist()
    oscillator = replace(system.oscillator, restitution=right, restitution_left=left)
    both = np.array(both_clearances(system.clearance))
    clearances = np.array([both * factor for factor in rng.uniform(0.4, 1.1, COLUMN)])
    rest = contact_equilibrium(oscillator)
    clearances = clearances[np.all(clearances > [rest, -rest], axis=1)]  # no run begins on a preloaded stop
    if len(clearances) == 0:
        return []
    tile = column_of(oscillator, system.omega, clearances, MAX_PERIODS)
    column = {name: values[:, 0] for name, values in tile.items()}
    return [
        Point.of(oscillator, system.omega, clearance_of(clearances[i]), {k: v[i].item() for k, v in column.items()})
        for i in np.flatnonzero((column["reason"] == ROUNDING_DECIDES) & ~column["sticking"])[:most].tolist()
    ]


def resolved_point(point: Point) -> tuple[Point | None, str, int]:
    """The point with the motion that multi-precision arithmetic decides, or why it does not; and the bits."""
    resolution = Resolver(point.oscillator, point.omega, MAX_PERIODS).resolve(point.clearance)
    if resolution.reason:
        return None, resolution.reason, resolution.bits
    codes, figures = resolution.codes, resolution.figures
    names = lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT
    period, right, left = (max(int(codes[name]), 0) for name in names)
    numbers = float(figures[lane_state.LEAST_VELOCITY]), float(figures[lane_state.MULTIPLIER])
    settled_after = int(codes[lane_state.SETTLED_AFTER])
    decided = point._replace(
        period=period, right=right, left=left, symmetric=bool(codes[lane_state.SYMMETRIC]), settled_after=settled_after
    )
    return decided._replace(least_velocity=numbers[0], multiplier=numbers[1]), "", resolution.bits


def exact_label(point: Point, bits: int) -> Label | None:
    """The label of a run in as many digits as the less precise run with `bits` bits at most had."""
    digits = max(DIGITS, round(0.5 * bits * np.log10(2.0)))
    if point.right + point.left == 0:
        run = GeneralOracle.of(point.oscillator, point.omega, *both_clearances(point.clearance), digits=digits)
        length = 2.0 * np.pi / point.omega
        run.run(MOST_IMPACTS, (point.settled_after + QUIET) * length)
        gaps = effective_gaps(point.oscillator, *both_clearances(point.clearance))
        alike = gaps[0] == gaps[1] and point.oscillator.is_half_wave_symmetric
        alike = alike and point.oscillator.restitution_of(1) == point.oscillator.restitution_of(-1)
        return (1, 0, 0, alike) if not run.times or run.times[-1] < point.settled_after * length else None
    impacts = impacts_in_digits(point, digits, MOST_IMPACTS)
    return None if impacts is None else label_of(impacts, point.period)


def outcome_of(seed: int) -> Outcome:
    """Find a point, resolve it, and run it exactly."""
    if seed % 5 == 4:
        point = next(candidate for k in count(seed, 1000) for candidate in general_points(k, 1))
        verified, sensitive = False, True
    else:
        ((point, verified, sensitive),) = late_points(seed, 1)
    began = time.process_time()
    decided, reason, bits = resolved_point(point)
    seconds = time.process_time() - began
    if decided is None:
        return Outcome(point, verified, sensitive, reason, None, None, bits, seconds)
    return Outcome(point, verified, sensitive, "", decided.label, exact_label(decided, bits), bits, seconds)


def main(points: int, processes: int) -> int:
    """Print the counts, and return whether a label is wrong or too few are decided."""
    with get_context("spawn").Pool(processes) as pool:
        outcomes: list[Outcome] = []
        for outcome in pool.imap_unordered(outcome_of, range(points)):
            outcomes.append(outcome)
            if outcome.resolved != outcome.exact:
                print(f"decided {outcome.resolved}, exactly {outcome.exact}: {outcome}", flush=True)
            elif outcome.verified and outcome.resolved not in (None, outcome.point.label):
                print(f"verified {outcome.point.label}, exactly {outcome.exact}: {outcome}", flush=True)
            if len(outcomes) % 20 == 0:
                counts = dict(Counter(outcome.reason or DECIDED for outcome in outcomes))
                print(f"{len(outcomes)} of {points}: {counts}", flush=True)
    decided = [outcome for outcome in outcomes if outcome.resolved is not None]
    wrong = sum(outcome.resolved != outcome.exact for outcome in decided)
    wrong_verified = sum(outcome.verified and outcome.point.label != outcome.resolved for outcome in decided)
    print(f"{len(outcomes)} points that settle after {LATE} to {MAX_PERIODS} periods")
    print(f"{sum(outcome.verified for outcome in outcomes)} verified, {wrong_verified} of them wrong")
    print(f"{sum(outcome.sensitive for outcome in outcomes)} sensitive")
    print(f"{len(decided)} decided, {len(decided) - wrong} of them as exactly; undecided:")
    for reason, number in Counter(outcome.reason for outcome in outcomes if outcome.reason).items():
        print(f"  {number}: {reason}")
    seconds = [outcome.seconds for outcome in outcomes]
    print(f"seconds a point: mean {np.mean(seconds):.1f}, median {np.median(seconds):.1f}, most {np.max(seconds):.1f}")
    print(f"bits: {dict(sorted(Counter(outcome.bits for outcome in decided).items()))}")
    return wrong + wrong_verified + (len(decided) < LEAST_SHARE * len(outcomes))


if __name__ == "__main__":
    sys.exit(1 if main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2) else 0)
