"""The plane of two parameters, and the runs of trajectories at its points.

Trajectories that differ in the clearances, the restitutions, the bias or the size of the forces share the tables of
their structure at a forcing frequency, so they run side by side. A plane is cut into such groups: columns, rows or
single points.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.stops import Clearance, both_clearances
from grazemap_core.continuation.parameters import (
    PARAMETERS,
    Parameter,
    ParameterPoint,
    check_domain,
    keeps_symmetry,
    symmetric_stops,
)
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.map_settings import AtRest, Conditions, RunSettings, Start
from grazemap_core.maps.runner import CAN_SEPARATE, RunEnd, Runner, Runners, SeparateRuns, run_separate
from grazemap_core.maps.tolerances import BYTES_OF_MASS, BYTES_OF_SEPARATE_MODELS
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import at_own_period, divisor_of
from grazemap_core.records import NamedTuple, dataclass

_OF_STOPS: Final = frozenset(PARAMETERS) - {"omega", "bias", "forcing"}
"""What a kernel changes from one trajectory of a sweep to the next one."""
Number = TypeVar("Number", bound=np.generic)


class Point(NamedTuple):
    """What is simulated at a point of a plane, or at a value of a parameter."""

    oscillator: Oscillator
    """The oscillator, with all values there."""
    omega: float
    """Forcing frequency."""
    clearance: Clearance
    """Clearances of the stops."""


class Axis(NamedTuple):
    """A parameter that varies."""

    name: str
    """One of `parameters.PARAMETERS`, or a parameter of the structure (`Oscillator.variants`)."""
    values: Floats
    """(n,) Its values, increasing."""


@dataclass(frozen=True, eq=False)
class ParameterLine:
    """The values of one parameter, at fixed values of the others."""

    oscillator: Oscillator
    """As in `Plane`."""
    at: ParameterPoint
    """As in `Plane`."""
    axis: Axis
    """The parameter that varies."""

    def check(self) -> None:
        """Raise ParameterError where the values are not increasing numbers within the domain of the parameter."""
        values = self.axis.values
        if values.ndim != 1 or np.any(np.diff(values) <= 0.0):
            raise ParameterError(self.axis.name, "must be an increasing list of numbers")
        check_domain(*self.axis)
        for index in (0, len(values) - 1):
            _check_point(*self.point(index))

    def point(self, index: int) -> Point:
        """Return what is simulated at one of the values."""
        return _point(self.at.varied(self.axis.name, float(self.axis.values[index])), self.oscillator)


@dataclass(frozen=True, eq=False)
class Plane:
    """A rectangle of two parameters; arrays of its points are [vertical, horizontal]."""

    oscillator: Oscillator
    """With the values of the structure that do not vary."""
    at: ParameterPoint
    """The values of the other parameters; those that vary count for nothing."""
    horizontal: Axis
    """The parameter along the rows."""
    vertical: Axis
    """The parameter along the columns."""

    @classmethod
    def of(cls, oscillator: Oscillator, omega: Floats, clearance: Floats) -> Plane:
        """Return the plane of frequencies (m,) and clearances, (n,) of both stops or (n, 2) of the right and the left.

        The clearance of an absent stop is infinite. Raises ParameterError where both vary and differ.
        """
        name, values = _varied_clearance(clearance)
        first = tuple(np.broadcast_to(clearance[0], 2).tolist())
        return cls(oscillator, ParameterPoint.of(oscillator, 1.0, first), Axis("omega", omega), Axis(name, values))

    @cached_property
    def at_own_period(self) -> Plane:
        """The plane at the own frequency of the forces, where trajectories are run."""
        return self if divisor_of(self) == 1 else at_own_period(self)

    @property
    def axes(self) -> tuple[Axis, Axis]:
        """The horizontal, and the vertical one."""
        return self.horizontal, self.vertical

    @property
    def names(self) -> tuple[str, str]:
        """The names of the parameters that vary."""
        return self.horizontal.name, self.vertical.name

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of values of the vertical and of the horizontal parameter."""
        return len(self.vertical.values), len(self.horizontal.values)

    def part(self, rows: slice, columns: slice) -> Plane:
        """Return a rectangle of the plane."""
        across, up = self.horizontal, self.vertical
        return replace(
            self,
            horizontal=across._replace(values=across.values[columns]),
            vertical=up._replace(values=up.values[rows]),
        )

    def check(self) -> None:
        """Raise ParameterError where a value is not within the domain of its parameter."""
        if self.horizontal.name == self.vertical.name:
            raise ParameterError("vertical", "must be another parameter than the horizontal one")
        for axis in self.axes:
            check_domain(*axis)
        for row, column in itertools.product((0, self.shape[0] - 1), (0, self.shape[1] - 1)):
            _check_point(*self.at_point(row, column))

    @cached_property
    def mirrors(self) -> bool:
        """Whether the stops are symmetric at all points, so that the mirror images of motions are motions."""
        keeps = all(keeps_symmetry(self.oscillator, name) for name in self.names)
        return keeps and symmetric_stops(self.oscillator, self.values_at(0, 0))

    @property
    def grid(self) -> tuple[Integers, Integers]:
        """Rows and columns of all points, column by column."""
        rows, columns = self.shape
        return np.tile(np.arange(rows), columns), np.repeat(np.arange(columns), rows)

    def values(self, name: str, rows: Integers, columns: Integers) -> Floats:
        """Return the values (k,) of a parameter of a single number at points."""
        if name == self.horizontal.name:
            return self.horizontal.values[columns]
        if name == self.vertical.name:
            return self.vertical.values[rows]
        fixed = getattr(self.at, name) if name in ("omega", "bias", "forcing") else np.nan
        return np.full(len(rows), fixed, dtype=np.float64)

    def conditions(self, rows: Integers, columns: Integers) -> Conditions:
        """Return the conditions of the trajectories at points (k,)."""
        pairs = {}
        for both in ("clearance", "restitution"):
            sides = [np.full(len(rows), getattr(self.at, f"{both}_{side}")) for side in ("right", "left")]
            for k, name in enumerate((f"{both}_right", f"{both}_left")):
                for varied in (both, name):
                    if varied in self.names:
                        sides[k] = self.values(varied, rows, columns)
            pairs[both] = np.stack(sides, axis=1)
        return Conditions(
            **pairs, bias=self.values("bias", rows, columns), forcing=self.values("forcing", rows, columns)
        )

    def values_at(self, row: int, column: int) -> ParameterPoint:
        """Return the values of all parameters at a point."""
        across, up = self.horizontal, self.vertical
        return self.at.varied(across.name, float(across.values[column])).varied(up.name, float(up.values[row]))

    def at_point(self, row: int, column: int) -> Point:
        """Return what is simulated at a point."""
        return _point(self.values_at(row, column), self.oscillator)

    @cached_property
    def _structural(self) -> tuple[bool, bool]:
        """Whether the horizontal, and the vertical parameter is one of the structure."""
        return self.horizontal.name not in PARAMETERS, self.vertical.name not in PARAMETERS

    def structure(self, row: int, column: int) -> Oscillator:
        """Return the oscillator with the structure at a point; all else is that of `oscillator`."""
        across, up = self._structural
        changes = {self.horizontal.name: float(self.horizontal.values[column])} if across else {}
        changes |= {self.vertical.name: float(self.vertical.values[row])} if up else {}
        return self.oscillator.with_structure(changes)

    def structure_keys(self, rows: Integers, columns: Integers) -> tuple[Integers, Integers]:
        """Return numbers (k,) that are equal for points of one structure: row and column, or 0."""
        across, up = self._structural
        return rows if up else np.zeros_like(rows), columns if across else np.zeros_like(columns)

    def groups(self, rows: Integers, columns: Integers, names: tuple[str, ...]) -> Iterator[Integers]:
        """Yield the positions of points (k,) with one structure and equal values of the parameters named."""
        keys: list[Floats] = [self.values(name, rows, columns) for name in names]
        keys += [number.astype(np.float64) for number in self.structure_keys(rows, columns)]
        order = np.lexsort([rows, columns, *keys])
        table = np.stack(keys)[:, order]
        yield from np.split(order, np.flatnonzero(np.any(np.diff(table, axis=1) != 0, axis=0)) + 1)

    @property
    def omegas(self) -> Floats:
        """The forcing frequencies of the plane."""
        for axis in self.axes:
            if axis.name == "omega":
                return axis.values
        return np.array([self.at.omega])

    @property
    def is_swept_by_kernels(self) -> bool:
        """Whether a column shares tables, bias and forces, so that a kernel runs a sweep along it."""
        return self.vertical.name in _OF_STOPS


class SweepEnd(NamedTuple):
    """The end of a sweep, from which another one of the same column may go on."""

    row: int
    """The row at which it ended."""
    run_end: RunEnd
    """How and where its last trajectory ended."""
    state: Floats | None
    """(2, N) Displacements and velocities there; None where the trajectory ended early."""
    inherits: bool
    """Whether the next trajectory begins with the error of this one."""


class PlaneRunner:
    """Runs of trajectories at the points of a plane, until their motions can be named."""

    def __init__(self, plane: Plane, settings: RunSettings) -> None:
        """Allocate scratch for one structure at a time; nothing is run."""
        self.plane, self.settings = plane.at_own_period, settings
        # quantities are observed of the motion itself, not of the motion divided by the factor of the forces
        observed = settings.observed is not None
        self._scaled = tuple(name for name in ("bias", "forcing") if observed and name in plane.names)
        self._runners, self._omegas = Runners(settings), self.plane.omegas

    def points(self, rows: Integers, columns: Integers) -> tuple[Integers, Floats]:
        """Return codes (k, s, CODES) and figures (k, s, FIGURES) at points (k,); not of a sweep."""
        starts = 1 if self.settings.starts is None else len(self.settings.starts)
        codes = np.empty((len(rows), starts, lane_state.CODES), dtype=np.int64)
        more = 0 if self.settings.observed is None else self.settings.observed.count
        figures = np.empty((*codes.shape[:2], lane_state.FIGURES + more))
        conditions = self._conditions(rows, columns)
        if self._runs_separately:
            most = max(LANES, BYTES_OF_SEPARATE_MODELS // (BYTES_OF_MASS * self.plane.oscillator.size))
            for first in range(0, len(rows), most):
                some = slice(first, first + most)
                codes[some], figures[some] = self._run_separately(rows[some], columns[some], conditions.part(some))
            return codes, figures
        omega = self.plane.values("omega", rows, columns)
        for group in self.groups(rows, columns):
            first = group[0]
            runner, here = self._runner(int(rows[first]), int(columns[first])), float(omega[first])
            forced = runner.at(here, self._omegas)
            codes[group], figures[group] = runner.run(forced, conditions.part(group), self.settings.start(here))
        return codes, figures

    @property
    def _runs_separately(self) -> bool:
        """Whether no two points share their tables, so that every trajectory has its own."""
        plain = self.settings.starts is None and self.settings.observed is None
        return CAN_SEPARATE and plain and all(name == "omega" or name not in PARAMETERS for name in self.plane.names)

    def groups(self, rows: Integers, columns: Integers) -> Iterator[Integers]:
        """Yield the positions of points (k,) whose trajectories are simulated side by side."""
        # random initial states do not scale with the forces and the bias
        varied = (*self._scaled, "omega") if self.settings.starts is None else ("forcing", "bias", "omega")
        return self.plane.groups(rows, columns, varied)

    def sweep(self, rows: Integers, column: int, after: SweepEnd | None = None) -> tuple[Integers, Floats, SweepEnd]:
        """Return codes (k, 1, CODES), figures and the end of a sweep of points of a column.

        Each trajectory follows the one before; the first one begins at rest, or follows an earlier sweep.
        """
        by_kernel, codes, figures = self.plane.is_swept_by_kernels, [], []
        for some in [rows] if by_kernel else rows[:, None]:
            columns = np.full(len(some), column)
            runner, conditions = self._runner(int(some[0]), column), self._conditions(some, columns)
            forced = runner.at(float(self.plane.values("omega", some[:1], columns[:1])[0]), self._omegas)
            start: Start = AtRest()
            if after is not None:
                runner.return_to(after.run_end)
                before = self._conditions(np.array([after.row]), columns[:1]).forcing[0]
                runner.errors.square[0] *= (before / conditions.forcing[0]) ** 2
                if after.state is not None and not by_kernel:
                    start = runner.within(conditions, after.state, after.run_end.ended == lane_state.RESTS)
            code, figure = runner.run(
                forced,
                conditions,
                start,
                inherits=after is not None and after.inherits,
                goes_on=after is not None and by_kernel,
            )
            state = runner.final_state(forced, conditions)
            inherits = state is not None and not lane_state.is_captured(code[-1, 0])
            after = SweepEnd(int(some[-1]), runner.end, state, inherits)
            codes.append(code)
            figures.append(figure)
        assert after is not None
        return np.concatenate(codes), np.concatenate(figures), after

    def grid(self, down: bool = False) -> tuple[Integers, Floats]:
        """Return codes (CODES, n, m, s) and figures (FIGURES, n, m, s) of all points; of a sweep, which may go down."""
        n, m = self.plane.shape
        if not self.settings.follow:
            codes, figures = self.points(*self.plane.grid)
        else:
            rows = np.arange(n)[:: -1 if down else 1]
            columns = [self.sweep(rows, column) for column in range(m)]
            codes = np.concatenate([swept_codes[rows] for swept_codes, _, _ in columns])
            figures = np.concatenate([swept_figures[rows] for _, swept_figures, _ in columns])
        codes, figures = codes.reshape(m, n, *codes.shape[1:]), figures.reshape(m, n, *figures.shape[1:])
        return _of_map(codes), _of_map(figures)

    def _run_separately(self, rows: Integers, columns: Integers, conditions: Conditions) -> tuple[Integers, Floats]:
        """Run the trajectories of points that share no tables, under the conditions there."""
        groups, omega = [*self.plane.groups(rows, columns, ())], self.plane.values("omega", rows, columns)
        structures = []
        for group in groups:
            runner = self._runner(int(rows[group[0]]), int(columns[group[0]]))
            forced = [runner.at(frequency, self._omegas) for frequency in omega[group].tolist()]
            structures.append(SeparateRuns(runner, forced, conditions.part(group)))
        order, (codes, figures) = np.argsort(np.concatenate(groups)), run_separate(structures)
        return codes[order], figures[order]

    def _conditions(self, rows: Integers, columns: Integers) -> Conditions:
        """Return the conditions of points for the runner of their oscillator."""
        conditions = self.plane.conditions(rows, columns)
        return conditions._replace(**{name: np.ones(len(rows)) for name in self._scaled})

    def _runner(self, row: int, column: int) -> Runner:
        """Return the runner of the oscillator at a point, without the parameters that its conditions have."""

        def oscillator() -> Oscillator:
            return self.plane.at_point(row, column).oscillator if self._scaled else self.plane.structure(row, column)

        only = np.array([row]), np.array([column])
        keys = [*self.plane.structure_keys(*only), *(self.plane.values(name, *only) for name in self._scaled)]
        return self._runners.keyed(tuple(float(value) for (value,) in keys), oscillator)


def _of_map(parts: NDArray[Number]) -> NDArray[Number]:
    """Return an array (m, n, s, k) of the points of a map as (k, n, m, s)."""
    return np.ascontiguousarray(np.transpose(parts, (3, 1, 0, 2)))


def _varied_clearance(clearance: Floats) -> tuple[Parameter, Floats]:
    """Return which clearance varies along the rows, and its values, from those of both stops or of each."""
    if clearance.ndim == 1:
        return "clearance", clearance
    right, left = clearance.T
    if np.array_equal(right, left):
        return "clearance", right
    right_varies, left_varies = (bool(np.any(gaps != gaps[0])) for gaps in (right, left))
    if right_varies and left_varies:
        raise ParameterError("clearance", "must be that of both stops, or vary for one of them")
    left_alone = left_varies or np.isinf(right[0])
    return ("clearance_left", left) if left_alone else ("clearance_right", right)


def _check_point(oscillator: Oscillator, omega: float, clearance: Clearance) -> None:
    """Raise ParameterError where a frequency, or the clearances of the stops, are out of their domains."""
    check_domain("omega", np.array([omega]))
    right, left = both_clearances(clearance)
    if not (right + left > 0.0 and math.isfinite(min(right, left))):
        raise ParameterError("clearance", "the sum of the two must be greater than 0, and one of them finite")


def _point(values: ParameterPoint, oscillator: Oscillator) -> Point:
    return Point(values.applied(oscillator), values.omega, values.clearance)
