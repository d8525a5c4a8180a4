"""The stops and the equations of orbits, at any values of the parameters."""

from __future__ import annotations

from functools import lru_cache

from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.continuation.parameters import ParameterPoint, Structure
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import ForcedFamily, OrbitFamily
from grazemap_core.orbits.kernels.equations import OrbitProblem


class PointEquations:
    """The stops and the equations of orbits at points of the parameters.

    What depends on the structure, on the frequency or on both is computed once for them and kept: equilibria, families,
    these at a frequency, and equations. All functions raise the errors of `OrbitFamily.of` and `OrbitFamily.at`.
    """

    def __init__(self, oscillator: Oscillator, kept: int | None = None) -> None:
        """Take the oscillator with the factors 1 of bias and forces, and how many of each are kept; None: all."""
        self.oscillator = oscillator
        self._odd = oscillator.is_half_wave_symmetric
        keep = lru_cache(maxsize=kept)
        self._equilibrium = keep(self._new_equilibrium)
        self._family = keep(self._new_family)
        self._forced = keep(self._new_forced)
        self._problem = keep(self._new_problem)

    def equilibrium(self, values: ParameterPoint) -> float:
        """Return the contact coordinate at the static equilibrium, with the bias of the factor 1."""
        return self._equilibrium(values.structure)

    def stops(self, values: ParameterPoint) -> Stops:
        """Return the stops at a point."""
        return values.stops(self.equilibrium(values), self._odd)

    def family(self, values: ParameterPoint, pattern: Pattern) -> OrbitFamily:
        """Return the family of orbits of the structure at a point."""
        return self._family(values.structure, pattern)

    def forced(self, values: ParameterPoint, pattern: Pattern) -> ForcedFamily:
        """Return this family at the frequency of the point, under forces of the factor 1."""
        return self._forced(values.structure, pattern, values.omega)

    def problem(self, values: ParameterPoint, pattern: Pattern, length: float) -> OrbitProblem:
        """Return the equations of a family's orbits at a point, with `length` the unit of length."""
        problem, factor = self._problem(values.structure, pattern, values.omega, length), values.forcing
        if factor == 1.0:
            return problem
        return problem._replace(steady=factor * problem.steady, steady_by_omega=factor * problem.steady_by_omega)

    def _of(self, structure: Structure) -> Oscillator:
        return self.oscillator.with_structure(dict(structure))

    def _new_equilibrium(self, structure: Structure) -> float:
        return contact_equilibrium(self._of(structure))

    def _new_family(self, structure: Structure, pattern: Pattern) -> OrbitFamily:
        return OrbitFamily.of(self._of(structure), pattern.multiple, pattern.symmetric)

    def _new_forced(self, structure: Structure, pattern: Pattern, omega: float) -> ForcedFamily:
        return self._family(structure, pattern).at(omega)

    def _new_problem(self, structure: Structure, pattern: Pattern, omega: float, length: float) -> OrbitProblem:
        return self._forced(structure, pattern, omega).problem(length)
