"""The equations that are continued: periodic orbits over one parameter, or several.

A point of the curve holds the phases of the impacts, their speeds and the parameters, all in units in which they are of
comparable size. The curve is smooth through grazing, where a speed is 0, and through saddle-nodes, where the parameter
turns.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.stops import has_odd_harmonics_only
from grazemap_core.continuation.parameters import PARAMETERS, Parameter, ParameterPoint
from grazemap_core.continuation.tolerances import DIFFERENCE, PATH_EXACT, PATH_NEWTON_STEPS, RECENT_STRUCTURES
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits.family import OrbitFamily, forced, steady_size
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT, further_contact
from grazemap_core.orbits.kernels.batches import OrbitScratch, orbit_scratch
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, assemble, assemble_doubled
from grazemap_core.orbits.kernels.newton import allowed_share, newton_kantorovich
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
    family : OrbitFamily
    sides : (k,)
    parameters : tuple of str
        The parameters that vary. The others keep their values in `fixed`.
    fixed : ParameterPoint
    units : dict of str to float
        The unknown of a parameter is its value over this.
    length : float
        Unit of length; that of speeds is omega times it.
    """

    def __init__(
        self, family: OrbitFamily, sides: Integers, parameters: tuple[Parameter, ...], fixed: ParameterPoint
    ) -> None:
        """Take the values of all parameters at the start, in which those that vary have their units.

        The units of restitutions and of factors are 1, that of one clearance is the unit of length.
        """
        self.family = family
        self.sides = sides.astype(np.float64)
        self.parameters = parameters
        self.fixed = fixed
        self.count = len(sides)
        self._odd = has_odd_harmonics_only(family.oscillator)
        self._member_of = lru_cache(maxsize=RECENT_STRUCTURES)(self._member)
        self._problem_at = lru_cache(maxsize=RECENT_STRUCTURES)(self._problem_without_factor)
        self.length = max(steady_size(self.family_at(fixed).steady(fixed.omega)), self._stops_at(fixed).unit)
        self.units = {name: self._unit(name) for name in parameters}
        self._varying: tuple[float, ...] = ()
        self._point = (fixed, self._stops_at(fixed))
        self._structural = [(i, name) for i, name in enumerate(parameters) if name not in PARAMETERS]
        constant = [name for name in parameters if name != "bias" or not self._structural]
        self._by_gap = {name: self._derivative_by_gap(name, fixed) for name in constant}

    def _unit(self, name: Parameter) -> float:
        if name in ("omega", "clearance"):
            return self.fixed.value(name)
        if name not in PARAMETERS:
            return self.fixed.value(name) or 1.0
        return self.length if name.startswith("clearance") else 1.0

    def family_at(self, values: ParameterPoint) -> OrbitFamily:
        """Return the family of the structure at a point; those of the last structures are cached."""
        return self._member_of(values.structure)[0]

    def _member(self, structure: tuple[tuple[str, float], ...]) -> tuple[OrbitFamily, float]:
        """Return the family of a structure, and its equilibrium of the contact."""
        oscillator, family = self.family.oscillator.with_structure(dict(structure)), self.family
        if oscillator is not family.oscillator:
            family = OrbitFamily.of(oscillator, family.pattern.multiple, family.pattern.symmetric)
        return family, contact_equilibrium(oscillator)

    def _stops_at(self, values: ParameterPoint) -> Stops:
        return values.stops(self._member_of(values.structure)[1], self._odd)

    @cached_property
    def _scratch(self) -> OrbitScratch:
        return orbit_scratch(self.count, self.family.model.size)

    def unknowns(self, impacts: ImpactSequence, values: ParameterPoint) -> Floats:
        """Return the unknowns of an orbit whose parameters have these values."""
        parameters = [values.value(name) / self.units[name] for name in self.parameters]
        return np.concatenate([impacts.phases, impacts.velocities / (values.omega * self.length), parameters])

    def values(self, unknowns: Floats) -> ParameterPoint:
        """Return the values of all parameters."""
        return self._at(unknowns)[0]

    def stops(self, unknowns: Floats) -> Stops:
        """Return the stops at a point."""
        return self._at(unknowns)[1]

    def _at(self, unknowns: Floats) -> tuple[ParameterPoint, Stops]:
        """Return the values of all parameters, and the stops; the last ones are cached."""
        varying = tuple(unknowns[2 * self.count :].tolist())
        if varying != self._varying:
            point = self.fixed
            for name, value in zip(self.parameters, varying, strict=True):
                point = point.varied(name, value * self.units[name])
            self._varying, self._point = varying, (point, self._stops_at(point))
        return self._point

    def problem(self, values: ParameterPoint) -> OrbitProblem:
        """Return the equations with forces of the factor 1; those of the last frequencies and structures are cached."""
        return self._problem_at(values.omega, values.structure)

    def _problem_without_factor(self, omega: float, structure: tuple[tuple[str, float], ...]) -> OrbitProblem:
        family = self._member_of(structure)[0]
        return family.problem(omega, self.length, family.steady(omega))

    def problem_at(self, unknowns: Floats) -> OrbitProblem:
        """Return the equations at a point, as the kernels take them."""
        return self._problem_of(self.values(unknowns))

    def _problem_of(self, values: ParameterPoint) -> OrbitProblem:
        return forced(self.problem(values), values.forcing)

    def equations(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual, derivatives and terms of all equations of the path: those of its orbits."""
        return self.of_orbit(unknowns)

    def residual_at(self, unknowns: Floats) -> tuple[float, float]:
        """Return the largest residual of the equations of the path, and the size of its terms."""
        return self._residual_of_orbit(unknowns)

    def _residual_of_orbit(self, unknowns: Floats) -> tuple[float, float]:
        terms = self._assemble(unknowns)
        return float(np.abs(self._scratch.newton.residual).max()), terms

    def of_orbit(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual (2 k,), its derivatives by all unknowns (2 k, 2 k + p), and the size of its terms."""
        count, work = self.count, self._scratch.newton
        by_structure = {name: self._by_structure(i, unknowns) for i, name in self._structural}
        values, stops = self._at(unknowns)
        terms = self._assemble(unknowns)
        derivatives = np.empty((2 * count, 2 * count + len(self.parameters)))
        derivatives[:, : 2 * count] = work.jacobian[:, : 2 * count]
        for i, name in enumerate(self.parameters):
            if name in by_structure:
                column = by_structure[name]
            elif name == "omega":
                column = work.jacobian[:, 2 * count]
            elif name == "forcing":
                column = self._by_forcing(unknowns)
            elif name.startswith("restitution"):
                column = self._by_restitution(name, stops, unknowns)
            else:
                column = self._by_gap[name] if name in self._by_gap else self._derivative_by_gap(name, values)
            derivatives[:, 2 * count + i] = column * self.units[name]
        return work.residual.copy(), derivatives, terms

    def _assemble(self, unknowns: Floats) -> float:
        """Write residual and Jacobian of the orbit's equations to the scratch; return the size of their terms."""
        work, impacts = self._scratch.newton, self._impacts_of(unknowns, self.stops(unknowns))
        return float(assemble(self.problem_at(unknowns), impacts, work.residual, work.jacobian, work.before))

    def _impacts_of(self, unknowns: Floats, stops: Stops) -> OrbitImpacts:
        """Return the impacts of a point, as the kernels take them."""
        return OrbitImpacts(stops, self.sides, unknowns[: self.count], unknowns[self.count : 2 * self.count])

    def _by_structure(self, index: int, unknowns: Floats) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a parameter of the structure, by differences.

        The differences only direct Newton's method and the path: what is solved for are the residuals.
        """
        residuals, unit = [], self.units[self.parameters[index]]
        for side in (DIFFERENCE, -DIFFERENCE):
            moved = unknowns.copy()
            moved[2 * self.count + index] += side
            self._assemble(moved)
            residuals.append(self._scratch.newton.residual.copy())
        return np.asarray((residuals[0] - residuals[1]) / (2.0 * DIFFERENCE * unit))

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
            if settled:
                norm, terms = self.residual_at(unknowns)
                return (unknowns, steps) if norm <= ORBIT_RESIDUAL * max(1.0, terms) else None
            residual, derivatives, terms = self.equations(unknowns)
            norm = float(np.abs(residual).max())
            right = np.concatenate([residual, [float(normal @ unknowns) - offset]])
            try:
                step = np.linalg.solve(np.concatenate([derivatives, normal[None]]), right)
            except np.linalg.LinAlgError:
                return None
            length = float(np.abs(step).max())
            problem = self._problem_of(values)
            if not (length < 1.0 and allowed_share(problem, unknowns[:count], -step[:count]) == 1.0):
                return None
            unknowns = unknowns - step
            settled = length <= ORBIT_SETTLED or norm <= PATH_EXACT * terms
        return None

    def impacts(self, unknowns: Floats) -> ImpactSequence:
        """Return the impacts of a point, its first phase brought into the first period."""
        count, period = self.count, self.family.pattern.multiple
        whole = 2.0 * math.pi * period
        phases = unknowns[:count] - math.floor(unknowns[0] / whole) * whole
        velocities = unknowns[count : 2 * count] * (self.values(unknowns).omega * self.length)
        return ImpactSequence(period, self.sides.astype(np.int64), phases, velocities, self.family.pattern.symmetric)

    def doubling_matrix(self, unknowns: Floats) -> Floats:
        """Return the matrix (2 k, 2 k) whose determinant is `doubling_test`."""
        self._assemble(unknowns)
        matrix = np.empty((2 * self.count, 2 * self.count))
        impacts = self._impacts_of(unknowns, self.stops(unknowns))
        assemble_doubled(self.problem_at(unknowns), impacts, self._scratch.newton.before, matrix)
        return matrix

    def _determinants(self, problem: OrbitProblem, impacts: OrbitImpacts) -> tuple[float, float]:
        """Return the test functions of folds and of doublings. `_assemble` has written the Jacobian."""
        count = self.count
        system = self._scratch.newton.jacobian[:, : 2 * count].copy()
        fold_test = eliminate(system, 2 * count)
        assemble_doubled(problem, impacts, self._scratch.newton.before, system)
        return float(fold_test), float(eliminate(system, 2 * count))

    def evaluate(self, unknowns: Floats) -> ContinuationPoint:
        """Return a point with its multipliers, test functions and contacts."""
        scratch = self._scratch
        residual, terms = self._residual_of_orbit(unknowns)
        values, stops = self._at(unknowns)
        problem, impacts = self._problem_of(values), self._impacts_of(unknowns, stops)
        kantorovich, _ = newton_kantorovich(problem, impacts, terms, scratch.newton)
        fold_test, doubling_test = self._determinants(problem, impacts)
        contact, excess, phase, stop = further_contact(
            problem, impacts, -math.inf, scratch.flow_between, scratch.contact
        )
        return ContinuationPoint(
            unknowns=unknowns,
            values=values,
            residual=residual,
            kantorovich=float(kantorovich),
            multipliers=self._multipliers(self.family_at(values), problem, impacts),
            fold_test=fold_test,
            doubling_test=doubling_test,
            contact=int(contact),
            excess=float(excess),
            excess_phase=float(phase),
            excess_stop=int(stop),
        )

    def _multipliers(self, family: OrbitFamily, problem: OrbitProblem, impacts: OrbitImpacts) -> Complexes:
        """Return all multipliers over a span, by decreasing modulus."""
        of_blocks = multipliers_of(problem, impacts, self._scratch.newton.before)
        return with_unseen(family, problem.omega, of_blocks)

    def _in_domain(self, values: ParameterPoint) -> bool:
        """Return whether Newton's method may try these values: the equations are analytic beyond the physical ones."""
        rebounds = 1.0 + values.restitution_right, 1.0 + values.restitution_left
        distance = values.clearance_right + values.clearance_left
        structure = [value for name, value in values.structure if name in self.parameters]
        return min(values.omega, values.forcing, distance, *rebounds, *structure) > 0.0

    def _derivative_by_gap(self, name: Parameter, values: ParameterPoint) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a clearance, or to the factor of the bias."""
        by_gap = -self.sides / self.length
        if name == "bias":  # which moves both stops the same way
            by_gap = -self.sides * self._member_of(values.structure)[1] * by_gap
        elif name != "clearance":
            by_gap = np.where(self.sides == (1.0 if name == "clearance_right" else -1.0), by_gap, 0.0)
        return np.concatenate([by_gap, np.zeros(self.count)])

    def _by_forcing(self, unknowns: Floats) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to the factor of the forces."""
        problem = self.problem(self.values(unknowns))
        angles = np.outer(problem.orders, unknowns[: self.count])
        turned = (problem.steady @ np.array([1.0, 1j]))[:, None] / problem.steady_unit * np.exp(1j * angles)
        rates = problem.orders[:, None] * turned
        return np.concatenate([np.sum(turned.imag, axis=0), np.sum(rates.real, axis=0)])

    def _by_restitution(self, name: Parameter, stops: Stops, unknowns: Floats) -> Floats:
        """Return the residuals' derivatives (2 k,) with respect to a restitution: impulses are proportional to 1 + R.

        `of_orbit` has written the Jacobian.
        """
        count, jacobian = self.count, self._scratch.newton.jacobian
        by_speed = jacobian[:, count : 2 * count].copy()
        by_speed[count + np.arange(count), np.arange(count)] += 1.0  # the unknown itself is no impulse
        rebound = 1.0 + np.where(self.sides > 0.0, stops.restitution_right, stops.restitution_left)
        weight = unknowns[count : 2 * count] / rebound
        if name != "restitution":
            weight = np.where(self.sides == (1.0 if name == "restitution_right" else -1.0), weight, 0.0)
        return np.asarray(by_speed @ weight)
