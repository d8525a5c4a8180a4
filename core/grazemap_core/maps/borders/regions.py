"""The orbits of an unfolding map: the regions of points with one family of orbits, and the orbit at each point.

A trajectory that settles to a periodic motion gives the orbit at one point of a region. From there the orbit is solved
for from point to neighbouring point, as long as the map has the same name and the same slowest impact there. A region
is a connected set of such points. Every point of a region is thus checked twice: the map found its motion by
simulation, and its equations are solved here.
"""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import field
from functools import cached_property
from typing import Final

import numpy as np

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.continuation.parameters import PARAMETERS
from grazemap_core.continuation.point_equations import PointEquations
from grazemap_core.errors import ConditioningError, ParameterError, SteadyMotionError
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.maps.borders.motion_grid import GridPoint, MotionGrid, MotionName
from grazemap_core.maps.kernels.lane_state import SETTLED_AFTER
from grazemap_core.maps.map_settings import BetweenStops, RunSettings, random_starts
from grazemap_core.maps.runner import Runners
from grazemap_core.maps.tolerances import (
    BORDER_CANDIDATES,
    BORDER_RUNS,
    BORDER_SEARCH_PERIODS,
    BORDER_STATES,
    SAME_SPEED,
)
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT
from grazemap_core.orbits.kernels.equations import OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED
from grazemap_core.orbits.periodic_orbits import solve_sequences
from grazemap_core.orbits.tolerances import ORBIT_FLOOR
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator
from grazemap_core.simulation.trajectories import Trajectory, trajectory

NO_REGION: Final = -1
"""Number of the region of a point without one."""

_OF_GAPS: Final = ("clearance", "clearance_right", "clearance_left", "bias")


class GridEquations:
    """The stops and the equations of orbits at the points of a grid."""

    def __init__(self, grid: MotionGrid) -> None:
        """Take the grid; the equations are set up on first use."""
        self._grid, self._equations = grid, PointEquations(grid.plane.oscillator)

    def stops(self, point: GridPoint) -> Stops:
        """Return the stops at a point."""
        return self._equations.stops(self._grid.parameters_at(point))

    @cached_property
    def _unit(self) -> float:
        """The largest unit of the stops at a corner of the map."""
        rows, columns = ((0, size - 1) for size in self._grid.plane.shape)
        return max(self.stops(corner).unit for corner in itertools.product(rows, columns))

    def problem(self, pattern: Pattern, point: GridPoint) -> OrbitProblem:
        """Return the equations at a point; raises as `PointEquations`."""
        values = self._grid.parameters_at(point)
        size = values.forcing * self._equations.forced(values, pattern).steady_size
        return self._equations.problem(values, pattern, max(size, self._unit))


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
    equations: GridEquations
    """The equations of the orbits at the points of the map."""
    orbits: dict[GridPoint, tuple[Floats, Floats]] = field(default_factory=dict)
    """Phases and velocities of the impacts, (k,) each, by point."""

    def _problem(self, point: GridPoint) -> OrbitProblem:
        return self.equations.problem(Pattern(self.period, self.symmetric), point)

    def sequence(self, point: GridPoint) -> ImpactSequence:
        """Return the impacts at a point."""
        return self._sequence(*self.orbits[point])

    def slowest_is(self, point: GridPoint, velocities: Floats) -> bool:
        """Return whether the slowest of the impacts with these velocities is that of the map at a point."""
        stops, problem = self.equations.stops(point), self._problem(point)
        speed_unit = problem.omega * min(0.5 * (stops.right + stops.left), problem.length)
        apart = abs(float(np.min(np.abs(velocities))) - float(self.grid.slowest_impact[point]))
        return apart <= SAME_SPEED * speed_unit

    def solve(self, points: Sequence[GridPoint], guesses: Sequence[tuple[Floats, Floats]]) -> SolvedOrbits:
        """Solve for the orbits at points, each from its own guess.

        An orbit is accepted (`fine`) if it is stable, admissible, not of a shorter period, and, where mirror images
        have one name, not symmetric unless the region's orbits are. None is accepted where the equations have none, as
        without damping.
        """
        plane = self.grid.plane
        rows, columns = np.array(points).T
        size = len(points), len(self.stops)
        phases, velocities, fine = np.empty(size), np.empty(size), np.zeros(len(points), dtype=np.bool_)
        # orbits that differ in the gaps of the stops only are solved for at once
        shared = tuple(name for name in plane.names if name in PARAMETERS and name not in _OF_GAPS)
        for group in plane.groups(rows, columns, shared):
            members = group.tolist()
            with suppress(SteadyMotionError, ConditioningError):
                orbits = self._solve([points[k] for k in members], [guesses[k] for k in members])
                phases[group], velocities[group], fine[group] = orbits
        return SolvedOrbits(phases, velocities, fine)

    def _solve(self, points: Sequence[GridPoint], guesses: Sequence[tuple[Floats, Floats]]) -> SolvedOrbits:
        """As `solve`, for points that differ in the gaps of the stops only."""
        problem = self._problem(points[0])
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
            apart = self.symmetric or not (self.grid.plane.mirrors and sequence.mirrors())
            fine[i] = sequence.repeats_after() == self.period and apart
        return SolvedOrbits(solved_phases, solved_velocities, fine)

    def _sequence(self, phases: Floats, velocities: Floats) -> ImpactSequence:
        return ImpactSequence(self.period, self.stops, phases, velocities, self.symmetric)


class Regions:
    """The regions of a map.

    Attributes
    ----------
    grid : MotionGrid
    number : int (n, m)
        Index in `items` of a point's region; NO_REGION where the motion is not periodic, has no impacts or rests on a
        stop, and where no orbit was found.
    items : list of Region
    """

    def __init__(self, grid: MotionGrid, report: Callable[[float], object] = lambda share: None) -> None:
        """Take the grid, whose regions `find` finds; `report` is called with the share of the points that are done."""
        self.grid = grid
        self.number = np.full(grid.name_index.shape, NO_REGION, dtype=np.int64)
        self.items: list[Region] = []
        self._equations = GridEquations(grid)
        self._searched = 0
        self._report, self._done = report, 0
        self._solvable = np.array([name.solvable for name in grid.names] + [False])  # the last one: NO_NAME
        self._points = max(1, int(np.count_nonzero(self._solvable[grid.name_index])))

    def find(self) -> None:
        """Find all regions; a point whose orbits have no equations, as without damping, is in none."""
        for index in np.flatnonzero(self._solvable[:-1]).tolist():
            left = self.grid.name_index == index
            for row, column in np.argwhere(left).tolist():
                if not left[row, column]:
                    continue
                self._report_done(1)
                region = None
                with suppress(SteadyMotionError, ConditioningError):
                    region = self._begun((row, column), self.grid.names[index])
                if region is not None:
                    self.items.append(region)
                    self._grow(region, (row, column), left)

    def at(self, point: GridPoint) -> Region | None:
        """Return the region of a point."""
        number = int(self.number[point])
        return None if number == NO_REGION else self.items[number]

    @property
    def without_orbit(self) -> Booleans:
        """Where the map has a periodic motion with impacts, and no orbit was found, shape (n, m)."""
        free = np.array([name.without_impacts for name in self.grid.names] + [True])  # the last one: NO_NAME
        return np.asarray((self.number == NO_REGION) & ~free[self.grid.name_index])

    def _report_done(self, points: int) -> None:
        self._done += points
        self._report(self._done / self._points)

    def _begun(self, point: GridPoint, name: MotionName) -> Region | None:
        """Return a region with its first orbit."""
        for guess in self._guesses(point, name):
            region = Region(name, guess.period, guess.stops, guess.symmetric, self.grid, self._equations)
            solved = region.solve([point], [(guess.phases, guess.velocities)])
            if solved.fine[0] and region.slowest_is(point, solved.velocities[0]):
                region.orbits[point] = solved.phases[0], solved.velocities[0]
                return region
        return None

    def _guesses(self, point: GridPoint, name: MotionName) -> Iterator[ImpactSequence]:
        """Yield guesses of a motion's impacts: from rest, from the nearest point of its name, from random states.

        After a chaotic transient, a trajectory with other roundings than the map's may lead to another motion.
        """
        yield from self._settled(point, name, None, self.grid.settled_after[point])
        for region in self.items:
            if region.name == name:
                yield region.sequence(min(region.orbits, key=lambda other: math.dist(other, point)))
        if self._searched >= BORDER_SEARCH_PERIODS:
            return
        self._searched += BORDER_STATES * self._longest
        values = self.grid.parameters_at(point)
        forced = forced_oscillator(self.grid.oscillator_at(point), values.omega, values.clearance)
        states = self._starts * np.array([1.0, values.omega])[:, None]
        key = values._replace(omega=0.0, clearance_right=0.0, clearance_left=0.0)
        runner, middle = self._runners.keyed(key, lambda: forced.oscillator), _middle(forced)
        codes, _ = runner.run(forced.structure, np.array([forced.clearances]), BetweenStops(middle, states))
        there = [k for k, code in enumerate(codes[0]) if self.grid.name_from_codes(code) == name]
        for k in sorted(there, key=lambda k: int(codes[0, k, SETTLED_AFTER]))[:BORDER_CANDIDATES]:
            state = middle + forced.stops.unit * states[k]
            yield from self._settled(point, name, state, codes[0, k, SETTLED_AFTER])

    def _settled(
        self, point: GridPoint, name: MotionName, state: Floats | None, after: int
    ) -> Iterator[ImpactSequence]:
        """Yield impacts of the trajectory from a state (2, N), or from rest, each time after a longer transient."""
        values = self.grid.parameters_at(point)
        for time in range(BORDER_RUNS):
            run = trajectory(
                self.grid.oscillator_at(point),
                values.omega,
                values.clearance,
                None if state is None else state[0],
                None if state is None else state[1],
                transient_periods=int(after) * 2**time,
                periods=name.period,
                samples_per_period=1,
            )
            yield from _named(_last_period(run, name.period), name, self.grid.plane.mirrors)

    @cached_property
    def _runners(self) -> Runners:
        return Runners(RunSettings(self._longest, max(name.period for name in self.grid.names), linearised=False))

    @cached_property
    def _longest(self) -> int:
        """Forcing periods after which all points had settled."""
        return max(1, int(np.max(self.grid.settled_after)))

    @cached_property
    def _starts(self) -> Floats:
        """Displacements from `_middle` in units of the stops, velocities in these times omega, (s, 2, N)."""
        return random_starts(self.grid.plane.oscillator, BORDER_STATES, 0)

    def _grow(self, region: Region, first: GridPoint, left: Booleans) -> None:
        """Solve for the orbits of all points that can be reached from the first one, and remove them from `left`."""
        number = len(self.items) - 1
        self.number[first] = number
        left[first] = False
        due = deque([first[1]])
        while due:
            column = due.popleft()
            self._grow_within(region, column, left)
            for beside in (column - 1, column + 1):
                if not 0 <= beside < left.shape[1]:
                    continue
                rows = np.flatnonzero((self.number[:, column] == number) & left[:, beside])
                if self._take(region, beside, [(row, (row, column)) for row in rows.tolist()], left):
                    due.append(beside)

    def _grow_within(self, region: Region, column: int, left: Booleans) -> None:
        """Solve for orbits up and down a column, until a point does not belong to the region."""
        tried: set[tuple[int, GridPoint]] = set()
        while True:
            steps: dict[int, tuple[int, GridPoint]] = {}
            for row in np.flatnonzero(self.number[:, column] == len(self.items) - 1).tolist():
                for to in (row - 1, row + 1):
                    step = (to, (row, column))
                    if 0 <= to < len(left) and left[to, column] and step not in tried:
                        steps[to] = step
            if not steps:
                return
            tried.update(steps.values())
            self._take(region, column, list(steps.values()), left)

    def _take(self, region: Region, column: int, steps: list[tuple[int, GridPoint]], left: Booleans) -> bool:
        """Solve for orbits of the last region at rows of a column, each from the orbit at a point.

        Returns whether any is the map's.
        """
        if not steps:
            return False
        points = [(row, column) for row, _ in steps]
        solved = region.solve(points, [region.orbits[source] for _, source in steps])
        taken = [i for i in np.flatnonzero(solved.fine) if region.slowest_is(points[i], solved.velocities[i])]
        for i in taken:
            region.orbits[points[i]] = solved.phases[i], solved.velocities[i]
            self.number[points[i]] = len(self.items) - 1
            left[points[i]] = False
        self._report_done(int(np.count_nonzero(solved.fine)))
        return bool(taken)


def _middle(forced: ForcedOscillator) -> Floats:
    """Return the state (2, N) from which contact reaches no stop within `Stops.unit`: in the middle between them."""
    right, left = forced.clearances
    unit = forced.stops.unit
    place = 0.5 * (right - left) if math.isfinite(right + left) else right - unit if left == math.inf else unit - left
    moved = forced.oscillator.with_contact(forced.equilibrium, place)
    return np.stack([moved, np.zeros_like(moved)])


def _last_period(run: Trajectory, period: int) -> ImpactSequence | None:
    """Return the impacts of a record of one period; None where they are not a finite sequence."""
    if run.motion.kind == "periodic" and run.motion.period == period:
        try:
            return impacts_of(run)
        except ParameterError:
            return None
    impacts = run.impacts
    if run.final is None or not len(impacts.stop) or np.any(impacts.kind != "impact") or len(run.sticking.start):
        return None
    # whole forcing periods leave the phase as it was
    phases = run.final.phase + 2.0 * math.pi * impacts.period + run.record.forced.free.omega * impacts.phase_time
    try:
        return ImpactSequence.create(period, impacts.stop.astype(np.int64), phases, impacts.velocity)
    except ParameterError:
        return None


def _named(sequence: ImpactSequence | None, name: MotionName, mirrored: bool) -> Iterator[ImpactSequence]:
    """Yield a sequence if it agrees with a name; half of it where the motion is symmetric.

    `mirrored`: mirror images have the same name.
    """
    if sequence is None or sequence.period != name.period:
        return
    whole = sequence.whole
    counts = [int(np.sum(whole.stops == stop)) or -1 for stop in (1, -1)]
    if (sorted(counts, reverse=True) if mirrored else counts) != [name.right, name.left]:
        return
    if not name.symmetric:
        yield whole
    elif np.array_equal(whole.stops, -np.roll(whole.stops, len(whole.stops) // 2)):
        yield whole.half()
