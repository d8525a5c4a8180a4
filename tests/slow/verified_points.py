"""Verified points of maps, run once more in 50 digits: `python verified_points.py POINTS [PROCESSES]`.

What is compared with is a simulator that shares nothing with the core (`general_oracle`): from rest, past the periods
after which the map says that the motion was known, until its impacts repeat. The label is read off its impacts alone.
Between equal stops a motion and its mirror image are one answer: which of them is reached from the same start can
depend on round-off. A run whose impacts do not repeat yet is no verdict.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from multiprocessing import get_context
from typing import Any, NamedTuple, Self

import numpy as np

from grazemap_core.contact.stops import Clearance, both_clearances
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.general_oracle import GeneralOracle
from tests.support.oscillators import DEFAULT
from tests.support.random_chains import random_oscillator

DIGITS = 50
SETTLED = 1e-5  # relative distance of impacts from those of the motion up to which a run has settled
REPEATS = 1e-4  # up to which they are the same
LONGEST = 4000  # forcing periods of a run
MOST_IMPACTS = 1500  # complete chatter has infinitely many
MOST_IMPACTS_IN_GENERAL = 10_000  # of the simulator of any structure, which is faster
MAX_PERIODS = 400

EQUAL, OTHER, NO_VERDICT = "equal", "other", "no verdict"


class Point(NamedTuple):
    """A verified point of a map; the clearance is one number where the stops are equal."""

    oscillator: Oscillator
    omega: float
    clearance: Clearance
    period: int
    right: int
    left: int
    symmetric: bool
    settled_after: int
    least_velocity: float
    multiplier: float

    @classmethod
    def of(cls, oscillator: Oscillator, omega: float, clearance: Clearance, pixel: dict[str, Any]) -> Self:
        """Return a point with what a map has there."""
        right, left = (max(pixel[name], 0) for name in ("impacts_right", "impacts_left"))
        named = pixel["period"], right, left, pixel["symmetric"], pixel["settled_after"]
        return cls(oscillator, omega, clearance, *named, pixel["least_impact_velocity"], pixel["multiplier"])

    @property
    def label(self) -> tuple[int, int, int, bool]:
        """Period, impacts on the right and on the left stop, and symmetry."""
        return self.period, self.right, self.left, self.symmetric

    @property
    def is_general(self) -> bool:
        """Whether this is not a chain between equal stops."""
        return isinstance(self.clearance, tuple)

    def exact_run(self, digits: int) -> GeneralOracle:
        """Return a run from rest in multi-precision arithmetic that has not begun."""
        return GeneralOracle.of(self.oscillator, self.omega, *both_clearances(self.clearance), digits=digits)


def clearance_of(value: Any) -> Clearance:
    """Return a clearance of an array (n,), or (n, 2) with infinities for absent stops, as trajectories take it."""
    if np.ndim(value) == 0:
        return float(value)
    right, left = (None if np.isinf(gap) else float(gap) for gap in value)
    return right, left


def verified_point(seed: int) -> Point:
    """A random point of Figure 8's window, every fifth of a random chain, that is verified and has impacts."""
    rng = np.random.default_rng(seed)
    while True:
        if seed % 5 == 4:
            masses = 3 if seed < 100 else int(rng.integers(1, 5))
            oscillator = random_oscillator(rng, masses, bool(rng.integers(2)))
            omega = float(rng.uniform(0.3, 1.5))
            amplitude = float(grazing_curve(oscillator, np.array([omega]), max_order=1).clearance[0])
            clearance = amplitude * float(rng.uniform(0.4, 1.02))
        else:
            oscillator = DEFAULT
            omega, clearance = float(rng.uniform(0.26, 0.32)), float(rng.uniform(1.2, 2.1))
        tile = unfolding_map_tile(
            Plane.of(oscillator, np.array([omega]), np.array([clearance])), MapSettings(MAX_PERIODS)
        )
        pixel = {name: values[0, 0].item() for name, values in tile.items()}
        if pixel["verified"] and max(pixel["impacts_right"], pixel["impacts_left"]) > 0:
            return Point.of(oscillator, omega, clearance, pixel)


class Impacts(NamedTuple):
    """Of a run: time in forcing periods, signed velocity before."""

    time: np.ndarray[Any, np.dtype[np.float64]]
    velocity: np.ndarray[Any, np.dtype[np.float64]]


def impacts_in_fifty_digits(point: Point) -> Impacts | None:
    """As `impacts_in_digits`, in fifty."""
    return impacts_in_digits(point, DIGITS, MOST_IMPACTS_IN_GENERAL if point.is_general else MOST_IMPACTS)


def impacts_in_digits(point: Point, digits: int, most_impacts: int) -> Impacts | None:
    """Run until a motion of the point's period, or a part of it, has settled; the run ends at the time 0.

    None where that takes too long.
    """
    run = point.exact_run(digits)
    length = 2.0 * np.pi / point.omega
    until = point.settled_after + 4 * point.period
    # what one motion period changes is less than what is left, the more so the slower it settles
    tolerance = SETTLED * max(1e-3, 1.0 - point.multiplier)
    while True:
        run.run(most_impacts, until * length)
        seen = Impacts(np.array([float(t) for t in run.times]) / length, np.array([float(v) for v in run.speeds]))
        if len(seen.time) == most_impacts or until >= LONGEST:
            return None
        seen = seen._replace(time=seen.time - until)
        if _repeats(seen, _quiet_moment(seen), point.period, tolerance) is not None:
            return seen
        until = min(LONGEST, until + 4 * point.period)


def _within(impacts: Impacts, end: float, periods: float) -> Impacts:
    chosen = (impacts.time > end - periods) & (impacts.time <= end)
    return Impacts(impacts.time[chosen], impacts.velocity[chosen])


def _repeats(
    impacts: Impacts, end: float, periods: float, tolerance: float = REPEATS, sign: float = 1.0
) -> Impacts | None:
    """The impacts of the last periods, where those before them are the same; with a sign of -1, mirror images."""
    last, before = _within(impacts, end, periods), _within(impacts, end - periods, periods)
    if len(last.time) != len(before.time) or len(last.time) == 0:
        return None
    fastest = np.abs(last.velocity).max()
    same = np.all(np.abs(last.time - before.time - periods) <= tolerance * periods)
    same = same and np.all(np.abs(last.velocity - sign * before.velocity) <= tolerance * fastest)
    return last if same else None


def verdict(point: Point, impacts: Impacts | None) -> str:
    """Whether a run has settled to the point's motion, or between equal stops to its mirror image."""
    if impacts is None:
        return NO_VERDICT
    run_label, label = label_of(impacts, point.period), point.label
    mirrored = label if point.is_general else (label[0], label[2], label[1], label[3])
    return EQUAL if run_label in (label, mirrored) else OTHER


def label_of(impacts: Impacts, longest: int) -> tuple[int, int, int, bool] | None:
    """Period, impacts on the right and on the left stop, and symmetry; None where no period up to `longest` repeats."""
    end = _quiet_moment(impacts)
    for period in range(1, longest + 1):
        last = _repeats(impacts, end, float(period))
        if last is not None:
            right, left = int(np.sum(last.velocity > 0.0)), int(np.sum(last.velocity < 0.0))
            return period, right, left, period % 2 == 1 and _repeats(impacts, end, 0.5 * period, sign=-1.0) is not None
    return None


def _quiet_moment(impacts: Impacts) -> float:
    """The middle of the longest pause in the last forcing period: there no impact is on the edge of a period."""
    times = np.concatenate([[-1.0], impacts.time[impacts.time > -1.0], [0.0]])
    longest = int(np.argmax(np.diff(times)))
    return float(0.5 * (times[longest] + times[longest + 1]))


def verdicts_of(find: Callable[[int], Iterable[Point]], seed: int) -> tuple[int, list[tuple[str, Point]]]:
    """Find points for a seed, and judge them."""
    return seed, [(verdict(point, impacts_in_fifty_digits(point)), point) for point in find(seed)]


def _one(seed: int) -> list[Point]:
    return [verified_point(seed)]


def main(seeds: int, processes: int, find: Callable[[int], Iterable[Point]] = _one) -> Counter[str]:
    """Judge the points that are found for so many seeds, print the outcome and those that differ; return the counts."""
    counts: Counter[str] = Counter()
    with get_context("spawn").Pool(processes) as pool:
        for done, (seed, outcomes) in enumerate(pool.imap_unordered(partial(verdicts_of, find), range(seeds)), 1):
            counts.update(outcome for outcome, _ in outcomes)
            for outcome, point in outcomes:
                if outcome != EQUAL:
                    print(f"{outcome}, seed {seed}: {point[1:]}", flush=True)
            if done % 50 == 0:
                print(f"{done} of {seeds}: {dict(counts)}", flush=True)
    judged = counts[EQUAL] + counts[OTHER]
    print(f"{counts[EQUAL]} of {judged} verified points as in {DIGITS} digits; {counts[NO_VERDICT]} without a verdict")
    return counts


if __name__ == "__main__":
    sys.exit(1 if main(int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 2)[OTHER] else 0)
