"""Long transients that double precision follows: how many are called sensitive? `python long_transients.py POINTS`.

Points of random maps, of chains by default, that settle late (`resolved_points`) are run in 50 digits until the orbit
has captured them in double precision. Where the two have had the same impacts until then, and their states differ by at
most a tenth of the distance at which the orbit captures, round-off has decided nothing: the point should not be called
sensitive. Others part on the way and meet again on the only attractor.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from itertools import count
from multiprocessing import get_context
from typing import Any

import numpy as np

from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.contact.kernels import half_period
from grazemap_core.contact.kernels.runs import EVENT_COUNT, OK, new_run
from grazemap_core.contact.stops import both_clearances
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import AtRest, RunSettings
from grazemap_core.maps.runner import Runner
from grazemap_core.orbits.kernels.verification import Guess, verify
from grazemap_core.simulation.start import forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.general_oracle import GeneralOracle
from tests.slow.resolved_points import MAX_PERIODS, Points, chain_column, late_points
from tests.slow.verified_points import DIGITS, Point

Floats = np.ndarray[Any, np.dtype[np.float64]]

OF_COLUMN = 4  # points of one column at most
CLOSE = 0.1  # difference of the two runs, as a share of the distance of capture
TOGETHER = 0.01  # difference of their impacts on the way, in forcing periods
CENTRE = 0.005  # distance from the orbit that counts as none, in the same unit
LONGEST = 40_000  # half periods of the approach to it
MOST_IMPACTS = 20_000  # of a run in 50 digits
MOST_SENSITIVE = 0.1  # of the points that double precision follows
AGREE, MEET, DIFFER = "agree all the way", "part and meet again", "differ in the end"
SLOW, OTHERS = "too slow to compare", "not captured, or without impacts"


class Capture:
    """A point, run alone, and the orbit that captures it."""

    def __init__(self, point: Point) -> None:
        oscillator = point.oscillator
        self.point, self.forced = point, forced_oscillator(oscillator, point.omega, point.clearance)
        self.runner = Runner(oscillator, RunSettings(MAX_PERIODS, 32, linearised=False))
        clearances = np.array([both_clearances(point.clearance)])
        codes = self.runner.run(self.forced.structure, clearances, AtRest())[0][0, 0]
        self.halves = int(codes[lane_state.HALVES_RUN])
        self.captured = codes[lane_state.UNVERIFIED] in (RESOLVED, ROUNDING_DECIDES)
        self.kernels = self.forced.structure.kernels
        self.scratch = self.runner._scratch["verification"]
        self.arrival = self.scratch.capture.arrival.copy()
        self.length = point.period * (1 if point.symmetric else 2)
        self.count = (point.right + point.left) // (2 if point.symmetric else 1)

    def arrived(self) -> int:
        """The number of half periods after which the state was `arrival`."""
        states = self.runner._scratch["history"].states
        for halves in range(self.halves, max(0, self.halves - states.shape[0]), -1):
            if np.array_equal(states[halves % states.shape[0], :, 0], self.arrival.ravel()):
                return halves
        raise AssertionError(f"the arrival is not in the history: {self.point}")

    def distance(self, state: Floats) -> float:
        """The distance of a state from the orbit, in units of that at which it is captured."""
        self.scratch.capture.arrival[...] = state
        guess = Guess(self.count, self.length, 1e6, 0.0)
        verification = verify(self.kernels.free, self.runner._blocks, self.forced.stops, guess, self.scratch)
        return float(verification.ratio) if verification.reason == RESOLVED else np.inf

    def centre(self) -> Floats | None:
        """The orbit at the phase of the arrival; None where the approach is too slow."""
        run = new_run(self.arrival.shape[0], len(self.kernels.held.orders), 4096)
        run.u[:] = self.arrival
        for half in range(1, LONGEST + 1):
            run.cursor[EVENT_COUNT] = 0
            if half_period.run_half(self.kernels, self.forced.stops, run, half - 1) != OK:
                return None
            if half % (16 * self.length) == 0 and self.distance(run.u) < CENTRE:
                return run.u
        return None


def exact_states(run: GeneralOracle, halves: int, capture: Capture) -> list[Floats]:
    """The state after so many half periods in 50 digits, in the coordinates of the kernels and with either sign."""
    forced, phase = capture.forced, halves * np.pi
    run.run(MOST_IMPACTS, phase / forced.omega)
    if len(run.times) >= MOST_IMPACTS:
        return []
    x, v = run.state().floats()
    u = forced.structure.free_state(x - forced.equilibrium, v, phase)
    return [u, -u]


def parts(point: Point, halves: int, run: GeneralOracle) -> bool:
    """Whether the impacts of double precision differ from those of a run, up to a little before its end."""
    length = 2.0 * np.pi / point.omega
    impacts = trajectory(
        point.oscillator, point.omega, point.clearance, periods=(halves + 1) // 2, samples_per_period=1
    ).impacts
    exact = np.array([float(time) for time in run.times]) / length
    end = 0.5 * halves - TOGETHER
    count = int(np.sum(exact < end))
    if np.sum(impacts.time / length < end) != count or not np.array_equal(impacts.stop[:count], run.stops[:count]):
        return True
    return bool(np.any(np.abs(impacts.time[:count] / length - exact[:count]) > TOGETHER))


def judge(point: Point) -> str:
    """Whether double precision follows the trajectory to the orbit."""
    if point.right + point.left == 0:
        return OTHERS
    capture = Capture(point)
    if not capture.captured:
        return OTHERS
    run, halves = point.exact_run(DIGITS), capture.arrived()
    states = exact_states(run, halves, capture)
    if not states:
        return SLOW
    differences = [state - capture.arrival for state in states]
    nearest = min(differences, key=lambda difference: float(np.abs(difference).max()))
    if np.abs(nearest).max() > 0.1 * capture.forced.stops.unit:
        return DIFFER
    centre = capture.centre()
    if centre is None:
        return SLOW
    if capture.distance(centre + nearest) > CLOSE:
        return DIFFER
    return MEET if parts(point, halves, run) else AGREE


def outcomes_of(random_column: Callable[[np.random.Generator], Points], seed: int) -> list[tuple[str, bool]]:
    """Of some points of a column: the outcome, and whether it is sensitive."""
    return [(judge(point), sensitive) for point, _, sensitive in late_points(seed, OF_COLUMN, random_column)]


def main(
    points: int, processes: int, random_column: Callable[[np.random.Generator], Points] = chain_column
) -> Counter[tuple[str, bool]]:
    """Print and return the counts of outcomes and whether they are sensitive, until so many points agree."""
    counts: Counter[tuple[str, bool]] = Counter()
    with get_context("spawn").Pool(processes) as pool:
        for done, outcomes in enumerate(pool.imap_unordered(partial(outcomes_of, random_column), count()), 1):
            counts.update(outcomes)
            agree = counts[AGREE, False] + counts[AGREE, True]
            if done % 50 == 0:
                print(f"{done} columns: {agree} points agree", flush=True)
            if agree >= points:
                break
    for outcome in (AGREE, MEET, DIFFER, SLOW, OTHERS):
        ordinary, sensitive = counts[outcome, False], counts[outcome, True]
        print(f"{outcome}: {ordinary + sensitive} points, {sensitive} of them sensitive")
    share = sensitive_share(counts)
    print(f"{100 * share:.1f} % of the points that double precision follows are called sensitive")
    return counts


def sensitive_share(counts: Counter[tuple[str, bool]]) -> float:
    """The share of the points that agree all the way that are called sensitive."""
    return counts[AGREE, True] / (counts[AGREE, True] + counts[AGREE, False])


if __name__ == "__main__":
    totals = main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2)
    sys.exit(1 if sensitive_share(totals) > MOST_SENSITIVE else 0)
