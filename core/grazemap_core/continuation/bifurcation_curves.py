"""Bifurcation curves in a plane of two parameters, as forcing frequency and clearance, of motions with any impacts.

A curve is followed both ways from a special point of a branch: a saddle-node, period doubling, symmetry breaking,
Neimark-Sacker point or graze. The condition of the special point is one more equation (theory, "Any impacting orbit").
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.continuation.branch_switching import as_on_curve
from grazemap_core.continuation.continuation_problem import (
    ContinuationPoint,
    ContinuationProblem,
    OrbitCurve,
    curve_fields,
    pattern_of,
)
from grazemap_core.continuation.parameters import Parameter, check_interval, keeps_symmetry
from grazemap_core.continuation.pseudo_arclength import check_steps, follow_path
from grazemap_core.continuation.special_points import SpecialPoint, SpecialType, neimark_sacker_test, on_unit_circle
from grazemap_core.continuation.tolerances import CURVE_DIFFERENCE
from grazemap_core.errors import ParameterError
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.states import stable_beside
from grazemap_core.orbits.tolerances import ORBIT_RESIDUAL
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class BifurcationCurve(OrbitCurve):
    """A curve of special orbits: m of them in the order of the curve, with k impacts each.

    At the special point from which it is followed, the parameter that changes more along the curve increases. For a GR
    one of the impacts is the graze; its velocity is 0.
    """

    type: SpecialType
    """What is special about the orbits."""
    plane: tuple[Parameter, Parameter]
    """The two parameters that vary."""
    horizontal: Floats
    """(m,) Values of the first of them."""
    vertical: Floats
    """(m,) Values of the second one."""
    impact: int | None
    """GR only: index of the impact that is the graze."""
    multipliers: Complexes
    """(m, 2N) For symmetric motions: over half the period, followed by the mirror image. For a GR one of them is
    infinite, or a large number."""
    admissible: Booleans
    """(m,) There is no contact with a stop other than the impacts; the graze of a GR does not count."""
    stable_beside: Booleans
    """(m,) Whether the orbits on one side are stable: all multipliers but those of the type are inside the unit circle.
    At a GR they are those of the orbit without the graze."""


class BifurcationProblem(ContinuationProblem):
    """The equations of an orbit, and the condition that a test function vanishes."""

    def __init__(
        self,
        oscillator: Oscillator,
        point: SpecialPoint,
        impacts: ImpactSequence,
        impact: int | None,
        plane: tuple[Parameter, Parameter] = ("omega", "clearance"),
    ) -> None:
        """Take the impacts of the orbits and, for a GR, the index of the impact whose speed is 0."""
        super().__init__(oscillator, pattern_of(impacts), impacts.stops, (plane[1], plane[0]), point.values)
        self.kind, self.impact = point.type, impact

    def condition(self, unknowns: Floats) -> float:
        """Return the test function of a graze, or of a Neimark-Sacker point."""
        if self.impact is not None:
            return float(unknowns[self.count + self.impact])
        return neimark_sacker_test(self.evaluate(unknowns), self.count)

    def equations(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return the equations of the orbit and the condition; the condition's gradient is scaled to length 1."""
        residual, derivatives, terms = self.of_orbit(unknowns)
        if self.impact is not None:
            value, gradient = self.condition(unknowns), np.zeros(len(unknowns))
            gradient[self.count + self.impact] = 1.0
        elif self.kind == "NS":
            value, gradient = self._along_orbits(unknowns, residual, derivatives)
        elif self.kind == "SN":
            value, gradient = self._singular(derivatives[:, : 2 * self.count], self, unknowns, 1.0)
        else:
            value, gradient = self._doubled_singular(unknowns)
        length = float(np.linalg.norm(gradient))
        if length > 0.0:
            gradient, value = gradient / length, value / length
        return np.append(residual, value), np.concatenate([derivatives, gradient[None]]), terms

    def _along_orbits(self, unknowns: Floats, residual: Floats, derivatives: Floats) -> tuple[float, Floats]:
        """Return the condition at the orbit nearest to a guess, and its gradient along the orbits, by differences.

        Newton's method needs no other component of the gradient: the equations of the orbit determine the step across
        the surface of orbits, and the condition is evaluated after that step.
        """
        there = unknowns - np.linalg.lstsq(derivatives, residual, rcond=None)[0]
        gradient = np.zeros(len(unknowns))
        for direction in np.linalg.svd(derivatives)[2][2 * self.count :]:
            ends = [self.condition(there + side * CURVE_DIFFERENCE * direction) for side in (1.0, -1.0)]
            gradient += (ends[0] - ends[1]) / (2.0 * CURVE_DIFFERENCE) * direction
        return self.condition(there), gradient

    def multipliers_beside(self, orbit: ContinuationPoint) -> Complexes:
        """Return the multipliers (2N,) of a special orbit; at a graze those of the orbit without it."""
        if self.impact is None:
            return orbit.multipliers
        if self._without_graze is None:
            return np.zeros(len(orbit.multipliers), dtype=np.complex128)  # the steady motion attracts: modes are damped
        return self._without_graze.multipliers(
            np.delete(orbit.unknowns, [self.impact, self.count + self.impact]),
        )

    @cached_property
    def _without_graze(self) -> ContinuationProblem | None:
        """The problem of the orbits without the graze; None where it is their only impact."""
        assert self.impact is not None
        return self.along_with(self.pattern, np.delete(self.sides, self.impact)) if self.count > 1 else None

    def _doubled_singular(self, unknowns: Floats) -> tuple[float, Floats]:
        """Return `_singular` of the matrix of perturbations that return with the opposite sign.

        Over two spans these perturbations return unchanged. The equations are therefore those of the orbit over two
        spans. The second span of a symmetric motion is the mirror image of the first, and so is its perturbation.
        """
        count, mirror = self.count, self.mirror
        phases, speeds = unknowns[:count], unknowns[count : 2 * count]
        twice = np.concatenate([phases, phases + self.turn, speeds, mirror * speeds, unknowns[2 * count :]])
        value, whole = self._singular(self.doubling_matrix(unknowns), self._twice, twice, -mirror)
        by_phase = whole[:count] + whole[count : 2 * count]
        by_speed = whole[2 * count : 3 * count] + mirror * whole[3 * count : 4 * count]
        return value, 0.5 * np.concatenate([by_phase, by_speed, whole[4 * count :]])

    def _singular(
        self, matrix: Floats, path: ContinuationProblem, unknowns: Floats, repeat: float
    ) -> tuple[float, Floats]:
        """Return the smallest singular value of a matrix, with the sign of its determinant, and its gradient.

        With the left and right singular vectors u and w, the value is u J w, and its gradient is that of u J w at
        constant u and w. J w is the derivative of the equations along w, so the gradient is taken from the difference
        of two Jacobians, on either side along w.

        Parameters
        ----------
        matrix : (2 k, 2 k)
        path : ContinuationProblem
            Its Jacobian contains the matrix: that of one span, or that of two spans with the perturbations (w, -w).
        unknowns
            Unknowns of `path`.
        repeat : float
            Factor from the equations of the first span to those of the second.
        """
        left, sizes, right = np.linalg.svd(matrix)
        sign = 1.0 if np.linalg.slogdet(matrix)[0] >= 0.0 else -1.0
        first, change = left[:, -1], right[-1]
        if path is not self:
            count = self.count
            first = np.concatenate([first[:count], repeat * first[:count], first[count:], repeat * first[count:]])
            change = np.concatenate([change[:count], -change[:count], change[count:], repeat * change[count:]])
        aside = np.zeros(len(unknowns))
        aside[: len(change)] = CURVE_DIFFERENCE * change
        ahead, back = (path.of_orbit(unknowns + side * aside)[1] for side in (1.0, -1.0))
        return sign * float(sizes[-1]), sign * np.asarray(first @ (ahead - back)) / (2.0 * CURVE_DIFFERENCE)

    @cached_property
    def _twice(self) -> ContinuationProblem:
        """The problem of the same orbits over two spans; of symmetric orbits, over the whole period."""
        pattern = Pattern(self.pattern.multiple * (1 if self.pattern.symmetric else 2), symmetric=False)
        return self.along_with(pattern, np.concatenate([self.sides, self.mirror * self.sides]))


@in_own_period
def bifurcation_curve(
    oscillator: Oscillator,
    point: SpecialPoint,
    horizontal: tuple[float, float],
    vertical: tuple[float, float],
    longest_step: float = 0.05,
    max_points: int = 500,
    plane: tuple[Parameter, Parameter] = ("omega", "clearance"),
) -> BifurcationCurve:
    """Follow a special point both ways, until a parameter leaves its range.

    Parameters
    ----------
    oscillator : Oscillator
    point : SpecialPoint
        Converged special point of a branch of this oscillator, which is that with the factors 1 of bias and forces. The
        parameters that do not vary are those of the point.
    horizontal, vertical : (float, float)
        Ranges of the two parameters that vary, minimum < maximum, that contain the point; as in `orbit_branch`.
    longest_step : float
        As for `orbit_branch`.
    max_points : int
        Maximum number of points in either direction.
    plane : (str, str)
        The two parameters that vary, of `parameters.PARAMETERS`.

    Raises
    ------
    ParameterError
        The point has not converged, or a number is out of range.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`, anywhere along the curve.
    """
    if point.reason:
        raise ParameterError("point", f"has not converged: {point.reason}")
    for name, bounds in zip(plane, (horizontal, vertical), strict=True):
        check_interval(name, *bounds, named=name)
        if not bounds[0] <= point.values.value(name) <= bounds[1]:
            raise ParameterError(name, "must be two increasing numbers with the point between them")
    check_steps(longest_step, max_points)
    impacts, impact = as_on_curve(point)
    if impacts.symmetric and not all(keeps_symmetry(oscillator, name) for name in plane):
        if point.type == "SB":
            raise ParameterError("plane", "has a parameter that breaks the symmetry, so there are no SB points in it")
        impacts = impacts.whole
    path = BifurcationProblem(oscillator, point, impacts, impact, plane)
    start = path.unknowns(impacts, path.fixed)
    tangent = path.direction(start)
    of_plane = tangent[-2:]
    if of_plane[np.argmax(np.abs(of_plane))] < 0.0:
        tangent = -tangent
    refined = path.correct(start, tangent)  # accurate to the square root of round-off where branches meet
    start = start if refined is None else refined[0]
    first = path.evaluate(start)
    last = len(start) - 1
    limits = [
        (last - 1, vertical[0] / path.units[plane[1]], vertical[1] / path.units[plane[1]]),
        (last, horizontal[0] / path.units[plane[0]], horizontal[1] / path.units[plane[0]]),
    ]

    def follow(side: Floats) -> tuple[list[ContinuationPoint], str]:
        points: list[ContinuationPoint] = []

        def visit(_: Floats, unknowns: Floats, __: bool) -> str | None:
            orbit = path.evaluate(unknowns)
            if point.type == "NS" and not on_unit_circle(orbit.multipliers):
                return "real"
            points.append(orbit)
            return None

        return points, follow_path(path, start, side, limits, longest_step, max_points, visit)

    after, end = follow(tangent)
    before, beginning = ([], end) if end == "closed" else follow(-tangent)
    points = [*reversed(before), first, *after]
    across, up = (np.array([orbit.values.value(name) for orbit in points]) for name in plane)
    return BifurcationCurve(
        **curve_fields(path, points),
        type=point.type,
        plane=plane,
        horizontal=across,
        vertical=up,
        impact=impact,
        multipliers=np.array([orbit.multipliers for orbit in points]),
        admissible=np.array([_admissible(path, orbit) for orbit in points]),
        stable_beside=stable_beside(point.type, np.array([path.multipliers_beside(orbit) for orbit in points])),
        ends=(beginning, end),
    )


def _admissible(path: BifurcationProblem, point: ContinuationPoint) -> bool:
    if path.impact is None:
        return point.admissible
    towards = point.unknowns[path.count : 2 * path.count] * path.sides
    return bool(np.all(np.delete(towards, path.impact) > 0.0)) and point.excess <= ORBIT_RESIDUAL
