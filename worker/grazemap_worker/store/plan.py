"""How a request is cut into tiles, and what it is expected to cost.

A plan is a pure function of the request: the service makes it (without the core), the worker reads it. Only maps
have more than one tile. A map's grid is cut into equal rectangles (the last ones smaller) that should take
`TILE_SECONDS` each, as tall as can be, because the clearances of one omega run side by side; the bytes of a result do
not depend on the cut. A sweep's tiles are whole columns. An adaptive map's are strips of `ADAPTIVE_COLUMNS`: which of
its points are computed does depend on them.
"""

from __future__ import annotations

import math

import numpy as np
from pydantic import BaseModel, ConfigDict

from grazemap.wire import (
    BasinsRequest,
    BifurcationCurvesRequest,
    BifurcationDiagramsRequest,
    CodimensionTwoPointsRequest,
    DiscontinuityMappingsRequest,
    Estimate,
    GrazingCurvesRequest,
    OrbitBranchesRequest,
    Oscillator,
    PeriodicOrbitsRequest,
    ProcessRequest,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
    UnfoldingMapsRequest,
    grid_points,
    grid_values,
)

# `python -m benchmarks.estimates` prints, for each process in a few sizes, the seconds of one core that it takes on
# the machine it runs on, and those that come from the figures below: within a factor of three, that of borders within
# ten, because what a motion takes depends on which one it is.
#
# Forcing periods of the default oscillator that one core simulates in a second, with certified contacts: of a single
# trajectory, and of a map with the classification of the motion, in columns of FULL_COLUMN clearances. Shorter columns
# fill fewer lanes, longer ones more, up to LONGEST_COLUMN: the time goes with the root of their length.
PERIODS_PER_SECOND = 1.0e5
MAP_PERIODS_PER_SECOND = 4.0e5
FULL_COLUMN = 128
LONGEST_COLUMN = 512
# A preview proves nothing and carries no small changes along.
PREVIEW_FASTER = 1.6
# The same of a sweep, in which the clearances of one omega are followed one after the other.
SWEEP_PERIODS_PER_SECOND = 1.5e5
# Clearances in a tile at most: more would not run faster.
TALLEST_TILE = 1024
# Columns and most rows of a tile of an adaptive map: tall, because few clearances of each omega are computed, and wide
# enough for the computed lines along its sides to be few.
ADAPTIVE_COLUMNS = 64
ADAPTIVE_ROWS = 4096
# So many strips have seams that take as long to close, and to put together, as one of them took.
ADAPTIVE_STRIPS_CLOSED = 16
# Its share of computed pixels was 0.26 and 0.14 in maps of 1024 x 1024 and 4096 x 4096 over one window: all of a
# map this long and wide, times a power of its size, for borders are fractal. Pixels near them take longer.
ADAPTIVE_SIDE = 60.0
ADAPTIVE_POWER = 0.45
ADAPTIVE_PERIODS = 1.6
# What a pixel takes on average to settle, and the share of pixels that go on to max_periods.
PERIODS_TO_SETTLE = 45
UNSETTLED = 0.1
# The same of the states of a basin, which run side by side and mostly to few attractors.
BASIN_PERIODS_PER_SECOND = 8.0e5
BASIN_UNSETTLED = 0.02
# |lambda| T of a period that costs as much as one of the default oscillator near omega = 0.29.
REFERENCE_STIFFNESS = 33.0
# Short enough for a small map to keep all workers busy; to begin a tile takes a thirtieth of a second.
TILE_SECONDS = 0.6
# And no more than this when none of its pixels settles before max_periods: a tile has a time limit. Machines differ, so
# that is counted at a quarter of a map's speed.
WORST_TILE_SECONDS = 900.0
WORST_SLOWER = 4.0
# One sample of a grazing curve, per order looked at and mass.
CURVE_SECONDS = 5.0e-8
# The codimension-two points per unit of omega and mass; their number grows with the square of the orders looked at.
POINTS_SECONDS = 1.0e-5
# One overshoot of a discontinuity mapping, exact and leading order.
MAPPING_SECONDS = 1.0e-2
# Of a bifurcation diagram: exponents where the motion has not closed, as a mean over values in periods without them.
DIAGRAM_EXPONENT_PERIODS = 300
# Trajectories that are followed at most to find a motion with given stops.
SEARCH_PERIODS = 1.2e4
# One frequency of the bifurcation curves in closed form, per mass, for each period up to the longest.
CURVE_POINT_SECONDS = 4.0e-5
# One point of a branch, per mass, for few impacts; it goes with the square of those over BRANCH_IMPACTS.
BRANCH_SECONDS = 5.0e-4
BRANCH_IMPACTS = 16.0
# Points that a branch has as a rule; in a window those of two branches, and of all curves of a motion together.
BRANCH_POINTS = 150
WINDOW_BRANCH_POINTS = 100
CURVES_POINTS = 200
CURVE_POINT_BRANCHES = 2.0
# Explaining the borders of a map, per mass: for each point, whose orbit is solved for, and for each of the points along
# a side, for borders are lines. What counts is how many motions there are, which nobody knows before: a seventh of it
# round the codimension-two point of the default oscillator, up to five times as much over all of Figure 8. The core
# ends it at `tolerances.BORDERS_WORK`, and says so.
BORDERS_POINT_SECONDS = 1.0e-4
BORDERS_SIDE_SECONDS = 0.25
# Points times masses of a map whose borders are explained, at most: each keeps its orbit in memory.
MOST_BORDER_NUMBERS = 900_000
# Steps of a job's progress in which that is told, at the least.
BORDERS_STEPS = 100
MOST_STEPS_AFTER = 1000
# Places of a window at which a motion is looked for.
CURVES_PLACES = 9

Tile = tuple[int, int, int, int]


class Plan(BaseModel):
    """A grid of `rows` (clearance) by `columns` (omega), cut into rectangles of `tile_rows` by `tile_columns`.

    `after` is what putting the tiles together counts in a job's progress, beside 1 for each tile; with 0 it counts
    nothing, and the progress is that of the tiles.
    """

    model_config = ConfigDict(frozen=True)

    rows: int = 1
    columns: int = 1
    tile_rows: int = 1
    tile_columns: int = 1
    after: int = 0
    estimate: Estimate = Estimate()

    @property
    def down(self) -> int:
        """Number of tiles along clearance."""
        return -(-self.rows // self.tile_rows)

    @property
    def across(self) -> int:
        """Number of tiles along omega."""
        return -(-self.columns // self.tile_columns)

    @property
    def count(self) -> int:
        """Number of tiles."""
        return self.down * self.across

    def tile(self, index: int) -> Tile:
        """Return (row_start, row_stop, col_start, col_stop) of a tile in the grid [clearance, omega].

        Raises
        ------
        IndexError
            There is no such tile.
        """
        if not 0 <= index < self.count:
            raise IndexError(index)
        row = index // self.across * self.tile_rows
        column = index % self.across * self.tile_columns
        return row, min(row + self.tile_rows, self.rows), column, min(column + self.tile_columns, self.columns)

    @property
    def tiles(self) -> list[Tile]:
        """All tiles, row by row; a list position is a tile's number."""
        return [self.tile(index) for index in range(self.count)]


def plan(process: str, request: ProcessRequest) -> Plan:
    """Return the tiles of a request and its estimate.

    Raises
    ------
    KeyError
        There is no such process.
    """
    match request:
        case BifurcationDiagramsRequest():
            values = grid_values(request.range)
            each = request.transient_periods + request.periods
            omegas = values if request.vary == "omega" else np.full(len(values), request.fixed)
            costs = float(period_costs(request.oscillator, omegas).sum())
            seconds = (each + DIAGRAM_EXPONENT_PERIODS) * costs / PERIODS_PER_SECOND
            return Plan(estimate=Estimate(periods=float(len(values) * each), seconds=seconds))
        case BifurcationCurvesRequest() if request.motions is not None:
            return _curves_plan(request)
        case BifurcationCurvesRequest():
            seconds = request.max_multiple * request.points * request.oscillator.size * CURVE_POINT_SECONDS
            return Plan(estimate=Estimate(seconds=seconds))
        case PeriodicOrbitsRequest():
            return _orbit_plan(request)
        case UnfoldingMapsRequest():
            return _map_plan(request)
        case UnfoldingDiagramsRequest():
            return _diagram_plan(request)
        case BasinsRequest():
            return _basins_plan(request)
        case TrajectoriesRequest():
            periods = float(len(request.states) * (request.transient_periods + request.periods))
            cost = float(period_costs(request.oscillator, np.array([request.omega]))[0])
            return Plan(estimate=Estimate(periods=periods, seconds=periods * cost / PERIODS_PER_SECOND))
        case GrazingCurvesRequest():
            seconds = grid_points(request.omega) * (1 + request.max_order) * request.oscillator.size * CURVE_SECONDS
            return Plan(estimate=Estimate(seconds=seconds))
        case CodimensionTwoPointsRequest():
            orders = request.max_order + 2 * request.max_multiple
            work = orders**2 * (request.omega.stop - request.omega.start) * request.oscillator.size
            return Plan(estimate=Estimate(seconds=work * POINTS_SECONDS))
        case DiscontinuityMappingsRequest():
            cost = float(period_costs(request.oscillator, np.array([request.omega]))[0])
            seconds = len(request.overshoot) * (MAPPING_SECONDS + request.returns * cost / PERIODS_PER_SECOND)
            return Plan(estimate=Estimate(seconds=seconds))
    raise KeyError(process)


def spectral_bound(oscillator: Oscillator) -> float:
    """Return an upper bound of |lambda| over the eigenvalues of M x'' + C x' + K x = 0.

    With nu and mu the largest absolute row sums of M^-1 C and M^-1 K (Gershgorin), lambda^2 <= nu lambda + mu.
    Infinite where the numbers overflow.
    """
    masses = np.array(oscillator.masses)
    with np.errstate(over="ignore", invalid="ignore"):
        mu = float((_row_sums(np.array(oscillator.stiffnesses)) / masses).max())
        if isinstance(oscillator.damping, list):
            factor = 2.0 if oscillator.units == "nondimensional" else 1.0
            nu = float((factor * _row_sums(np.array(oscillator.damping)) / masses).max())
        else:
            nu = 2.0 * oscillator.damping * mu
    bound = 0.5 * (nu + math.hypot(nu, 2.0 * math.sqrt(mu)))
    return math.inf if math.isnan(bound) else bound


def period_costs(
    oscillator: Oscillator, omega: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return what a forcing period costs at each omega, shape (n,), in periods of the default oscillator, >= 1."""
    with np.errstate(over="ignore"):
        stiffness = spectral_bound(oscillator) * 2.0 * math.pi / omega
    return np.maximum(1.0, stiffness / REFERENCE_STIFFNESS)


def _row_sums(links: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Absolute row sums of a chain's matrix: link i joins mass i to mass i + 1, the last one to ground."""
    before = np.concatenate(([0.0], links[:-1]))
    after = np.concatenate((links[:-1], [0.0]))
    return 2.0 * (before + after) + np.concatenate((np.zeros(len(links) - 1), links[-1:]))


def expected_periods(max_periods: int) -> float:
    """Return the forcing periods that a pixel is expected to take on average."""
    return min(float(max_periods), PERIODS_TO_SETTLE + UNSETTLED * max_periods)


def _map_plan(request: UnfoldingMapsRequest) -> Plan:
    rows, columns = grid_points(request.clearance), grid_points(request.omega)
    cost = float(period_costs(request.oscillator, grid_values(request.omega)).mean())
    periods_per_pixel = expected_periods(request.max_periods)
    sweeps = request.policy.startswith("sweep")
    rate = SWEEP_PERIODS_PER_SECOND if sweeps else MAP_PERIODS_PER_SECOND
    starts = request.initial_conditions if request.policy == "ensemble" else 1
    if request.preview:
        cost /= PREVIEW_FASTER
    if not sweeps:
        cost *= starts * math.sqrt(FULL_COLUMN / min(starts * rows, LONGEST_COLUMN))
    if request.adaptive:
        return _adaptive_plan(rows, columns, starts, request.max_periods, cost / MAP_PERIODS_PER_SECOND)
    pixel_seconds = periods_per_pixel * cost / rate
    at_worst = WORST_SLOWER * request.max_periods * cost / rate
    pixels_per_tile = _pixels_per_tile(pixel_seconds, at_worst)
    tile_rows = rows if sweeps else _even(rows, min(pixels_per_tile, TALLEST_TILE))
    tile_columns = _even(columns, max(1, pixels_per_tile // tile_rows))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return _estimated(shape, starts * periods_per_pixel, pixel_seconds)


def _adaptive_plan(rows: int, columns: int, starts: int, max_periods: int, period_seconds: float) -> Plan:
    """Return strips, and the cost from the share of pixels that are expected to be computed.

    `period_seconds` is what a forcing period of all trajectories of a pixel takes.
    """
    share = min(1.0, (ADAPTIVE_SIDE / math.sqrt(rows * columns)) ** ADAPTIVE_POWER)
    periods = share * min(float(max_periods), ADAPTIVE_PERIODS * expected_periods(max_periods))
    longest = round(WORST_TILE_SECONDS / (WORST_SLOWER * max_periods * period_seconds * ADAPTIVE_COLUMNS))
    shape = Plan(
        rows=rows,
        columns=columns,
        tile_rows=_even(rows, max(1, min(longest, ADAPTIVE_ROWS))),
        tile_columns=min(columns, ADAPTIVE_COLUMNS),
    )
    shape = shape.model_copy(update={"after": shape.count // ADAPTIVE_STRIPS_CLOSED})
    return _estimated(shape, starts * periods, periods * period_seconds)


def curves_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return what the curves and points over the map of a diagram take."""
    over = (
        plan("grazing-curves", request.grazing_curve),
        plan("codimension-two-points", request.codimension_two_points),
        plan("bifurcation-curves", request.bifurcation_curves),
    )
    return sum(planned.estimate.seconds for planned in over)


def borders_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return what explaining the borders of a map takes."""
    if not request.borders:
        return 0.0
    points = float(grid_points(request.omega) * grid_points(request.clearance))
    return request.oscillator.size * (BORDERS_POINT_SECONDS * points + BORDERS_SIDE_SECONDS * math.sqrt(points))


def _diagram_plan(request: UnfoldingDiagramsRequest) -> Plan:
    """Return the plan of the map, and as many steps after its tiles as tiles would take so long."""
    shape = _map_plan(request.unfolding_map)
    seconds = curves_seconds(request) + borders_seconds(request)
    after = math.ceil(min(seconds * shape.count / shape.estimate.seconds, MOST_STEPS_AFTER))
    estimate = shape.estimate.model_copy(update={"seconds": shape.estimate.seconds + seconds})
    return shape.model_copy(update={"after": max(after, BORDERS_STEPS if request.borders else 1), "estimate": estimate})


def _orbit_plan(request: PeriodicOrbitsRequest) -> Plan:
    """Return the cost of finding an orbit, by trajectories where no impacts are given, and of its branch."""
    cost = float(period_costs(request.oscillator, np.array([request.omega]))[0])
    periods = float(request.transient_periods) if request.motion is None else 0.0
    impacts = float(request.max_period)
    if request.motion is not None:
        impacts = float(len(request.motion.stops))
        periods = SEARCH_PERIODS if request.motion.phases is None else 0.0
    seconds = periods * cost / PERIODS_PER_SECOND
    if isinstance(request, OrbitBranchesRequest):
        points = min(request.max_points, BRANCH_POINTS)
        seconds += points * _branch_point_seconds(request, impacts)
    return Plan(estimate=Estimate(periods=periods, seconds=seconds))


def _branch_point_seconds(request: ProcessRequest, impacts: float) -> float:
    return BRANCH_SECONDS * (1.0 + (impacts / BRANCH_IMPACTS) ** 2) * request.oscillator.size


def _curves_plan(request: BifurcationCurvesRequest) -> Plan:
    """Return the cost of finding motions in a window, and of following their curves.

    A point of a curve takes singular values and differences, together a few times as much as a point of a branch.
    """
    cost = float(period_costs(request.oscillator, np.array([request.omega.start]))[0])
    periods, seconds = 0.0, 0.0
    for motion in request.motions or ():
        impacts = len(motion.stops)
        places = 0 if motion.phases is not None else 1
        places *= 1 if motion.omega is not None and motion.clearance is not None else CURVES_PLACES
        periods += places * SEARCH_PERIODS
        point = _branch_point_seconds(request, float(impacts))
        seconds += (WINDOW_BRANCH_POINTS + CURVE_POINT_BRANCHES * CURVES_POINTS) * point
    return Plan(estimate=Estimate(periods=periods, seconds=seconds + periods * cost / PERIODS_PER_SECOND))


def _basins_plan(request: BasinsRequest) -> Plan:
    """Return tiles of whole rows, if they are short enough: all states of a tile run side by side."""
    rows, columns = grid_points(request.vertical.values), grid_points(request.horizontal.values)
    cost = float(period_costs(request.oscillator, np.array([request.omega]))[0])
    periods = min(float(request.max_periods), PERIODS_TO_SETTLE + BASIN_UNSETTLED * request.max_periods)
    seconds = periods * cost / BASIN_PERIODS_PER_SECOND
    at_worst = WORST_SLOWER * request.max_periods * cost / MAP_PERIODS_PER_SECOND
    pixels_per_tile = _pixels_per_tile(seconds, at_worst)
    tile_columns = _even(columns, pixels_per_tile)
    tile_rows = _even(rows, max(1, pixels_per_tile // tile_columns))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return _estimated(shape, periods, seconds)


def _pixels_per_tile(seconds: float, at_worst: float) -> int:
    return max(1, round(min(TILE_SECONDS / seconds, WORST_TILE_SECONDS / at_worst)))


def _estimated(shape: Plan, periods: float, seconds: float) -> Plan:
    """Return a plan with its estimate, from the forcing periods and seconds of a pixel."""
    pixels = float(shape.rows * shape.columns)
    estimate = Estimate(periods=pixels * periods, tiles=shape.count, seconds=pixels * seconds)
    return shape.model_copy(update={"estimate": estimate})


def _even(length: int, longest: int) -> int:
    """Return the length of equal pieces, none longer than `longest`, that a length is cut into."""
    return -(-length // -(-length // min(length, longest)))
