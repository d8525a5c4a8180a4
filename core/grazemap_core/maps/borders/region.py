"""A region of an unfolding map: connected points with one family of orbits, and the equations of these orbits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import field
from functools import cached_property
from typing import Final

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.contact.stops import has_odd_harmonics_only
from grazemap_core.continuation.parameters import PARAMETERS, ParameterPoint
from grazemap_core.maps.borders.motion_grid import MotionGrid, MotionName, Point
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.batches import solve_sequences
from grazemap_core.orbits.family import OrbitFamily, forced, steady_size
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED
from grazemap_core.orbits.tolerances import ORBIT_FLOOR
from grazemap_core.records import NamedTuple, dataclass

Structure = tuple[tuple[str, float], ...]
_OF_GAPS: Final = ("clearance", "clearance_right", "clearance_left", "bias")


class PointEquations:
    """The equations at all points of a grid, set up once for each period, frequency, structure and size of the forces.

    Symmetric motions have other equations than the rest.
    """

    def __init__(self, grid: MotionGrid) -> None:
        """Take the grid; the equations are set up on first use."""
        self._grid = grid
        self._odd = has_odd_harmonics_only(grid.plane.oscillator)
        self._equilibria: dict[Structure, float] = {}
        self._families: dict[tuple[int, bool, Structure], OrbitFamily] = {}
        self._problems: dict[tuple[int, bool, Structure, float, float], OrbitProblem] = {}

    def stops(self, point: Point) -> Stops:
        """Return the stops at a point."""
        values = self._grid.parameters_at(point)
        if values.structure not in self._equilibria:
            self._equilibria[values.structure] = contact_equilibrium(self._oscillator(values))
        return values.stops(self._equilibria[values.structure], self._odd)

    def _oscillator(self, values: ParameterPoint) -> Oscillator:
        """Return the oscillator with the structure at a point, and the factors 1."""
        return self._grid.plane.oscillator.with_structure(dict(values.structure))

    @cached_property
    def _unit(self) -> float:
        """The largest unit of the stops at a corner of the map."""
        rows, columns = ((0, size - 1) for size in self._grid.plane.shape)
        return max(self.stops(corner).unit for corner in itertools.product(rows, columns))

    def problem(self, period: int, symmetric: bool, point: Point) -> OrbitProblem:
        """Return the problem of a point.

        Raises
        ------
        ParameterError, SteadyMotionError, ConditioningError
            As for `OrbitFamily.of`.
        """
        values = self._grid.parameters_at(point)
        kind = (period, symmetric, values.structure)
        key = (*kind, values.omega, values.forcing)
        if key not in self._problems:
            if kind not in self._families:
                self._families[kind] = OrbitFamily.of(self._oscillator(values), period, symmetric)
            family = self._families[kind]
            steady = family.steady(values.omega)
            length = max(values.forcing * steady_size(steady), self._unit)
            self._problems[key] = forced(family.problem(values.omega, length, steady), values.forcing)
        return self._problems[key]


class SolvedOrbits(NamedTuple):
    """Orbits at several points of a column."""

    phases: Floats
    """(p, k) Phases of the impacts."""
    velocities: Floats
    """(p, k) Velocities before the impacts."""
    fine: Booleans
    """(p,) Whether the orbit is accepted."""


@dataclass(eq=False)
class Region:
    """A connected set of points with one family of orbits."""

    name: MotionName
    """The name of its motion."""
    period: int
    """Forcing periods after which the orbits repeat."""
    stops: Integers
    """(k,) Stops of the impacts; for symmetric motions, those of half the period."""
    symmetric: bool
    """Whether the impacts are those of half the period."""
    grid: MotionGrid
    """The map."""
    equations: PointEquations
    """The equations of the orbits at the points of the map."""
    orbits: dict[Point, tuple[Floats, Floats]] = field(default_factory=dict)
    """Phases and velocities of the impacts, (k,) each, by point."""

    def speed_unit(self, point: Point) -> float:
        """Return the unit of speeds at a point: omega times the size of a motion between the stops."""
        stops, problem = self.equations.stops(point), self.equations.problem(self.period, self.symmetric, point)
        return problem.omega * min(0.5 * (stops.right + stops.left), problem.length)

    def sequence(self, point: Point) -> ImpactSequence:
        """Return the impacts at a point."""
        return self._sequence(*self.orbits[point])

    def solve(self, points: Sequence[Point], guesses: Sequence[tuple[Floats, Floats]]) -> SolvedOrbits:
        """Solve for the orbits at points, each from its own guess.

        An orbit is accepted (`fine`) if it is stable, admissible, not of a shorter period, and, where mirror images
        have one name, not symmetric unless the region's orbits are.
        """
        rows, columns = np.array(points).T
        size = len(points), len(self.stops)
        phases, velocities, fine = np.empty(size), np.empty(size), np.zeros(len(points), dtype=np.bool_)
        for group in self.grid.plane.groups(rows, columns, self._apart):
            members = group.tolist()
            orbits = self._solve([points[k] for k in members], [guesses[k] for k in members])
            phases[group], velocities[group], fine[group] = orbits
        return SolvedOrbits(phases, velocities, fine)

    @property
    def _apart(self) -> tuple[str, ...]:
        """The parameters that vary and are one number for all orbits that are solved for at once."""
        return tuple(name for name in self.grid.plane.names if name in PARAMETERS and name not in _OF_GAPS)

    def _solve(self, points: Sequence[Point], guesses: Sequence[tuple[Floats, Floats]]) -> SolvedOrbits:
        """As `solve`, for points that differ in the gaps of the stops only."""
        problem = self.equations.problem(self.period, self.symmetric, points[0])
        phases = np.array([phases for phases, _ in guesses])
        velocities = np.array([velocities for _, velocities in guesses])
        first = self._sequence(phases[0], velocities[0])
        stops = [self.equations.stops(point) for point in points]
        solved_phases, speeds, results = solve_sequences(problem, first, stops, phases, velocities, floor=-ORBIT_FLOOR)
        solved_velocities = speeds * (problem.omega * problem.length)
        fine = (results.status == CONVERGED) & (results.contact_status == NO_FURTHER_CONTACT)
        fine &= np.all(np.hypot(results.real, results.imaginary) < 1.0, axis=1)
        for i in np.flatnonzero(fine):
            sequence = self._sequence(solved_phases[i], solved_velocities[i])
            apart = self.symmetric or not (self.grid.mirrored and sequence.mirrors())
            fine[i] = sequence.repeats_after() == self.period and apart
        return SolvedOrbits(solved_phases, solved_velocities, fine)

    def _sequence(self, phases: Floats, velocities: Floats) -> ImpactSequence:
        return ImpactSequence(self.period, self.stops, phases, velocities, self.symmetric)
