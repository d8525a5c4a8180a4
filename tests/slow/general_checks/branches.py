"""Branches of general systems from two starts each: the same special points; some of them against 50 digits.

The second start is an orbit in the middle of the branch from the first one, solved for anew. Special points are
compared by type, place and impacts. A special point without a counterpart is wrong, unless one of another type lies
within `COINCIDE` of it: there two types coincide. In 50 digits, the function that vanishes at a point is computed at
orbits beside it, and its zero is interpolated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np
from flint import arb

from grazemap_core.continuation.branches import OrbitBranch, OrbitPoint, orbit_branch
from grazemap_core.continuation.parameters import PARAMETERS, ParameterPoint
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.errors import CoreError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import ImpactOrbit, solved
from tests.support.general_systems import random_system

from .table import Row, part

BRANCHES, IN_DIGITS = 200, 30
COINCIDE = 1e-9
"""Distance, relative to the parameter, up to which two special points coincide, or one is the same from two starts."""
SAME_IMPACTS = 1e-5
"""Largest difference of impact velocities, relative to the largest on the branch: of an SN they are accurate to the
root of round-off."""
REACH = 0.3
"""The branches lie between the parameter at the start less and plus this share of it."""
BESIDE = 1e-10
"""Distance, relative to the parameter, of the orbits in 50 digits from a PD or a GR. A linear interpolation is off by
about its square over the distance from an SN, which may be 1e-6."""
BESIDE_FOLD = (1e-7, 2e-7)
"""Those from an SN, whose guesses are off by the square root of the distance, times that of the next orbit."""
ACCURACY = 1e-10
"""Distance of a special point from the zero in 50 digits, relative to the parameter: an SN is interpolated with an
error of the power 3/2 of `BESIDE_FOLD`."""


class Compared(NamedTuple):
    """What two branches have, and the errors in 50 digits of one of their special points."""

    points: int
    unconverged: int
    apart: int
    coincide: int
    errors: list[float]


def _second_start(oscillator: Oscillator, branch: OrbitBranch) -> OrbitPoint | None:
    """Return the orbit in the middle of a branch, or the next one that can be solved for."""
    count = len(branch.values)
    for place in sorted(range(count), key=lambda i: abs(i - count // 2)):
        values = branch.points[place]
        impacts = ImpactSequence(branch.period, branch.stops, branch.phases[place], branch.velocities[place])
        orbit = periodic_orbit(values.applied(oscillator), values.omega, values.clearance, impacts)
        if orbit.isolated:
            return OrbitPoint(orbit, values)
    return None


def _alike(candidate: SpecialPoint, other: SpecialPoint, distance: float, speed: float) -> bool:
    first, second = (np.sort(point.impacts.whole.velocities) for point in (candidate, other))
    return (
        (candidate.type, candidate.stop, candidate.admissible, len(first))
        == (other.type, other.stop, other.admissible, len(second))
        and distance <= COINCIDE
        and bool(np.max(np.abs(first - second)) <= SAME_IMPACTS * speed)
    )


def _beside(
    oscillator: Oscillator, branch: OrbitBranch, point: SpecialPoint, parameter: str, value: float, share: float
) -> ImpactOrbit:
    """Return the orbit at a value beside a special point; its guess is a share of the way to a neighbour."""
    values = point.values.varied(parameter, value)
    near = point.segment + (share < 0.0)
    turn = np.round((branch.phases[near, 0] - point.impacts.phases[0]) / (2.0 * np.pi)) * 2.0 * np.pi
    guess = replace(
        point.impacts,
        phases=point.impacts.phases + abs(share) * (branch.phases[near] - turn - point.impacts.phases),
        velocities=point.impacts.velocities + abs(share) * (branch.velocities[near] - point.impacts.velocities),
    )
    return solved(values.applied(oscillator), values.omega, values.clearance, guess)


def _error(oscillator: Oscillator, branch: OrbitBranch, point: SpecialPoint, parameter: str) -> float:
    """Return the distance of a special point from the zero in 50 digits, relative to the parameter."""
    value = point.values.value(parameter)
    tests: dict[str, Callable[[ImpactOrbit], arb]] = {
        "SN": lambda orbit: orbit.test_function(1),
        "PD": lambda orbit: orbit.test_function(-1),
        "GR": lambda orbit: orbit.velocities[point.impact or 0],
    }
    test, squares = tests[point.type], []
    if point.type != "SN":
        places = [value * (1.0 + side * BESIDE) for side in (-1.0, 1.0)]
        with digits():
            first, second = (test(_beside(oscillator, branch, point, parameter, there, 0.0)) for there in places)
            zero = (arb(places[0]) * second - arb(places[1]) * first) / (second - first)
            return abs(float(zero / value - 1))
    # the square of the test function is linear in the parameter, on the side where the branch is
    beyond = branch.values[point.segment : point.segment + 2] - value
    side = np.sign(beyond[np.argmax(np.abs(beyond))])
    for distance in BESIDE_FOLD:
        there = value + side * abs(value) * distance
        both = [
            _beside(oscillator, branch, point, parameter, there, sign * np.sqrt(abs((there - value) / step)))
            for sign, step in zip((1.0, -1.0), beyond, strict=True)
        ]
        with digits():
            of_both = [test(orbit) for orbit in both]
            if not of_both[0] * of_both[1] < 0:
                return float("inf")
            squares.append((arb(there), (of_both[0] - of_both[1]) ** 2))
    with digits():
        (first, low), (second, high) = squares
        return abs(float((first * high - second * low) / (high - low) / value - 1))


def compare(seed: int, in_digits: bool) -> Compared | None:
    """Compare the branches of a random system; None where it has no orbit, or the parameter no range."""
    system = random_system(seed)
    if system is None:
        return None
    oscillator, random = system.oscillator, np.random.default_rng(seed)
    orbit = periodic_orbit(oscillator, system.omega, system.clearance, system.impacts)
    at = ParameterPoint.of(oscillator, system.omega, system.clearance)
    stop = "right" if np.isfinite(at.clearance_right) else "left"
    parameter = str(random.choice(["omega", f"clearance_{stop}", f"restitution_{stop}", "bias", "forcing"]))
    assert parameter in PARAMETERS
    here = at.value(parameter)
    low, high = sorted((here * (1.0 - REACH), here * (1.0 + REACH)))
    if parameter.startswith("restitution"):
        high = min(high, 1.0)
    try:
        first = orbit_branch(oscillator, orbit, low, high, parameter)
        start = _second_start(oscillator, first)
        if start is None:
            return None
        second = orbit_branch(oscillator, start, low, high, parameter)
    except CoreError as error:
        print(f"seed {seed}, {parameter}: {error}", flush=True)
        return None
    sides, lonely, coincide = [list(first.special_points), list(second.special_points)], [], 0
    unit, speed = abs(here), float(np.max(np.abs(first.velocities)))

    def apart(candidate: SpecialPoint, other: SpecialPoint) -> float:
        return abs(candidate.values.value(parameter) - other.values.value(parameter)) / unit

    for point in list(sides[0]):
        same = [other for other in sides[1] if _alike(point, other, apart(point, other), speed)]
        if same:
            sides[0].remove(point)
            sides[1].remove(same[0])
    every = [*first.special_points, *second.special_points]
    for point in [*sides[0], *sides[1]]:
        if any(other.type != point.type and apart(other, point) <= COINCIDE for other in every):
            coincide += 1
        else:
            lonely.append(point)
    for point in lonely:
        print(
            f"seed {seed}, {parameter}, ends {first.ends} {second.ends}: {point.type} {point.status} at "
            f"{point.values.value(parameter)!r}, segment {point.segment}, from start {1 + (point in sides[1])} alone",
            flush=True,
        )
    errors = []
    # where the other function of the GR has no velocity, and at an NS, there is no function here
    simple = [
        point
        for point in first.special_points
        if point.status == "converged"
        and (point.type in ("SN", "PD") or point.impact is not None)
        # where the branch ends on another one, the orbit beside the point is not unique
        and point.impacts.repeats_after() == point.impacts.period
    ]
    if in_digits and simple:
        point = simple[int(random.integers(len(simple)))]
        errors.append(_error(oscillator, first, point, parameter))
        if not errors[-1] <= ACCURACY:
            print(f"seed {seed}, {parameter}: {point.type} at {point.values!r} is off by {errors[-1]:.1e}", flush=True)
    guesses = sum(point.status != "converged" for point in every)
    return Compared(len(every), guesses, len(lonely), coincide, errors)


def check(share: float, processes: int) -> list[Row]:
    """Compare branches of as many systems as have an orbit, and special points with 50 digits."""
    wanted, digits_wanted = part(BRANCHES, share), part(IN_DIGITS, share)
    comparisons: list[Compared] = []
    compared: list[float] = []
    seed = 0
    with get_context("spawn").Pool(processes) as pool:
        while len(comparisons) < wanted:
            batch = range(seed, seed + 4 * processes)
            seed = batch.stop
            jobs = [(trial, len(compared) < digits_wanted) for trial in batch]
            for result in pool.starmap(compare, jobs, chunksize=1):
                if result is not None and len(comparisons) < wanted:
                    comparisons.append(result)
                    compared += result.errors
    points, guesses, apart, coincide = (sum(comparison[i] for comparison in comparisons) for i in range(4))
    wrong = sum(not error <= ACCURACY for error in compared)
    figure = f"{coincide} where two types coincide, {guesses} not converged"
    return [
        Row(
            "branches from two starts: those with other special points",
            len(comparisons),
            sum(x.apart > 0 for x in comparisons),
        ),
        Row("special points of these branches", points, apart, figure),
        Row("special points against 50 digits", len(compared), wrong, f"error {max(compared, default=0.0):.1e}"),
    ]
