"""The borders of an unfolding map, each explained by a bifurcation curve, as a basin boundary, or not at all.

Two neighbouring points with different motions are a border pair. The motion of each is solved for at the other point.
Where it does not exist there, it is followed from one point toward the other until it ends at a special point, and the
bifurcation curve of that point is followed through the window. The curve explains all pairs at which that motion ends
and which it separates. Where both motions exist at both points and are stable, the border is not a bifurcation: the
initial state has passed from one basin of attraction to the other (theory, "Borders of a map").

The work grows with the square of the number of impacts, so both the work for one border and that for all of them are
bounded, by numbers that do not depend on the machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.continuation.bifurcation_curves import BifurcationCurve, bifurcation_curve
from grazemap_core.continuation.branches import OrbitPoint, orbit_branch
from grazemap_core.continuation.motion_curves import distances_from_line, followable
from grazemap_core.continuation.parameters import PARAMETERS, domain
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.errors import ConditioningError, SteadyMotionError
from grazemap_core.maps import tolerances
from grazemap_core.maps.borders.motion_grid import NO_NAME, GridPoint, MotionGrid, MotionName, positions
from grazemap_core.maps.borders.regions import NO_REGION, Region, Regions
from grazemap_core.maps.plane_grazes import graze_lines, grazing_margins
from grazemap_core.maps.planes import Axis, Plane
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.records import dataclass

EXPLANATIONS: Final = ("unexplained", "curve", "coexistence", "goes on")
"""Explanations of a border; the position is the code. "curve": the motion of one point ends between the two points, on
a curve that was computed. "coexistence": both motions exist at both points, stable and admissible, so the border is one
of basins of attraction. "goes on": one point is not periodic; the periodic motion of the other point exists there too,
but the trajectory does not lead to it, or has not yet."""

BORDER_REASONS: Final = (
    "",
    "no orbit of the motion was found at one of the points. Remedy: a map with more max_periods.",
    "the motion rests on a stop or chatters: it has no finite sequence of impacts to be followed. "
    "Remedy: compare trajectories on either side.",
    "the branch of the motion breaks off between the points. Remedy: a finer map there.",
    "the motion ends at a special point that is not solved for to round-off. Remedy: a finer map there.",
    "the curve of the special point leaves the border, or its orbits are not admissible there. "
    "Remedy: a finer map there.",
    "the motion has so many impacts that following it exceeds the work allowed for one border. "
    "Remedy: bifurcation-curves of this motion.",
    "the work allowed for all borders of a map was spent on others. Remedy: a diagram of a part of the window.",
    "a system of equations is too ill-conditioned. Remedy: another frequency or clearance.",
)
"""Why a border is unexplained, and what to do; the position is the code."""

_UNEXPLAINED, _CURVE, _COEXISTENCE, _GOES_ON = range(4)
_NO_ORBIT, _RESTS, _BREAKS_OFF, _NOT_SOLVED, _LEAVES, _TOO_LONG, _ALL_SPENT, _ILL_CONDITIONED = range(1, 9)

Report = Callable[[int, int], object]
"""Called with (done, total)."""
_STEPS: Final = 1000
"""Total number of steps of the progress that is reported."""
# shares of the whole that are done at the beginning and at the end of a stage
_REGIONS: Final = (0.0, 0.05)
"""The orbits of all points are found."""
_ACROSS: Final = (0.05, 0.2)
"""The orbits of border pairs are solved for at the other point."""
_COEXISTING: Final = (0.2, 0.3)
"""The motions that exist at both points are followed."""
_CURVES: Final = (0.3, 1.0)
"""The motions that end are followed to their curves. This takes longest, unless a map is fine and its motions few."""


@dataclass(frozen=True, eq=False)
class BorderCurve:
    """A curve that explains borders."""

    type: str
    """One of "SN", "PD", "SB", "NS" or "GR"."""
    name: MotionName
    """Name of the motion that ends there."""
    plane: tuple[str, str]
    """The two parameters of the map."""
    horizontal: Floats
    """(m,) Values of the first of them."""
    vertical: Floats
    """(m,) Values of the second one."""
    admissible: Booleans
    """(m,) Whether the orbits are motions."""
    orbits: BifurcationCurve | None
    """None for a grazing curve, on which the steady motion touches a stop."""


@dataclass(frozen=True, eq=False)
class MapBorders:
    """The borders of a map: p pairs of neighbouring points."""

    row: Integers
    """(p,) Row of the first point; that of the other one is the next, or the same."""
    column: Integers
    """(p,) Column of the first point; that of the other one is the same, or the next."""
    along: Integers
    """(p,) 0: the pair differs in its row, 1: in its column."""
    regular: Booleans
    """(p,) Whether both motions are periodic; otherwise one is chaotic, quasi-periodic or unresolved."""
    explanation: Integers
    """(p,) Position in EXPLANATIONS."""
    reason: Integers
    """(p,) Position in BORDER_REASONS."""
    curve: Integers
    """(p,) Position in `curves`; -1 without one."""
    distance: Floats
    """(p,) From the middle between the points to the curve, in steps of the map; NaN without one."""
    curves: tuple[BorderCurve, ...]
    """The curves that explain borders."""
    without_orbit: Booleans
    """(n, m) Points with a periodic motion with impacts whose orbit was not found; motions that rest are among them."""
    irregular_pairs: int
    """Pairs of two points that are not periodic, of different kinds; not among the p."""


@in_own_period
def map_borders(plane: Plane, arrays: Mapping[str, NDArray[Any]], report: Report | None = None) -> MapBorders:
    """Explain the borders of a map.

    Parameters
    ----------
    plane : Plane
        Of n vertical and m horizontal values.
    arrays : dict of arrays (n, m)
        From `unfolding.unfolding_map_tile`. Trajectories from rest are tried first, so the orbits of other policies may
        not all be found.
    report : callable of (done, total), optional
        Called when more of the work is done than before; done stays below total.

    Raises
    ------
    ParameterError
        Arrays and grid do not fit together, or nothing is forced.
    SteadyMotionError, ConditioningError
        As for `periodic_orbits.periodic_orbit`.
    """
    grid = MotionGrid.of(plane, arrays)
    progress = _Progress(report)
    regions = Regions(grid, partial(progress.stage, _REGIONS))
    regions.find()
    explanation = _Explanation(grid, regions, progress)
    explanation.run()
    return explanation.result(arrays["kind"])


class _Progress:
    """Progress as one number that never decreases, and stays below the total."""

    def __init__(self, report: Report | None) -> None:
        self._report, self._reported = report, 0

    def stage(self, stage: tuple[float, float], share: float) -> None:
        """Report the share of a stage that is done."""
        done = min(int(_STEPS * (stage[0] + (stage[1] - stage[0]) * share)), _STEPS - 1)
        if self._report is not None and done > self._reported:
            self._reported = done
            self._report(done, _STEPS)


class _Explanation:
    """The pairs, and what is known of them so far; arrays (p, 2) have one number for the motion of each point."""

    def __init__(self, grid: MotionGrid, regions: Regions, progress: _Progress) -> None:
        self.grid, self.regions, self.progress = grid, regions, progress
        self.pairs = self._pairs()
        count = len(self.pairs)
        self.same = np.zeros(count, dtype=np.bool_)  # the points have the same motion: no border
        self.known = np.zeros((count, 2), dtype=np.bool_)
        self.ends = np.zeros((count, 2), dtype=np.bool_)
        self.reason = np.zeros((count, 2), dtype=np.int64)
        self.curve = np.full(count, -1, dtype=np.int64)
        self.distance = np.full(count, np.nan)
        self.curves: list[BorderCurve] = []
        self.spent = 0
        self.number = np.array([[grid.name_index[point] for point in pair] for pair in self.pairs], dtype=np.int64)
        self.number = self.number.reshape(-1, 2)
        self.regular = np.all(self.number != NO_NAME, axis=1)

    def _pairs(self) -> list[tuple[GridPoint, GridPoint]]:
        """Return neighbours with different names or regions, of which one at least is periodic."""
        pairs: list[tuple[GridPoint, GridPoint]] = []
        name, number = self.grid.name_index, self.regions.number
        for down, right in ((1, 0), (0, 1)):
            here = (slice(0, len(name) - down), slice(0, name.shape[1] - right))
            there = (slice(down, None), slice(right, None))
            differ = (name[here] != name[there]) | (number[here] != number[there])
            differ &= (name[here] >= 0) | (name[there] >= 0)
            pairs += [((row, column), (row + down, column + right)) for row, column in np.argwhere(differ).tolist()]
        return pairs

    def _solve_across(self) -> None:
        """Solve for every motion at the other point of its pair."""
        margins = grazing_margins(self.grid.plane)
        is_free = (margins[0] > 0.0) & (margins[1] > 0.0)
        jobs: dict[tuple[int, int], list[tuple[int, int, GridPoint, GridPoint]]] = {}
        for i, pair in enumerate(self.pairs):
            for side, (point, other) in enumerate((pair, pair[::-1])):
                name = self.grid.name_at(point)
                number = int(self.regions.number[point])
                if name is None:
                    continue
                if name.without_impacts:
                    self.known[i, side] = True
                    self.ends[i, side] = not is_free[other]
                elif number == NO_REGION:
                    self.reason[i, side] = _NO_ORBIT if name.solvable else _RESTS
                else:
                    self.known[i, side] = True
                    jobs.setdefault((number, other[1]), []).append((i, side, point, other))
        for done, ((number, _), members) in enumerate(jobs.items()):
            self.progress.stage(_ACROSS, done / len(jobs))
            region = self.regions.items[number]
            guesses = [region.orbits[point] for _, _, point, _ in members]
            orbits = region.solve([other for *_, other in members], guesses)
            for k, (i, side, _, other) in enumerate(members):
                self.ends[i, side] = not orbits.fine[k]
                if orbits.fine[k] and _are_same(self.regions.at(other), other, region, orbits.velocities[k]):
                    self.same[i] = True
        self.known[self.same] = self.ends[self.same] = False

    def run(self) -> None:
        """Explain the borders, those of periodic motions first."""
        self._solve_across()
        both = np.flatnonzero(self.regular & ~np.any(self.ends, axis=1) & np.all(self.known, axis=1)).tolist()
        for done, place in enumerate(both):
            self.progress.stage(_COEXISTING, done / len(both))
            for side in (0, 1):
                self._follow_across(place, side)
        self._take_grazing_curve()
        weight = self._weight()
        whole = max(float(np.sum(weight)), 1.0)
        for chosen in (self.regular, ~self.regular):
            for number in self._most_frequent(chosen):
                for i, side in np.argwhere(self._waiting(number, chosen)).tolist():
                    if self._all_waiting[i, side]:
                        self._end(i, side, number, chosen)
                    if self._all_waiting[i, side]:
                        self.reason[i, side] = _BREAKS_OFF
                    self.progress.stage(_CURVES, 1.0 - float(np.sum(weight[self._all_waiting])) / whole)

    @property
    def _all_waiting(self) -> Booleans:
        """Pairs and sides (p, 2) at which a motion ends, with neither a curve nor a reason for its absence yet."""
        return np.asarray(self.ends & (self.reason == 0) & (self.curve < 0)[:, None])

    def _waiting(self, number: int, chosen: Booleans) -> Booleans:
        """Return those of `_all_waiting` whose motion has the name with this number."""
        return np.asarray(self._all_waiting & chosen[:, None] & (self.number == number))

    def _most_frequent(self, chosen: Booleans) -> Iterator[int]:
        """Yield the name with the most borders left to explain, until none is left."""
        while True:
            left = self.number[self._all_waiting & chosen[:, None]]
            if not len(left):
                return
            counts = np.bincount(left)
            yield int(np.flatnonzero(counts == np.max(counts))[-1])

    def _weight(self) -> Floats:
        """Return the expected work at pairs and sides (p, 2); the work for a name is divided among its borders."""
        weight = np.zeros(self.number.shape)
        for number in np.unique(self.number[self._all_waiting]).tolist():
            there = self._all_waiting & (self.number == number)
            weight[there] = _an_orbit(self.grid.names[number].impacts) / np.count_nonzero(there)
        return weight

    def _take_grazing_curve(self) -> None:
        free = [number for number, name in enumerate(self.grid.names) if name.without_impacts]
        if not free:
            return
        name = self.grid.names[free[0]]
        for curve in graze_lines(self.grid.plane):
            self._take(BorderCurve("GR", name, *curve[1:], None), free[0])
        left = self.ends & (self.curve < 0)[:, None] & (self.number == free[0])
        self.reason[left] = _LEAVES  # the motion ends on this curve only, which is steeper than a step

    def _take(self, curve: BorderCurve, number: int) -> None:
        """Explain by a curve all pairs that it separates and at which a motion of this name ends."""
        ends_there = np.any(self.ends & (self.number == number), axis=1)
        members = np.flatnonzero((self.curve < 0) & ends_there).tolist()
        self.curves.append(curve)
        if not members:
            return
        middles = np.mean([self.pairs[i] for i in members], axis=1)
        across, up = self.grid.plane.horizontal.values, self.grid.plane.vertical.values
        line = np.stack([positions(up, curve.vertical), positions(across, curve.horizontal)], axis=1)
        distance = distances_from_line(middles, line, curve.admissible)
        for i, apart in zip(members, distance.tolist(), strict=True):
            if apart <= tolerances.BORDER_REACH:
                self.curve[i], self.distance[i] = len(self.curves) - 1, apart

    def _orbits(self, i: int, side: int, each: int) -> int:
        """Return how many orbits of this cost may be followed in one direction; with 0 the reason is entered."""
        if self.spent >= tolerances.BORDERS_WORK:
            self.reason[i, side] = _ALL_SPENT
            return 0
        most = min(tolerances.BORDER_ORBITS, tolerances.BORDER_WORK // each)
        if most < tolerances.BORDER_FEWEST:
            self.reason[i, side] = _TOO_LONG
            return 0
        return most

    def _follow_across(self, i: int, side: int) -> SpecialPoint | None:
        """Follow a motion from its point to the other one; return the special point at which it ends, or None."""
        point = self.pairs[i][side]
        region = self.regions.at(point)
        if region is None:  # the steady motion
            return None
        most = self._orbits(i, side, _an_orbit(len(region.stops)))
        if not most:
            self.known[i, side] = False
            return None
        try:
            special, arrives, full = self._follow_branch(i, side, region, most)
            start = None if special is None else followable(self.grid.plane.oscillator, special)
        except (SteadyMotionError, ConditioningError):
            self.known[i, side] = False
            self.reason[i, side] = _ILL_CONDITIONED
            return None
        if special is not None:
            self.ends[i, side] = True
            self.reason[i, side] = 0 if start is not None else _NOT_SOLVED
            return start
        # the motion exists there too, or the point where it ends is unknown
        self.ends[i, side] = False
        self.known[i, side] = arrives
        self.reason[i, side] = 0 if arrives else _TOO_LONG if full else _BREAKS_OFF
        return None

    def _follow_branch(self, i: int, side: int, region: Region, most: int) -> tuple[SpecialPoint | None, bool, bool]:
        """Follow the branch of a motion from its point to the other one, or to the first special point.

        Returns that point, whether the branch arrives, and whether it was abandoned because of its length.
        """
        point, other = self.pairs[i][side], self.pairs[i][1 - side]
        values = self.grid.parameters_at(point)
        oscillator = self.grid.plane.oscillator
        orbit = OrbitPoint(
            periodic_orbit(values.applied(oscillator), values.omega, values.clearance, region.sequence(point)), values
        )
        vary = self.grid.plane.names[1 if point[1] == other[1] else 0]
        here, there = values.value(vary), self.grid.parameters_at(other).value(vary)
        rises = there > here
        # a step that starts next to a saddle-node may pass over it and return to its start
        for step in (self._longest_step(), tolerances.BORDER_SHORTER_STEP * self._longest_step()):
            branch = orbit_branch(
                oscillator, orbit, min(here, there), max(here, there), vary, step, most, to_special=True
            )
            self.spent += len(branch.values) * _an_orbit(len(region.stops))
            arrives = abs(float(branch.values[-1 if rises else 0]) - there) <= tolerances.END_OF_RANGE * max(
                abs(here), abs(there)
            )
            if arrives or branch.special_points:
                break
        special = branch.special_points if rises else branch.special_points[::-1]
        return (special[0] if special else None), arrives, "points" in branch.ends

    def _end(self, i: int, side: int, number: int, chosen: Booleans) -> None:
        """Find the special point at which a motion ends at a pair, and follow its curve."""
        point = self._follow_across(i, side)
        if point is None:
            return
        each = tolerances.BORDER_CURVE_WORK[point.type] * _an_orbit(len(point.impacts.stops))
        most = self._orbits(i, side, each)
        if not most:
            return
        window = [self._side(axis, number, chosen) for axis in (1, 0)]
        try:
            step, plane = self._longest_step(), self.grid.plane
            curve = bifurcation_curve(plane.oscillator, point, window[0], window[1], step, most, plane.names)
        except (SteadyMotionError, ConditioningError):
            self.reason[i, side] = _ILL_CONDITIONED
            return
        self.spent += len(curve.horizontal) * each
        name = self.grid.names[number]
        places = (curve.plane, curve.horizontal, curve.vertical, curve.admissible)
        self._take(BorderCurve(curve.type, name, *places, curve), number)
        if self.curve[i] < 0:
            self.reason[i, side] = _LEAVES

    def _side(self, axis: int, number: int, chosen: Booleans) -> tuple[float, float]:
        """Return the range of a parameter that contains all unexplained borders at which a motion ends."""
        name, values = self.grid.plane.horizontal if axis else self.grid.plane.vertical
        waiting = np.flatnonzero(np.any(self._waiting(number, chosen), axis=1))
        places = [point[axis] for i in waiting.tolist() for point in self.pairs[i]]
        low, high = min(places), max(places)
        before = values[max(low, 1)] - values[max(low, 1) - 1]
        after = values[min(high + 1, len(values) - 1)] - values[min(high + 1, len(values) - 1) - 1]
        # a positive parameter stays away from 0
        least, most = (0.5 * float(values[low]), math.inf) if domain(name)[0] > 0.0 else domain(name)
        return (
            max(float(values[low] - tolerances.BORDER_MARGIN * before), least),
            min(float(values[high] + tolerances.BORDER_MARGIN * after), most),
        )

    def _longest_step(self) -> float:
        """Return the longest step along a branch or a curve, relative as their units are."""
        steps = [float(np.max(np.diff(axis.values) / _unit(axis))) for axis in self.grid.plane.axes]
        return min(tolerances.BORDER_BRANCH_STEP, tolerances.BORDER_STEP * max(steps))

    def result(self, kind: NDArray[np.int8]) -> MapBorders:
        """Return the borders; a pair without a curve, whose motions are not known at both points, is unexplained."""
        stays = self.known & ~self.ends
        explanation = np.full(len(self.pairs), _UNEXPLAINED, dtype=np.int64)
        explanation[self.regular & np.all(stays, axis=1)] = _COEXISTENCE
        explanation[~self.regular & np.any(stays, axis=1)] = _GOES_ON
        explanation[self.curve >= 0] = _CURVE
        reason = np.where(explanation == _UNEXPLAINED, np.max(self.reason, axis=1), 0)
        points = np.array(self.pairs, dtype=np.int64).reshape(-1, 2, 2)
        irregular = self.grid.name_index < 0
        apart = 0
        for states, kinds in ((irregular, kind), (irregular.T, kind.T)):
            apart += int(np.count_nonzero(states[1:] & states[:-1] & (kinds[1:] != kinds[:-1])))
        borders = ~self.same
        return MapBorders(
            row=points[borders, 0, 0],
            column=points[borders, 0, 1],
            along=(points[:, 1, 1] - points[:, 0, 1])[borders],
            regular=self.regular[borders],
            explanation=explanation[borders],
            reason=reason[borders],
            curve=self.curve[borders],
            distance=self.distance[borders],
            curves=tuple(self.curves),
            without_orbit=self.regions.without_orbit,
            irregular_pairs=apart,
        )


def _unit(axis: Axis) -> Floats:
    """Return the unit of the steps (n - 1,) between values of a parameter, of the size of that of a branch over it."""
    if axis.name in PARAMETERS and not axis.name.startswith(("omega", "clearance")):
        return np.ones(len(axis.values) - 1)
    return np.maximum(np.abs(axis.values[:-1]), np.diff(axis.values))


def _an_orbit(impacts: int) -> int:
    """Return the cost of following one orbit, in the units of `BORDER_WORK`."""
    return max(impacts, tolerances.BORDER_LEAST_IMPACTS) ** 2


def _are_same(other: Region | None, place: GridPoint, region: Region, velocities: Floats) -> bool:
    """Return whether the orbit at a point of another region has these impacts, or their mirror images."""
    if other is None or other.name != region.name:
        return False
    speeds = [np.sort(np.abs(values)) for values in (other.orbits[place][1], velocities)]
    return len(speeds[0]) == len(speeds[1]) and bool(
        np.all(np.abs(speeds[0] - speeds[1]) <= tolerances.SAME_SPEED * float(np.max(speeds[1])))
    )
