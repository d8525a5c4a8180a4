"""The orbits of an unfolding map: the regions of points with one family of orbits, and the orbit at each point.

A trajectory that settles to a periodic motion gives the orbit at one point of a region. From there the orbit is solved
for from point to neighbouring point, as long as the map has the same name and the same slowest impact there. A region
is a connected set of such points. Every point of a region is thus checked twice: the map found its motion by
simulation, and its equations are solved here.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from functools import cached_property

import numpy as np

from grazemap_core.arrays import Booleans, Floats
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.errors import ParameterError
from grazemap_core.maps.borders.motion_grid import MotionGrid, MotionName, Point
from grazemap_core.maps.borders.progress import REGIONS, BorderProgress
from grazemap_core.maps.borders.region import PointEquations, Region
from grazemap_core.maps.kernels.lane_state import SETTLED_AFTER
from grazemap_core.maps.map_settings import random_starts
from grazemap_core.maps.runner import Runner, Runners, RunSettings
from grazemap_core.maps.starts import BetweenStops
from grazemap_core.maps.tolerances import BORDER_SEARCH_PERIODS, SAME_SPEED
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator
from grazemap_core.simulation.trajectories import Trajectory, trajectory

NO_REGION = -1
_RUNS = 3
"""Number of trajectories from one initial state, each twice as long as the one before, that are tried for an orbit."""
_RANDOM_STATES = 256
"""Number of initial states that are tried at a point, to find one that leads to the map's motion."""
_MOST_STATES = 4
"""Number of those states that are used: those whose trajectories settle first."""


class Regions:
    """The regions of a map.

    Attributes
    ----------
    grid : MotionGrid
    number : int (n, m)
        Index in `found` of a point's region; NO_REGION where the motion is not periodic, has no impacts or rests on a
        stop, and where no orbit was found.
    found : list of Region
    """

    def __init__(self, grid: MotionGrid, progress: BorderProgress | None = None) -> None:
        """Find all regions, and report progress.

        Raises
        ------
        ParameterError, SteadyMotionError, ConditioningError
            As for `OrbitFamily.of`.
        """
        self.grid = grid
        self.number = np.full(grid.name_index.shape, NO_REGION, dtype=np.int64)
        self.found: list[Region] = []
        self._equations = PointEquations(grid)
        self._progress = progress or BorderProgress(None)
        self._searched = 0
        solvable = np.array([name.solvable for name in grid.names] + [False])  # the last one: NO_NAME
        self._looked_at, self._all = 0, max(1, int(np.count_nonzero(solvable[grid.name_index])))
        for place in np.flatnonzero(solvable[:-1]).tolist():
            name, there = grid.names[place], grid.name_index == place
            for row, column in np.argwhere(there).tolist():
                if self.number[row, column] == NO_REGION:
                    self._evaluate_at(1)
                    region = self._begun((row, column), name)
                    if region is not None:
                        self._grow(region, (row, column), there & (self.number == NO_REGION))

    def at(self, point: Point) -> Region | None:
        """Return the region of a point."""
        number = int(self.number[point])
        return None if number == NO_REGION else self.found[number]

    @property
    def without_orbit(self) -> Booleans:
        """Where the map has a periodic motion with impacts, and no orbit was found, shape (n, m)."""
        free = np.array([name.without_impacts for name in self.grid.names] + [True])  # the last one: NO_NAME
        return np.asarray((self.number == NO_REGION) & ~free[self.grid.name_index])

    def _evaluate_at(self, points: int) -> None:
        self._looked_at += points
        self._progress.stage(REGIONS, self._looked_at / self._all)

    def _begun(self, point: Point, name: MotionName) -> Region | None:
        """Return a region with its first orbit."""
        for guess in self._guesses(point, name):
            region = Region(name, guess.period, guess.stops, guess.symmetric, self.grid, self._equations)
            got = region.solve([point], [(guess.phases, guess.velocities)])
            if got.fine[0] and self._is_that_of_map(region, point, got.velocities[0]):
                region.orbits[point] = got.phases[0], got.velocities[0]
                return region
        return None

    def _guesses(self, point: Point, name: MotionName) -> Iterator[ImpactSequence]:
        """Yield guesses of a motion's impacts: from rest, from the nearest point of its name, from random states.

        After a chaotic transient, a trajectory with other roundings than the map's may lead to another motion.
        """
        yield from self._settled(point, name, None, self.grid.settled_after[point])
        for region in self.found:
            if region.name == name:
                yield region.sequence(min(region.orbits, key=lambda other: math.dist(other, point)))
        if self._searched >= BORDER_SEARCH_PERIODS:
            return
        self._searched += _RANDOM_STATES * self._longest
        values = self.grid.parameters_at(point)
        forced = forced_oscillator(self.grid.oscillator_at(point), values.omega, values.clearance)
        states = self._starts * np.array([1.0, values.omega])[:, None]
        runner = self._runner(values, forced.oscillator)
        middle = _middle(forced)
        codes, _ = runner.run(forced.structure, np.array([forced.clearances]), BetweenStops(middle, states))
        there = [k for k, code in enumerate(codes[0]) if self.grid.name_from_codes(code) == name]
        for k in sorted(there, key=lambda k: int(codes[0, k, SETTLED_AFTER]))[:_MOST_STATES]:
            state = middle + forced.stops.unit * states[k]
            yield from self._settled(point, name, state, codes[0, k, SETTLED_AFTER])

    def _settled(self, point: Point, name: MotionName, state: Floats | None, after: int) -> Iterator[ImpactSequence]:
        """Yield impacts of the trajectory from a state (2, N), or from rest, each time after a longer transient."""
        values = self.grid.parameters_at(point)
        for time in range(_RUNS):
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
            yield from _named(_last_period(run, name.period), name, self.grid.mirrored)

    def _runner(self, values: ParameterPoint, oscillator: Oscillator) -> Runner:
        """Return the runner of an oscillator with these values."""
        key = values._replace(omega=0.0, clearance_right=0.0, clearance_left=0.0)
        return self._runners.keyed(key, lambda: oscillator)

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
        return random_starts(self.grid.plane.oscillator, _RANDOM_STATES, 0)

    def _is_that_of_map(self, region: Region, point: Point, velocities: Floats) -> bool:
        apart = abs(float(np.min(np.abs(velocities))) - float(self.grid.slowest_impact[point]))
        return apart <= SAME_SPEED * region.speed_unit(point)

    def _grow(self, region: Region, first: Point, left: Booleans) -> None:
        """Solve for the orbits of all points that can be reached from the first one, and remove them from `left`."""
        number = len(self.found)
        self.found.append(region)
        self.number[first] = number
        left[first] = False
        due = deque([first[1]])
        while due:
            column = due.popleft()
            self._grow_within(region, number, column, left)
            for beside in (column - 1, column + 1):
                if not 0 <= beside < left.shape[1]:
                    continue
                rows = np.flatnonzero((self.number[:, column] == number) & left[:, beside])
                if self._take(region, number, beside, [(row, (row, column)) for row in rows.tolist()], left):
                    due.append(beside)

    def _grow_within(self, region: Region, number: int, column: int, left: Booleans) -> None:
        """Solve for orbits up and down a column, until a point does not belong to the region."""
        tried: set[tuple[int, Point]] = set()
        while True:
            steps: dict[int, tuple[int, Point]] = {}
            for row in np.flatnonzero(self.number[:, column] == number).tolist():
                for to in (row - 1, row + 1):
                    step = (to, (row, column))
                    if 0 <= to < len(left) and left[to, column] and step not in tried:
                        steps[to] = step
            if not steps:
                return
            tried.update(steps.values())
            self._take(region, number, column, list(steps.values()), left)

    def _take(self, region: Region, number: int, column: int, steps: list[tuple[int, Point]], left: Booleans) -> bool:
        """Solve for orbits at rows of a column, each from the orbit at a point; return whether any is the map's."""
        if not steps:
            return False
        points = [(row, column) for row, _ in steps]
        got = region.solve(points, [region.orbits[source] for _, source in steps])
        some = False
        for i in np.flatnonzero(got.fine):
            point = points[i]
            if self._is_that_of_map(region, point, got.velocities[i]):
                region.orbits[point] = got.phases[i], got.velocities[i]
                self.number[point] = number
                left[point] = False
                some = True
        self._evaluate_at(int(np.count_nonzero(got.fine)))
        return some


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
