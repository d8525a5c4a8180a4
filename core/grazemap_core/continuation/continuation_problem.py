"""The equations that are continued: periodic orbits over one parameter, or several.

A point of the curve holds the phases of the impacts, their speeds and the parameters, all in units in which they are of
comparable size. The curve is smooth through grazing, where a speed is 0, and through saddle-nodes, where the parameter
turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.continuation.parameters import PARAMETERS, Parameter, ParameterPoint, domain, keeps_symmetry
from grazemap_core.continuation.point_equations import PointEquations
from grazemap_core.continuation.tolerances import (
    DIFFERENCE,
    PATH_EXACT,
    PATH_LARGEST_STEP,
    PATH_NEWTON_STEPS,
    RECENT_EQUATIONS,
)
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT, contact_scratch, further_contact
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, assemble, assemble_doubled
from grazemap_core.orbits.kernels.newton import NewtonScratch, allowed_share, newton_kantorovich, newton_scratch
from grazemap_core.orbits.states import multipliers_of, with_unseen
from grazemap_core.orbits.tolerances import MAX_KANTOROVICH, ORBIT_RESIDUAL, ORBIT_SETTLED
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class ContinuationPoint:
    """An orbit of the curve, with its multipliers, test functions and contacts."""

    unknowns: Floats
    """(2 k + p,) Phases, speeds and the p parameters, in the path's units."""
    values: ParameterPoint
    """The values of all parameters."""
    residual: float
    """Largest residual, in units of length."""
    kantorovich: float
    """As in `PeriodicOrbit`."""
    multipliers: Complexes
    """(2 N,) For symmetric motions: over half the period, followed by the mirror image."""
    fold_test: float
    """``prod v_i det(M - I)`` up to factors that do not vanish."""
    doubling_test: float
    """``prod v_i det(M + I)`` up to factors that do not vanish."""
    contact: int
    """Status of `admissibility.further_contact`."""
    excess: float
    """Height over a stop of the highest maximum between the impacts, in the path's unit of length."""
    excess_phase: float
    """Phase of this maximum."""
    excess_stop: int
    """Stop of this maximum."""

    @property
    def isolated(self) -> bool:
        """Whether the Newton-Kantorovich theorem holds: there is exactly one orbit near the numbers."""
        return self.kantorovich <= MAX_KANTOROVICH

    @property
    def admissible(self) -> bool:
        """Whether every impact velocity points at its stop, and the contact has no other contact with a stop."""
        return self.contact == NO_FURTHER_CONTACT


class ContinuationProblem:
    """Orbits of one sequence of stops over one parameter or several.

    Attributes
    ----------
    oscillator : Oscillator
        With the factors 1 of bias and forces.
    pattern : Pattern
        The number of periods, and whether the orbits are mirrored.
    sides : (k,)
    parameters : tuple of str
        The parameters that vary. The others keep their values in `fixed`.
    fixed : ParameterPoint
    units : dict of str to float
        The unknown of a parameter is its value over this.
    length : float
        Unit of length; that of speeds is omega times it.
    turn : float
        Phase after which the impacts repeat, or repeat on the opposite stops.
    mirror : float
        Factor from the signed velocities of one such span to those of the next: -1 for symmetric orbits.
    """

    def __init__(
        self,
        oscillator: Oscillator,
        pattern: Pattern,
        sides: Integers,
        parameters: tuple[Parameter, ...],
        fixed: ParameterPoint,
    ) -> None:
        """Take the values of all parameters at the start, in which those that vary have their units.

        The units of restitutions and of factors are 1, that of one clearance is the unit of length.
        """
        self.oscillator, self.pattern, self.parameters, self.fixed = oscillator, pattern, parameters, fixed
        self.sides = sides.astype(np.float64)
        self.count = len(sides)
        self.turn = pattern.half_periods * math.pi
        self.mirror = -1.0 if pattern.symmetric else 1.0
        self._equations = PointEquations(oscillator, RECENT_EQUATIONS)
        self.length = max(self._equations.forced(fixed, pattern).steady_size, self._equations.stops(fixed).unit)
        self.units = {name: self._unit(name) for name in parameters}

    @classmethod
    def through(
        cls, oscillator: Oscillator, impacts: ImpactSequence, parameter: Parameter, values: ParameterPoint
    ) -> tuple[ContinuationProblem, Floats]:
        """Return the path over a parameter through an orbit at these values, and its unknowns there.

        Symmetric orbits are continued as such if the parameter keeps the stops symmetric.
        """
        if not keeps_symmetry(oscillator, parameter):
            impacts = impacts.whole
        path = ContinuationProblem(oscillator, pattern_of(impacts), impacts.stops, (parameter,), values)
        return path, path.unknowns(impacts, values)

    def along_with(self, pattern: Pattern, sides: Floats) -> ContinuationProblem:
        """Return the problem of another sequence of stops (k,) over the same parameters, in the same units."""
        return ContinuationProblem(self.oscillator, pattern, sides.astype(np.int64), self.parameters, self.fixed)

    def _unit(self, name: Parameter) -> float:
        if name in ("omega", "clearance"):
            return self.fixed.value(name)
        if name not in PARAMETERS:
            return self.fixed.value(name) or 1.0
        return self.length if name.startswith("clearance") else 1.0

    @cached_property
    def _newton(self) -> NewtonScratch:
        return newton_scratch(self.count)

    def unknowns(self, impacts: ImpactSequence, values: ParameterPoint) -> Floats:
        """Return the unknowns of an orbit whose parameters have these values."""
        parameters = [values.value(name) / self.units[name] for name in self.parameters]
        return np.concatenate([impacts.phases, impacts.velocities / (values.omega * self.length), parameters])

    def values(self, unknowns: Floats) -> ParameterPoint:
        """Return the values of all parameters."""
        values = self.fixed
        for name, value in zip(self.parameters, unknowns[2 * self.count :].tolist(), strict=True):
            values = values.varied(name, value * self.units[name])
        return values

    def stops(self, unknowns: Floats) -> Stops:
        """Return the stops at a point."""
        return self._equations.stops(self.values(unknowns))

    def _problem(self, values: ParameterPoint) -> OrbitProblem:
        return self._equations.problem(values, self.pattern, self.length)

    def equations(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual, derivatives and terms of all equations of the path: those of its orbits."""
        return self.of_orbit(unknowns)

    def of_orbit(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual (2 k,), its derivatives by all unknowns (2 k, 2 k + p), and the size of its terms."""
        count, values = self.count, self.values(unknowns)
        columns: dict[Parameter, Floats] = {  # first, as they take other residuals
            name: self._by_structure(i, unknowns) for i, name in enumerate(self.parameters) if name not in PARAMETERS
        }
        _, impacts, terms = self._assemble(unknowns)
        jacobian = self._newton.jacobian
        derivatives = np.empty((2 * count, 2 * count + len(self.parameters)))
        derivatives[:, : 2 * count] = jacobian[:, : 2 * count]
        for i, name in enumerate(self.parameters):
            if name == "omega":
                columns[name] = jacobian[:, 2 * count]
            elif name == "forcing":
                columns[name] = self._by_forcing(unknowns, values)
            elif name.startswith("restitution"):
                columns[name] = self._by_restitution(name, impacts)
            elif name in PARAMETERS:
                columns[name] = self._by_gap(name, values)
            derivatives[:, 2 * count + i] = columns[name] * self.units[name]
        return self._newton.residual.copy(), derivatives, terms

    def _assemble(self, unknowns: Floats) -> tuple[OrbitProblem, OrbitImpacts, float]:
        """Write residual and Jacobian of the orbit's equations to the scratch.

        Returns the equations and the impacts, as the kernels take them, and the size of the equations' terms.
        """
        count, newton, values = self.count, self._newton, self.values(unknowns)
        problem, stops = self._problem(values), self._equations.stops(values)
        impacts = OrbitImpacts(stops, self.sides, unknowns[:count], unknowns[count : 2 * count])
        return problem, impacts, float(assemble(problem, impacts, newton.residual, newton.jacobian, newton.before))

    def _by_structure(self, index: int, unknowns: Floats) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a parameter of the structure, by differences.

        The differences only direct Newton's method and the path: what is solved for are the residuals.
        """
        place, residuals = 2 * self.count + index, []
        value = float(unknowns[place])
        sides = (value + DIFFERENCE, max(value - DIFFERENCE, 0.0))  # no parameter of a structure is negative
        for side in sides:
            moved = unknowns.copy()
            moved[place] = side
            self._assemble(moved)
            residuals.append(self._newton.residual.copy())
        return np.asarray((residuals[0] - residuals[1]) / ((sides[0] - sides[1]) * self.units[self.parameters[index]]))

    def direction(self, unknowns: Floats) -> Floats:
        """Return a unit tangent of the path; which of the two directions is arbitrary."""
        tangent: Floats = np.linalg.svd(self.equations(unknowns)[1])[2][-1]
        return tangent

    def tangent(self, unknowns: Floats, along: Floats) -> Floats | None:
        """Return the unit tangent of the path, in the direction of `along`; None where there is none."""
        _, derivatives, _ = self.equations(unknowns)
        right = np.zeros(len(unknowns))
        right[-1] = 1.0
        try:
            direction = np.linalg.solve(np.concatenate([derivatives, along[None]]), right)
        except np.linalg.LinAlgError:
            return None
        length = float(np.linalg.norm(direction))
        return direction / length if math.isfinite(length) else None

    def correct(self, guess: Floats, normal: Floats) -> tuple[Floats, int] | None:
        """Return the orbit in the hyperplane through a guess, and the Newton steps used; None when there is none near.

        `normal` is the normal of the hyperplane; the direction of a parameter gives the orbit at that value of it.
        """
        unknowns, count = guess.copy(), self.count
        offset = float(normal @ guess)
        settled = False
        for steps in range(PATH_NEWTON_STEPS + 1):
            values = self.values(unknowns)
            if not self._in_domain(values):
                return None
            residual, derivatives, terms = self.equations(unknowns)
            norm = float(np.abs(residual).max())
            if settled:
                return (unknowns, steps) if norm <= ORBIT_RESIDUAL * max(1.0, terms) else None
            right = np.concatenate([residual, [float(normal @ unknowns) - offset]])
            try:
                step = np.linalg.solve(np.concatenate([derivatives, normal[None]]), right)
            except np.linalg.LinAlgError:
                return None
            length = float(np.abs(step).max())
            problem = self._problem(values)
            if not (length < PATH_LARGEST_STEP and allowed_share(problem, unknowns[:count], -step[:count]) == 1.0):
                return None
            unknowns = unknowns - step
            settled = length <= ORBIT_SETTLED or norm <= PATH_EXACT * terms
        return None

    def impacts(self, unknowns: Floats) -> ImpactSequence:
        """Return the impacts of a point, its first phase brought into the first period."""
        count, period = self.count, self.pattern.multiple
        whole = 2.0 * math.pi * period
        phases = unknowns[:count] - math.floor(unknowns[0] / whole) * whole
        velocities = unknowns[count : 2 * count] * (self.values(unknowns).omega * self.length)
        return ImpactSequence(period, self.sides.astype(np.int64), phases, velocities, self.pattern.symmetric)

    def doubling_matrix(self, unknowns: Floats) -> Floats:
        """Return the matrix (2 k, 2 k) whose determinant is `doubling_test`."""
        problem, impacts, _ = self._assemble(unknowns)
        matrix = np.empty((2 * self.count, 2 * self.count))
        assemble_doubled(problem, impacts, self._newton.before, matrix)
        return matrix

    def evaluate(self, unknowns: Floats) -> ContinuationPoint:
        """Return a point with its multipliers, test functions and contacts."""
        newton, size, values = self._newton, 2 * self.count, self.values(unknowns)
        problem, impacts, terms = self._assemble(unknowns)
        residual = float(np.abs(newton.residual).max())
        kantorovich, _ = newton_kantorovich(problem, impacts, terms, newton)
        system = newton.jacobian[:, :size].copy()
        fold_test = eliminate(system, size)
        assemble_doubled(problem, impacts, newton.before, system)
        doubling_test = eliminate(system, size)
        scratch = contact_scratch(self.count, len(problem.decay))  # the parameters decide which blocks the contact sees
        contact, excess, phase, stop = further_contact(problem, impacts, -math.inf, scratch)
        return ContinuationPoint(
            unknowns=unknowns,
            values=values,
            residual=residual,
            kantorovich=float(kantorovich),
            multipliers=self._multipliers(values, problem, impacts),
            fold_test=float(fold_test),
            doubling_test=float(doubling_test),
            contact=int(contact),
            excess=float(excess),
            excess_phase=float(phase),
            excess_stop=int(stop),
        )

    def multipliers(self, unknowns: Floats) -> Complexes:
        """Return the multipliers (2N,) of a point."""
        problem, impacts, _ = self._assemble(unknowns)
        return self._multipliers(self.values(unknowns), problem, impacts)

    def _multipliers(self, values: ParameterPoint, problem: OrbitProblem, impacts: OrbitImpacts) -> Complexes:
        """Return the multipliers (2N,) of the impacts that were assembled last."""
        multipliers = multipliers_of(problem, impacts, self._newton.before)
        return with_unseen(self._equations.forced(values, self.pattern), multipliers)

    def _in_domain(self, values: ParameterPoint) -> bool:
        """Return whether Newton's method may try these values: the equations are analytic beyond the physical ones."""
        rebounds = 1.0 + values.restitution_right, 1.0 + values.restitution_left
        distance = values.clearance_right + values.clearance_left
        if any(value < domain(name)[0] for name, value in values.structure if name in self.parameters):
            return False
        return min(values.omega, values.forcing, distance, *rebounds) > 0.0

    def _by_gap(self, name: Parameter, values: ParameterPoint) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a clearance, or to the factor of the bias."""
        by_gap = -self.sides / self.length
        if name == "bias":  # which moves both stops the same way
            by_gap = -self.sides * self._equations.equilibrium(values) * by_gap
        elif name != "clearance":
            by_gap = np.where(self.sides == (1.0 if name == "clearance_right" else -1.0), by_gap, 0.0)
        return np.concatenate([by_gap, np.zeros(self.count)])

    def _by_forcing(self, unknowns: Floats, values: ParameterPoint) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to the factor of the forces."""
        problem = self._problem(values._replace(forcing=1.0))
        angles = np.outer(problem.orders, unknowns[: self.count])
        turned = (problem.steady @ np.array([1.0, 1j]))[:, None] / problem.steady_unit * np.exp(1j * angles)
        rates = problem.orders[:, None] * turned
        return np.concatenate([np.sum(turned.imag, axis=0), np.sum(rates.real, axis=0)])

    def _by_restitution(self, name: Parameter, impacts: OrbitImpacts) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a restitution: impulses are proportional to 1 + R.

        `_assemble` has written the Jacobian.
        """
        count, stops = self.count, impacts.stops
        by_speed = self._newton.jacobian[:, count : 2 * count].copy()
        by_speed[count + np.arange(count), np.arange(count)] += 1.0  # the unknown itself is no impulse
        rebound = 1.0 + np.where(self.sides > 0.0, stops.restitution_right, stops.restitution_left)
        weight = impacts.speeds / rebound
        if name != "restitution":
            weight = np.where(self.sides == (1.0 if name == "restitution_right" else -1.0), weight, 0.0)
        return np.asarray(by_speed @ weight)


def pattern_of(impacts: ImpactSequence) -> Pattern:
    """Return the number of periods of a sequence, and whether it is mirrored."""
    return Pattern(impacts.period, impacts.symmetric)


@dataclass(frozen=True, eq=False)
class OrbitCurve:
    """Orbits with k impacts each along a curve: m of them in its order."""

    points: tuple[ParameterPoint, ...]
    """(m,) The values of all parameters, point by point."""
    phases: Floats
    """(m, k) Forcing phases of the impacts, which change smoothly along the curve; for symmetric motions, those of half
    the period."""
    velocities: Floats
    """(m, k) Signed velocities before these impacts. An impact is virtual where the sign of its velocity is not that of
    its stop."""
    stops: Integers
    """(k,) Stops of the impacts."""
    period: int
    """Forcing periods after which the orbits repeat."""
    symmetric: bool
    """Whether the impacts are those of half the period; those of the other half are their mirror images."""
    residual: Floats
    """(m,) Residuals of the orbits, in units of length."""
    ends: tuple[str, str]
    """Keys of `pseudo_arclength.ENDS`: why the curve ends before its first point and after its last."""
    divisor: int = field(default=1, kw_only=True)
    """p: a period is ``2 pi/p`` in the phases of impacts."""

    def values_of(self, name: str) -> Floats:
        """Return the values (m,) of a field of `ParameterPoint`."""
        return np.array([getattr(point, name) for point in self.points], dtype=np.float64)

    @property
    def omega(self) -> Floats:
        """Forcing frequencies (m,)."""
        return self.values_of("omega")

    @property
    def clearance(self) -> Floats:
        """Clearances of both stops (m,); NaN where they differ."""
        right, left = self.values_of("clearance_right"), self.values_of("clearance_left")
        return np.where(right == left, right, np.nan)

    @property
    def restitution(self) -> Floats:
        """Restitutions (m,) of both stops, or of the only one; NaN where they differ."""
        return self.values_of("restitution")


def curve_fields(path: ContinuationProblem, points: Sequence[ContinuationPoint]) -> dict[str, Any]:
    """Return the fields of `OrbitCurve`, but `ends` and `divisor`, of points of a path."""
    count, unknowns = path.count, np.array([point.unknowns for point in points])
    omega = np.array([point.values.omega for point in points])
    return {
        "points": tuple(point.values for point in points),
        "phases": unknowns[:, :count].copy(),
        "velocities": unknowns[:, count : 2 * count] * (omega * path.length)[:, None],
        "stops": path.sides.astype(np.int64),
        "period": path.pattern.multiple,
        "symmetric": path.pattern.symmetric,
        "residual": np.array([point.residual for point in points]),
    }
