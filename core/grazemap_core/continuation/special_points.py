"""Special points between two neighbouring orbits of a branch: where a test function changes its sign.

Two points of a path flow in, with the tangent at the first; out flow saddle-nodes, period doublings, breakings of the
symmetry, Neimark-Sacker points and grazes between them, each solved for along the path to round-off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.continuation.continuation_problem import OrbitPath, PathPoint
from grazemap_core.continuation.tolerances import PATH_BESIDE, PATH_MERGED, PATH_TEST, PATH_UNIT_CIRCLE
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.tolerances import EPSILON

LARGEST_MULTIPLIER = 1e100
"""One beyond it counts as infinite."""

SpecialType = Literal["SN", "PD", "SB", "NS", "GR"]


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A special point of a branch.

    Attributes
    ----------
    type : {"SN", "PD", "SB", "NS", "GR"}
    clearance, omega, restitution : float
    status : {"converged", "guess"}
        "guess": a test function changes its sign there, but does not vanish to round-off. So it is where a branch ends
        on another one, for lack of a tangent; the parameter is good to round-off there, the orbit to its root.
    test : float
        What is left of the test function, relative to its values at the neighbouring points.
    admissible : bool
        The orbit there is a motion; of a GR: the orbits on one side of it are.
    impacts : ImpactSequence
    multipliers : complex (2 N,)
        Of half the period, mirrored, for symmetric motions.
    segment : int
        It lies between this point of the branch and the next.
    stop, phase : int, float, or None
        GR only: on which stop, and at which forcing phase.
    impact : int or None
        GR only: number of the impact that vanishes; None where a further contact appears.
    """

    type: SpecialType
    clearance: float
    omega: float
    restitution: float
    status: Literal["converged", "guess"]
    test: float
    admissible: bool
    impacts: ImpactSequence
    multipliers: Complexes
    segment: int = -1
    stop: int | None = None
    phase: float | None = None
    impact: int | None = None


def neimark_sacker_test(point: PathPoint, count: int) -> float:
    """Return a function that changes its sign where a pair of multipliers passes the unit circle.

    The product of ``(1 - mu_i mu_j)`` over pairs, each factor brought to size 1, with the sign that infinite
    multipliers take from it at an impact of speed 0. Real pairs mu, 1/mu are zeros too, and are told apart there.
    """
    mu = np.where(np.abs(point.multipliers) < LARGEST_MULTIPLIER, point.multipliers, LARGEST_MULTIPLIER)
    first, second = np.triu_indices(len(mu), 1)
    products = mu[first] * mu[second]
    factors = (1.0 - products) / (1.0 + np.abs(products))
    sign = float(np.prod(np.sign(point.unknowns[count : 2 * count]))) ** (len(mu) - 1)
    return sign * float(np.prod(factors).real)


class Segment:
    """A piece of a path between two points that were found, and all points between them."""

    def __init__(self, path: OrbitPath, first: PathPoint, second: PathPoint, along: Floats) -> None:
        """Take the unit tangent at the first point."""
        self.path, self.first, self.second, self.along = path, first, second, along
        self.end = float(along @ (second.unknowns - first.unknowns))
        self.complete = True
        self._known = {0.0: first, self.end: second}

    def at(self, distance: float) -> PathPoint:
        """Return the point at a distance along the tangent; the nearest end where Newton's method fails there."""
        if distance not in self._known:
            share = distance / self.end
            guess = self.first.unknowns + share * (self.second.unknowns - self.first.unknowns)
            found = self.path.correct(guess, self.along)
            self.complete &= found is not None
            if found is None:
                return self.first if share < 0.5 else self.second
            self._known[distance] = self.path.look(found[0])
        return self._known[distance]

    def zero(self, test: Callable[[PathPoint], float], low: float, high: float) -> float | None:
        """Return where a test function changes its sign between two distances, or None where it does not."""
        at_low, at_high = test(self.at(low)), test(self.at(high))
        if not (math.isfinite(at_low) and math.isfinite(at_high)) or at_low == 0.0:
            return None
        if at_high == 0.0:
            return high
        if (at_low > 0.0) == (at_high > 0.0):  # their product may be too small for a number
            return None
        return float(brentq(lambda s: test(self.at(s)), low, high, xtol=EPSILON * self.end, rtol=4.0 * EPSILON))

    def special_points(self, turns: bool) -> list[SpecialPoint]:
        """Return the special points of the piece in order; `turns` says that its parameter does."""
        count = self.path.count
        symmetric = self.path.family.pattern.symmetric
        found: list[tuple[float, SpecialPoint]] = []

        def add(kind: SpecialType, test: Callable[[PathPoint], float], where: float, **details: object) -> None:
            point = self.at(where)
            size = max(abs(test(self.first)), abs(test(self.second)))
            left = abs(test(point)) / size if size > 0.0 else 0.0
            converged = self.complete and left <= PATH_TEST
            admissible = bool(details.pop("admissible", point.admissible))
            found.append(
                (
                    where,
                    SpecialPoint(
                        type=kind,
                        clearance=point.clearance,
                        omega=point.omega,
                        restitution=point.restitution,
                        status="converged" if converged else "guess",
                        test=left,
                        admissible=admissible,
                        impacts=self.path.impacts(point.unknowns),
                        multipliers=point.multipliers,
                        **details,  # type: ignore[arg-type]
                    ),
                )
            )

        def same(point: PathPoint) -> float:
            return point.same

        def doubled(point: PathPoint) -> float:
            return point.doubled

        def sacker(point: PathPoint) -> float:
            return neimark_sacker_test(point, count)

        if turns:
            where = self.zero(same, 0.0, self.end)
            if where is not None:
                add(self._fold(self.at(where)), same, where)
            else:  # the end on another branch: there it only touches zero
                where = self.zero(self._rise, 0.0, self.end)
                if where is not None:
                    add(self._fold(self.at(where)), self._rise, where)
        where = self.zero(doubled, 0.0, self.end)
        if where is not None:
            add("SB" if symmetric else "PD", doubled, where)
        where = self.zero(sacker, 0.0, self.end)
        if where is not None and on_unit_circle(self.at(where).multipliers):
            add("NS", sacker, where)

        grazes: list[tuple[float, float]] = []
        for i in range(count):

            def speed(point: PathPoint, i: int = i) -> float:
                return float(point.unknowns[count + i])

            where = self.zero(speed, 0.0, self.end)
            if where is not None:
                # at the graze itself other contacts may begin as well, and round-off would decide
                margin = PATH_BESIDE * self.end
                sides = [max(where - margin, 0.0), min(where + margin, self.end)]
                admissible = any(self.at(side).admissible for side in sides)
                phase = float(self.path.impacts(self.at(where).unknowns).phases[i])
                stop = int(self.path.stops[i])
                add("GR", speed, where, admissible=admissible, stop=stop, phase=phase, impact=i)
                grazes.append((sides[0], sides[1]))
        low = 0.0
        between: list[tuple[float, float]] = []
        for before, behind in [*sorted(grazes), (self.end, self.end)]:
            if low < before:
                between.append((low, before))
            low = max(low, behind)
        for low, high in between:
            middle = self.at(0.5 * (low + high))
            if not np.all(middle.unknowns[count : 2 * count] * self.path.stops > 0.0):
                continue  # virtual impacts: no orbit on either side is a motion
            where = self.zero(_excess, low, high)
            if where is not None:
                point = self.at(where)
                whole = 2.0 * math.pi * self.path.family.pattern.multiple
                phase = point.excess_phase - math.floor(point.unknowns[0] / whole) * whole
                add("GR", _excess, where, admissible=True, stop=point.excess_stop, phase=phase)
        return [point for _, point in sorted(found, key=lambda item: item[0])]

    def _rise(self, point: PathPoint) -> float:
        """Return the parameter's part of the unit tangent."""
        tangent = self.path.tangent(point.unknowns, self.along)
        return 0.0 if tangent is None else float(tangent[-1])

    def _fold(self, point: PathPoint) -> SpecialType:
        """Say what it is where the parameter turns: a branch that ends on another one turns there as well."""
        impacts = self.path.impacts(point.unknowns)
        if impacts.repeats_after(PATH_MERGED) < impacts.period:
            return "PD"
        return "SB" if not impacts.symmetric and impacts.mirrors(PATH_MERGED) else "SN"


def _excess(point: PathPoint) -> float:
    return max(point.excess, -1.0)


def on_unit_circle(multipliers: Complexes) -> bool:
    """Say whether a complex pair lies on the unit circle."""
    off = np.abs(np.abs(multipliers[multipliers.imag != 0.0]) - 1.0)
    return bool(len(off)) and float(np.min(off)) < PATH_UNIT_CIRCLE
