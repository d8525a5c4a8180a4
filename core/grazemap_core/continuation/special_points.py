"""Special points between two neighbouring orbits of a branch, where a test function changes its sign.

They are saddle-nodes, period doublings, symmetry breakings, Neimark-Sacker points and grazes. Each is solved for along
the tangent of the branch, to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from operator import attrgetter
from typing import Any, Final, Literal

import numpy as np
from scipy.optimize import brentq

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.continuation.branch_ends import Halves
from grazemap_core.continuation.continuation_problem import ContinuationPoint, ContinuationProblem
from grazemap_core.continuation.parameters import ParameterOrbit, ParameterPoint
from grazemap_core.continuation.tolerances import (
    END_REACHES,
    GRAZE_MARGIN,
    LARGEST_MULTIPLIER,
    SPECIAL_POINT_RESIDUAL,
    UNIT_CIRCLE_DISTANCE,
    UNIT_CIRCLE_HALVINGS,
)
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.records import dataclass
from grazemap_core.tolerances import EPSILON

ORBITS_NOT_SOLVED: Final = (
    "a test function changes its sign between orbits of the branch, but not all of them are solved for"
)
NOT_ZERO: Final = "a test function changes its sign, but does not vanish to round-off"

SpecialType = Literal["SN", "PD", "SB", "NS", "GR"]

Test = Callable[[ContinuationPoint], float]
"""A test function, which changes its sign at a special point."""

_fold_test: Final[Test] = attrgetter("fold_test")
_doubling_test: Final[Test] = attrgetter("doubling_test")


@dataclass(frozen=True, eq=False)
class SpecialPoint(ParameterOrbit):
    """A special point of a branch."""

    type: SpecialType
    """What is special about the orbit."""
    values: ParameterPoint
    """The values of all parameters there."""
    reason: str
    """Why the test function that changes its sign there is not shown to vanish to round-off; empty if it is."""
    admissible: bool
    """Whether the orbit there is a motion; for a GR, whether the orbits on one side of it are."""
    impacts: ImpactSequence
    """The impacts of the orbit."""
    multipliers: Complexes
    """(2 N,) For symmetric motions: over half the period, followed by the mirror image."""
    segment: int = -1
    """The point lies between this point of the branch and the next."""
    stop: int | None = None
    """GR only: stop of the graze."""
    phase: float | None = None
    """GR only: forcing phase of the graze."""
    impact: int | None = None
    """GR only: index of the impact that vanishes; None where a further contact appears."""

    @property
    def status(self) -> Literal["converged", "guess"]:
        """Whether there is no `reason` for doubt."""
        return "guess" if self.reason else "converged"


def neimark_sacker_test(point: ContinuationPoint, count: int) -> float:
    """Return a function that changes its sign where a pair of multipliers passes the unit circle.

    It is the product of ``(1 - mu_i mu_j)`` over all pairs, each factor divided by ``1 + |mu_i mu_j|``. The change of
    sign at an impact of speed 0, where multipliers pass through infinity, is compensated. Real pairs mu, 1/mu are zeros
    too; `on_unit_circle` excludes them.
    """
    mu = np.where(np.abs(point.multipliers) < LARGEST_MULTIPLIER, point.multipliers, LARGEST_MULTIPLIER)
    first, second = _pairs(len(mu))
    products = mu[first] * mu[second]
    factors = (1.0 - products) / (1.0 + np.abs(products))
    sign = float(np.prod(np.sign(point.unknowns[count : 2 * count]))) ** (len(mu) - 1)
    return sign * float(np.prod(factors).real)


@lru_cache(maxsize=8)
def _pairs(count: int) -> tuple[Integers, Integers]:
    return np.triu_indices(count, 1)


Located = tuple[float, SpecialPoint]
"""Distance along the tangent of a segment, and the special point there."""


class BranchSegment:
    """A segment of a branch between two neighbouring orbits, and the orbits on it."""

    def __init__(
        self, path: ContinuationProblem, first: ContinuationPoint, second: ContinuationPoint, along: Floats
    ) -> None:
        """Take the unit tangent at the first point."""
        self.path, self.first, self.second, self.along = path, first, second, along
        self.end = float(along @ (second.unknowns - first.unknowns))
        self.complete = True  # whether all orbits of the last search were solved for
        self._known = {0.0: first, self.end: second}

    def at(self, distance: float) -> ContinuationPoint:
        """Return the point at a distance along the tangent; the nearest end where Newton's method fails there."""
        if distance not in self._known:
            share = distance / self.end
            guess = self.first.unknowns + share * (self.second.unknowns - self.first.unknowns)
            solution = self.path.correct(guess, self.along)
            self.complete &= solution is not None
            if solution is None:
                return self.first if share < 0.5 else self.second
            self._known[distance] = self.path.evaluate(solution[0])
        return self._known[distance]

    def zero(self, test: Test, low: float, high: float) -> float | None:
        """Return where a test function changes its sign between two distances, or None where it does not."""
        self.complete = True
        at_low, at_high = test(self.at(low)), test(self.at(high))
        if not (math.isfinite(at_low) and math.isfinite(at_high)) or at_low == 0.0:
            return None
        if at_high == 0.0:
            return high
        if (at_low > 0.0) == (at_high > 0.0):  # their product may underflow
            return None
        return float(brentq(lambda s: test(self.at(s)), low, high, xtol=EPSILON * self.end, rtol=4.0 * EPSILON))

    def special_points(self, turns: bool) -> list[SpecialPoint]:
        """Return the special points of the segment in order; `turns` says that its parameter has an extremum there."""
        end = self._end_on_another()
        points = [end] if end is not None else self._folds() if turns else []
        where = self.zero(_doubling_test, 0.0, self.end)
        if where is not None:
            kind: SpecialType = "SB" if self.path.pattern.symmetric else "PD"
            points.append(self._special(kind, _doubling_test, where))
        vanishing = self._vanishing_impacts()
        points += vanishing
        for low, high in self._between([where for where, _ in points]):
            where = self._pair_on_unit_circle(low, high)
            if where is not None:
                points.append(self._special("NS", self._neimark_sacker_test, where))
        points += self._further_contacts([where for where, _ in vanishing])
        return [point for _, point in sorted(points, key=lambda item: item[0])]

    def _pair_on_unit_circle(self, low: float, high: float) -> float | None:
        """Return where a complex pair of multipliers passes the unit circle between two distances, or None.

        No single multiplier passes it there. The test function has another zero where a real pair mu, 1/mu passes. With
        both between the distances it has one sign at either, but two more multipliers lie outside the circle at one of
        them: the distance is halved until one zero is left.
        """
        for _ in range(UNIT_CIRCLE_HALVINGS):
            where = self.zero(self._neimark_sacker_test, low, high)
            if where is not None and on_unit_circle(self.at(where).multipliers):
                return where
            if abs(_outside(self.at(high)) - _outside(self.at(low))) < 2:
                return None
            middle = 0.5 * (low + high)
            if abs(_outside(self.at(middle)) - _outside(self.at(low))) < 2:
                low = middle
            else:
                high = middle
        return None

    def _folds(self) -> list[Located]:
        """Return the point at which the parameter turns."""
        points: list[Located] = []
        for test in (_fold_test, self._rise):  # where branches meet, the first test only touches zero
            where = self.zero(test, 0.0, self.end)
            if where is not None:
                points.append(self._special("SN", test, where))
                if not points[-1][1].reason:
                    return points[-1:]
        return points[:1]

    def _end_on_another(self) -> Located | None:
        """Return the point at which the branch ends on another one, solved for there, or None."""
        halves = Halves.of(self.path, self.first.unknowns)
        if halves is None:
            return None
        before, after = (halves.difference(point.unknowns) for point in (self.first, self.second))
        if float(before @ after) >= 0.0:
            return None
        share = float(before @ before) / float(before @ (before - after))
        guess = halves.mean(self.first.unknowns + share * (self.second.unknowns - self.first.unknowns))
        other = halves.other()
        normal = other.direction(guess)
        for reach in END_REACHES:
            sides = [other.correct(guess + side * reach * self.end * normal, normal) for side in (-1.0, 1.0)]
            if sides[0] is None or sides[1] is None:
                continue
            across = BranchSegment(other, other.evaluate(sides[0][0]), other.evaluate(sides[1][0]), normal)
            there = across.zero(_doubling_test, 0.0, across.end)
            if there is not None:
                unknowns = halves.doubled(across.at(there).unknowns)
                where = float(self.along @ (unknowns - self.first.unknowns))
                self._known[where] = self.path.evaluate(unknowns)
                kind: SpecialType = "PD" if halves.sign > 0.0 else "SB"
                doubt = across._doubt(_doubling_test, there)
                return where, special_point_at(self.path, self.at(where), kind, doubt)
        return None

    def _vanishing_impacts(self) -> list[Located]:
        """Return the grazes at which the velocity of an impact vanishes."""
        count = self.path.count
        points: list[Located] = []
        for i in range(count):

            def speed(point: ContinuationPoint, i: int = i) -> float:
                return float(point.unknowns[count + i])

            where = self.zero(speed, 0.0, self.end)
            if where is not None:
                # at the graze itself another contact may begin, and round-off would decide
                admissible = any(self.at(side).admissible for side in self._beside(where))
                points.append(self._special("GR", speed, where, admissible=admissible, impact=i))
        return points

    def _further_contacts(self, grazes: list[float]) -> list[Located]:
        """Return the grazes at which a further contact begins, between those at which an impact vanishes."""
        count = self.path.count
        points: list[Located] = []
        for low, high in self._between(grazes):
            speeds = [self.at(place).unknowns[count : 2 * count] * self.path.sides for place in (low, high)]
            if not any(np.all(velocities > 0.0) for velocities in speeds):
                continue  # virtual impacts: no orbit on either side is admissible
            where = self.zero(_excess, low, high)
            if where is not None:
                point = self.at(where)
                whole = 2.0 * math.pi * self.path.pattern.multiple
                phase = point.excess_phase - math.floor(point.unknowns[0] / whole) * whole
                graze = {"admissible": True, "stop": point.excess_stop, "phase": phase}
                points.append(self._special("GR", _excess, where, **graze))
        return points

    def _between(self, places: list[float]) -> list[tuple[float, float]]:
        """Return the parts of the segment between special points, each without what is just beside them."""
        low = 0.0
        between: list[tuple[float, float]] = []
        for before, after in [*sorted(self._beside(where) for where in places), (self.end, self.end)]:
            if low < before:
                between.append((low, before))
            low = max(low, after)
        return between

    def _beside(self, where: float) -> tuple[float, float]:
        """Return the distances just before and just after a special point."""
        margin = GRAZE_MARGIN * self.end
        return max(where - margin, 0.0), min(where + margin, self.end)

    def _doubt(self, test: Test, where: float) -> str:
        """Return the `reason` of a special point at which a test function changes its sign."""
        if not self.complete:
            return ORBITS_NOT_SOLVED
        size = max(abs(test(self.first)), abs(test(self.second)))
        left = abs(test(self.at(where))) / size if size > 0.0 else 0.0
        return "" if left <= SPECIAL_POINT_RESIDUAL else NOT_ZERO

    def _special(self, kind: SpecialType, test: Test, where: float, **graze: Any) -> Located:
        """Return the special point at a distance at which a test function changes its sign, as `special_point_at`."""
        doubt = self._doubt(test, where)
        return where, special_point_at(self.path, self.at(where), kind, doubt, **graze)

    def _neimark_sacker_test(self, point: ContinuationPoint) -> float:
        return neimark_sacker_test(point, self.path.count)

    def _rise(self, point: ContinuationPoint) -> float:
        """Return the parameter's component of the unit tangent."""
        tangent = self.path.tangent(point.unknowns, self.along)
        return 0.0 if tangent is None else float(tangent[-1])


def special_point_at(
    path: ContinuationProblem, orbit: ContinuationPoint, kind: SpecialType, reason: str, **graze: Any
) -> SpecialPoint:
    """Return the special point at an orbit of a path; unless it is given, its admissibility is that of the orbit."""
    impacts, impact = path.impacts(orbit.unknowns), graze.get("impact")
    if impact is not None:
        graze |= {"stop": int(impacts.stops[impact]), "phase": float(impacts.phases[impact])}
    return SpecialPoint(
        type=kind,
        values=orbit.values,
        reason=reason,
        impacts=impacts,
        multipliers=orbit.multipliers,
        **({"admissible": orbit.admissible} | graze),
    )


def _excess(point: ContinuationPoint) -> float:
    return max(point.excess, -1.0)  # it is -inf where there is no maximum between the impacts


def _outside(point: ContinuationPoint) -> int:
    """Return the number of multipliers outside the unit circle."""
    return int(np.sum(np.abs(point.multipliers) > 1.0))


def on_unit_circle(multipliers: Complexes) -> bool:
    """Return whether a complex pair lies on the unit circle."""
    off = np.abs(np.abs(multipliers[multipliers.imag != 0.0]) - 1.0)
    return bool(len(off)) and float(np.min(off)) < UNIT_CIRCLE_DISTANCE
