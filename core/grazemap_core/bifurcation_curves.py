"""Curves of special orbits in the plane of forcing frequency and clearance.

A special point of a branch flows in: a saddle-node, period doubling, breaking of the symmetry, Neimark-Sacker point or
graze of a motion with any impacts. It is followed both ways in both parameters, its condition as one equation more; out
flow the curve's orbits, and why it ends where it does (theory, "Any impacting orbit").
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grazemap_core.branch_switching import with_graze
from grazemap_core.errors import ParameterError
from grazemap_core.grazing import checked_order
from grazemap_core.kernels.orbit_contacts import CLEAR
from grazemap_core.orbit_family import OrbitFamily
from grazemap_core.orbit_paths import OrbitPath, PathPoint
from grazemap_core.orbit_special_points import SpecialPoint, SpecialType, neimark_sacker_test, on_unit_circle
from grazemap_core.orbit_walks import walk
from grazemap_core.oscillator import Floats, Oscillator
from grazemap_core.tolerances import CURVE_DIFFERENCE, ORBIT_RESIDUAL


@dataclass(frozen=True, eq=False)
class BifurcationCurve:
    """A curve of special orbits: m of them in the order of the curve, with k impacts each.

    Attributes
    ----------
    type : {"SN", "PD", "SB", "NS", "GR"}
    omega, clearance : (m,)
    phases, velocities : (m, k)
        As in `OrbitBranch`. Of a GR the graze is one of the impacts, its velocity 0.
    stops : int (k,)
    impact : int or None
        GR only: which impact is the graze.
    period : int
    symmetric : bool
    multipliers : complex (m, 2N)
        Of half the period, mirrored, for symmetric motions. Of a GR one of them is infinite, or a large number.
    admissible : bool (m,)
        Mass 1 meets no stop but at the impacts; a GR's own graze does not count.
    residual : (m,)
        Of the orbit, in units of length.
    ends : (str, str)
        Keys of `orbit_walks.ENDS`: why the curve ends before its first point and behind its last.
    """

    type: SpecialType
    omega: Floats
    clearance: Floats
    phases: Floats
    velocities: Floats
    stops: NDArray[np.int64]
    impact: int | None
    period: int
    symmetric: bool
    multipliers: NDArray[np.complex128]
    admissible: NDArray[np.bool_]
    residual: Floats
    ends: tuple[str, str]


class SpecialPath(OrbitPath):
    """Orbits that obey one condition more: a test function vanishes."""

    def __init__(self, family: OrbitFamily, point: SpecialPoint, stops: NDArray[np.int64], impact: int | None) -> None:
        """Take the kind of the condition, and of a GR which impact's speed is 0."""
        fixed = {"clearance": point.clearance, "omega": point.omega, "restitution": point.restitution}
        super().__init__(family, stops, ("clearance", "omega"), fixed)
        self.kind, self.impact = point.type, impact

    def condition(self, unknowns: Floats) -> float:
        """Return the test function."""
        if self.impact is not None:
            return float(unknowns[self.count + self.impact])
        if self.kind == "SN":
            return self.determinants(unknowns)[0]
        if self.kind == "NS":
            return neimark_sacker_test(self.look(unknowns), self.count)
        return self.determinants(unknowns)[1]

    def equations(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return those of the orbit, and the condition with its gradient brought to length 1."""
        residual, derivatives, terms = self.of_orbit(unknowns)
        gradient = np.zeros(len(unknowns))
        if self.impact is not None:
            gradient[self.count + self.impact] = 1.0
        else:
            for i in range(len(unknowns)):
                ends = []
                for sign in (1.0, -1.0):
                    moved = unknowns.copy()
                    moved[i] += sign * CURVE_DIFFERENCE
                    ends.append(self.condition(moved))
                gradient[i] = (ends[0] - ends[1]) / (2.0 * CURVE_DIFFERENCE)
        length = float(np.linalg.norm(gradient))
        value = self.condition(unknowns)
        if length > 0.0:
            gradient, value = gradient / length, value / length
        return np.append(residual, value), np.concatenate([derivatives, gradient[None]]), terms


def bifurcation_curve(
    oscillator: Oscillator,
    point: SpecialPoint,
    omega: tuple[float, float],
    clearance: tuple[float, float],
    longest_step: float = 0.05,
    max_points: int = 500,
) -> BifurcationCurve:
    """Follow a special point both ways, until a parameter leaves its range.

    Parameters
    ----------
    oscillator : Oscillator
    point : SpecialPoint
        Of a branch of this oscillator, converged; its restitution, if it varied there, is that of the curve.
    omega, clearance : (float, float)
        Ranges, 0 < least < largest, with the point in them.
    longest_step : float
        As for `orbit_branch`.
    max_points : int
        In either direction.

    Raises
    ------
    ParameterError
        The point has not converged, or a number is out of range.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`, anywhere along the curve.
    """
    if point.status != "converged":
        raise ParameterError("point", "has not converged")
    for name, bounds, value in (("omega", omega, point.omega), ("clearance", clearance, point.clearance)):
        if not (0.0 < bounds[0] < bounds[1] < math.inf and bounds[0] <= value <= bounds[1]):
            raise ParameterError(name, "must be greater than 0, rise, and have the point between its ends")
    if not 0.0 < longest_step <= 1.0:
        raise ParameterError("longest_step", "must lie between 0 and 1")
    checked_order("max_points", max_points, 1)
    impacts, impact = point.impacts, point.impact
    if point.type == "GR" and impact is None:
        impacts, impact = with_graze(impacts, float(point.phase or 0.0), int(point.stop or 1))
    family = OrbitFamily.of(oscillator, impacts.period, impacts.symmetric)
    path = SpecialPath(family, point, impacts.stops, impact)
    start = path.unknowns(impacts, path.fixed)
    tangent = np.linalg.svd(path.equations(start)[1])[2][-1]
    refined = path.correct(start, tangent)  # points at which a branch ends on another one are known to its root only
    start = start if refined is None else refined[0]
    first = path.look(start)
    last = len(start) - 1
    limits = [
        (last - 1, clearance[0] / point.clearance, clearance[1] / point.clearance),
        (last, omega[0] / point.omega, omega[1] / point.omega),
    ]
    sides: list[list[PathPoint]] = []
    ends: list[str] = []
    for side in (tangent, -tangent):
        points: list[PathPoint] = []

        def visit(_: Floats, unknowns: Floats, __: bool, points: list[PathPoint] = points) -> str | None:
            found = path.look(unknowns)
            if point.type == "NS" and not on_unit_circle(found.multipliers):
                return "real"
            points.append(found)
            return None

        ends.append(walk(path, start, side, limits, longest_step, max_points, visit))
        sides.append(points)
        if ends[-1] == "closed":
            sides.append([])
            ends.append("closed")
            break
    whole = [*reversed(sides[1]), first, *sides[0]]
    return _curve(path, point.type, impact, whole, (ends[1], ends[0]))


def _curve(
    path: SpecialPath, kind: SpecialType, impact: int | None, points: list[PathPoint], ends: tuple[str, str]
) -> BifurcationCurve:
    count = path.count
    unknowns = np.array([found.unknowns for found in points])
    omega = np.array([found.omega for found in points])
    return BifurcationCurve(
        type=kind,
        omega=omega,
        clearance=np.array([found.clearance for found in points]),
        phases=unknowns[:, :count].copy(),
        velocities=unknowns[:, count : 2 * count] * (omega * path.length)[:, None],
        stops=path.stops.astype(np.int64),
        impact=impact,
        period=path.family.pattern.multiple,
        symmetric=path.family.pattern.symmetric,
        multipliers=np.array([found.multipliers for found in points]),
        admissible=np.array([_admissible(path, impact, found) for found in points]),
        residual=np.array([found.residual for found in points]),
        ends=ends,
    )


def _admissible(path: SpecialPath, impact: int | None, found: PathPoint) -> bool:
    if impact is None:
        return found.contact == CLEAR
    towards = found.unknowns[path.count : 2 * path.count] * path.stops
    return bool(np.all(np.delete(towards, impact) > 0.0)) and found.excess <= ORBIT_RESIDUAL
