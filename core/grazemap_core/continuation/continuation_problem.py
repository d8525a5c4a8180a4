"""The equations that are continued: periodic orbits over one parameter, or several.

A point of the curve holds the phases of the impacts, their speeds and the parameters, all in units in which they are of
comparable size. The curve is smooth through grazing, where a speed is 0, and through saddle-nodes, where the parameter
turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from grazemap_core.arrays import Complexes, Floats, Integers
from grazemap_core.continuation.tolerances import PATH_EXACT, PATH_NEWTON_STEPS
from grazemap_core.numerics.kernels.dense import eliminate
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import CLEAR, further_contact
from grazemap_core.orbits.kernels.batches import OrbitScratch, orbit_scratch
from grazemap_core.orbits.kernels.equations import OrbitProblem, assemble, assemble_doubled
from grazemap_core.orbits.kernels.newton import allowed_share, newton_kantorovich
from grazemap_core.orbits.states import multipliers_of
from grazemap_core.orbits.tolerances import MAX_KANTOROVICH, ORBIT_RESIDUAL, ORBIT_SETTLED

Parameter = Literal["clearance", "omega", "restitution"]

_ABOVE = {"clearance": 0.0, "omega": 0.0, "restitution": -1.0}
"""Newton's method may try any value above these: the equations are analytic in a restitution beyond [0, 1] too."""


@dataclass(frozen=True, eq=False)
class ContinuationPoint:
    """An orbit of the curve, with its multipliers, test functions and contacts.

    Attributes
    ----------
    unknowns : (2 k + p,)
        Phases, speeds and the p parameters, in the path's units.
    clearance, omega, restitution : float
    residual : float
        Largest residual, in units of length.
    kantorovich : float
        As in `PeriodicOrbit`.
    multipliers : complex (2 N,)
        For symmetric motions: over half the period, followed by the mirror image.
    fold_test, doubling_test : float
        ``prod v_i det(M - I)`` and ``prod v_i det(M + I)`` up to factors that do not vanish.
    contact : int
        Status of `admissibility.further_contact`.
    excess, excess_phase : float
    excess_stop : int
        The highest maximum between the impacts, in the path's unit of length.
    """

    unknowns: Floats
    clearance: float
    omega: float
    restitution: float
    residual: float
    kantorovich: float
    multipliers: Complexes
    fold_test: float
    doubling_test: float
    contact: int
    excess: float
    excess_phase: float
    excess_stop: int

    @property
    def isolated(self) -> bool:
        """Whether the Newton-Kantorovich theorem holds: there is exactly one orbit near the numbers."""
        return self.kantorovich <= MAX_KANTOROVICH

    @property
    def admissible(self) -> bool:
        """Whether every impact velocity points at its stop, and mass 1 has no other contact with a stop."""
        return self.contact == CLEAR


class ContinuationProblem:
    """Orbits of one sequence of stops over one parameter or several.

    Attributes
    ----------
    family : OrbitFamily
    stops : (k,)
    parameters : tuple of str
        The parameters that vary. The others keep their values in `fixed`.
    units : dict of str to float
        The unknown of a parameter is its value over this.
    length : float
        Unit of length; that of speeds is omega times it.
    """

    def __init__(
        self, family: OrbitFamily, stops: Integers, parameters: tuple[Parameter, ...], fixed: dict[str, float]
    ) -> None:
        """Take the values of the parameters at the start, which are also their units; the unit of restitution is 1.

        A restitution that is not in `fixed` is that of the family's oscillator.
        """
        self.family = family
        self.stops = stops.astype(np.float64)
        self.parameters = parameters
        self.fixed = {"restitution": family.oscillator.restitution, **fixed}
        self.units = {**self.fixed, "restitution": 1.0}
        self.count = len(stops)
        self.length = max(abs(family.steady(fixed["omega"])[0]), fixed["clearance"])
        self._problem: OrbitProblem | None = None

    @cached_property
    def _scratch(self) -> OrbitScratch:
        return orbit_scratch(self.count, self.family.model.size)

    def unknowns(self, impacts: ImpactSequence, values: dict[str, float]) -> Floats:
        """Return the unknowns of an orbit whose parameters have these values."""
        parameters = [values[name] / self.units[name] for name in self.parameters]
        return np.concatenate([impacts.phases, impacts.velocities / (values["omega"] * self.length), parameters])

    def value(self, unknowns: Floats, name: str) -> float:
        """Return the value of a parameter."""
        if name not in self.parameters:
            return self.fixed[name]
        return float(unknowns[2 * self.count + self.parameters.index(name)]) * self.units[name]

    def problem(self, omega: float, restitution: float | None = None) -> OrbitProblem:
        """Return the equations at a frequency and a restitution, by default that of `fixed`; the last is cached."""
        if self._problem is None or self._problem.omega != omega:
            self._problem = self.family.problem(omega, self.length, self.family.steady(omega))
        value = self.fixed["restitution"] if restitution is None else restitution
        if self._problem.restitution != value:
            self._problem = self._problem._replace(restitution=value, rebound=1.0 + value)
        return self._problem

    def problem_at(self, unknowns: Floats) -> OrbitProblem:
        """Return the equations at a point, as the kernels take them."""
        return self.problem(self.value(unknowns, "omega"), self.value(unknowns, "restitution"))

    def equations(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual, derivatives and terms of all equations of the path: those of its orbits."""
        return self.of_orbit(unknowns)

    def of_orbit(self, unknowns: Floats) -> tuple[Floats, Floats, float]:
        """Return residual (2 k,), its derivatives by all unknowns (2 k, 2 k + p), and the size of its terms."""
        count, work = self.count, self._scratch.newton
        problem = self.problem_at(unknowns)
        terms = assemble(
            problem,
            self.stops,
            self.value(unknowns, "clearance"),
            unknowns[:count],
            unknowns[count : 2 * count],
            work.residual,
            work.jacobian,
            work.before,
        )
        derivatives = np.empty((2 * count, 2 * count + len(self.parameters)))
        derivatives[:, : 2 * count] = work.jacobian[:, : 2 * count]
        for i, name in enumerate(self.parameters):
            if name == "restitution":
                derivatives[:, 2 * count + i] = _by_restitution(problem, unknowns[:count], work.before)
                continue
            column = 2 * count + (0 if name == "clearance" else 1)
            derivatives[:, 2 * count + i] = work.jacobian[:, column] * self.units[name]
        return work.residual.copy(), derivatives, terms

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
            if not all(self.value(unknowns, name) > _ABOVE[name] for name in self.parameters):
                return None
            residual, derivatives, terms = self.equations(unknowns)
            norm = float(np.max(np.abs(residual)))
            if settled:
                return (unknowns, steps) if norm <= ORBIT_RESIDUAL * max(1.0, terms) else None
            right = np.append(residual, float(normal @ unknowns) - offset)
            try:
                step = np.linalg.solve(np.concatenate([derivatives, normal[None]]), right)
            except np.linalg.LinAlgError:
                return None
            length = float(np.max(np.abs(step)))
            problem = self.problem_at(unknowns)
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
        velocities = unknowns[count : 2 * count] * (self.value(unknowns, "omega") * self.length)
        return ImpactSequence(period, self.stops.astype(np.int64), phases, velocities, self.family.pattern.symmetric)

    def doubling_matrix(self, unknowns: Floats) -> Floats:
        """Return the matrix (2 k, 2 k) whose determinant is `doubling_test`."""
        self.of_orbit(unknowns)
        matrix = np.empty((2 * self.count, 2 * self.count))
        phases, speeds = unknowns[: self.count], unknowns[self.count : 2 * self.count]
        assemble_doubled(self.problem_at(unknowns), phases, speeds, self._scratch.newton.before, matrix)
        return matrix

    def _determinants(self, problem: OrbitProblem, unknowns: Floats, derivatives: Floats) -> tuple[float, float]:
        count = self.count
        system = derivatives[:, : 2 * count].copy()
        fold_test = eliminate(system, 2 * count)
        speeds = unknowns[count : 2 * count]
        assemble_doubled(problem, unknowns[:count], speeds, self._scratch.newton.before, system)
        return float(fold_test), float(eliminate(system, 2 * count))

    def evaluate(self, unknowns: Floats) -> ContinuationPoint:
        """Return a point with its multipliers, test functions and contacts."""
        count, scratch = self.count, self._scratch
        residual, derivatives, terms = self.of_orbit(unknowns)
        phases, speeds = unknowns[:count], unknowns[count : 2 * count]
        omega, clearance = self.value(unknowns, "omega"), self.value(unknowns, "clearance")
        problem = self.problem_at(unknowns)
        kantorovich, _ = newton_kantorovich(problem, speeds, terms, scratch.newton)
        fold_test, doubling_test = self._determinants(problem, unknowns, derivatives)
        contact, excess, phase, stop = further_contact(
            problem, self.stops, clearance, phases, speeds, -math.inf, scratch.flow_between, scratch.contact
        )
        return ContinuationPoint(
            unknowns=unknowns,
            clearance=clearance,
            omega=omega,
            restitution=self.value(unknowns, "restitution"),
            residual=float(np.max(np.abs(residual))),
            kantorovich=float(kantorovich),
            multipliers=multipliers_of(problem, phases, speeds, scratch.newton.before),
            fold_test=fold_test,
            doubling_test=doubling_test,
            contact=int(contact),
            excess=float(excess),
            excess_phase=float(phase),
            excess_stop=int(stop),
        )


def _by_restitution(problem: OrbitProblem, phases: Floats, before: Floats) -> Floats:
    """Return the residuals' derivatives (2 k,): all terms but the steady motion are proportional to 1 + R."""
    sine, cosine = np.sin(phases), np.cos(phases)
    place = problem.steady_real * sine + problem.steady_imag * cosine
    rate = problem.steady_real * cosine - problem.steady_imag * sine
    return np.concatenate([before[:, 0] - place, before[:, 1] - rate]) / problem.rebound
