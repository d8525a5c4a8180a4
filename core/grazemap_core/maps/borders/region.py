"""A region of an unfolding map: connected points with one family of orbits, and the equations of these orbits."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.maps.borders.motion_grid import Grid, Name, Point
from grazemap_core.orbits.batches import solve_sequences
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import CLEAR
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED
from grazemap_core.orbits.tolerances import ORBIT_FLOOR


class Equations:
    """The equations at all columns of a grid, set up once for every period, and for symmetric motions."""

    def __init__(self, grid: Grid) -> None:
        """Take the grid; the equations are set up on first use."""
        self._grid = grid
        self._families: dict[tuple[int, bool], OrbitFamily] = {}
        self._problems: dict[tuple[int, bool, int], OrbitProblem] = {}

    def problem(self, period: int, symmetric: bool, column: int) -> OrbitProblem:
        """Return the problem of a column.

        Raises
        ------
        ParameterError, SteadyMotionError, ConditioningError
            As for `OrbitFamily.of`.
        """
        key = (period, symmetric, column)
        if key not in self._problems:
            kind = (period, symmetric)
            if kind not in self._families:
                self._families[kind] = OrbitFamily.of(self._grid.oscillator, period, symmetric)
            family, omega = self._families[kind], float(self._grid.omega[column])
            steady = family.steady(omega)
            length = max(abs(steady[0]), float(self._grid.clearance[-1]))
            self._problems[key] = family.problem(omega, length, steady)
        return self._problems[key]


class Solved(NamedTuple):
    """Orbits at several points of a column: phases and velocities (p, k), and whether each is accepted (p,)."""

    phases: Floats
    velocities: Floats
    fine: Booleans


@dataclass(eq=False)
class Region:
    """A connected set of points with one family of orbits.

    Attributes
    ----------
    name : Name
    period : int
    stops : int (k,)
        For symmetric motions, those of half the period.
    symmetric : bool
    orbits : dict of Point to (phases, velocities), (k,) each
    """

    name: Name
    period: int
    stops: Integers
    symmetric: bool
    grid: Grid
    equations: Equations
    orbits: dict[Point, tuple[Floats, Floats]] = field(default_factory=dict)

    def sequence(self, point: Point) -> ImpactSequence:
        """Return the impacts at a point."""
        return self._sequence(*self.orbits[point])

    def solve(self, column: int, rows: Integers, guesses: list[tuple[Floats, Floats]]) -> Solved:
        """Solve for the orbits at points of a column, each from its own guess.

        An orbit is accepted (`fine`) if it is stable, admissible, not of a shorter period, and not symmetric unless the
        region's orbits are.
        """
        problem = self.equations.problem(self.period, self.symmetric, column)
        phases = np.array([phases for phases, _ in guesses])
        velocities = np.array([velocities for _, velocities in guesses])
        first = self._sequence(phases[0], velocities[0])
        found, speeds, results = solve_sequences(
            problem, first, self.grid.clearance[rows], phases, velocities, floor=-ORBIT_FLOOR
        )
        found_velocities = speeds * (problem.omega * problem.length)
        fine = (results.status == CONVERGED) & (results.contact == CLEAR)
        fine &= np.all(np.hypot(results.real, results.imaginary) < 1.0, axis=1)
        for i in np.flatnonzero(fine):
            one = self._sequence(found[i], found_velocities[i])
            fine[i] = one.repeats_after() == self.period and (self.symmetric or not one.mirrors())
        return Solved(found, found_velocities, fine)

    def _sequence(self, phases: Floats, velocities: Floats) -> ImpactSequence:
        return ImpactSequence(self.period, self.stops, phases, velocities, self.symmetric)
