"""The planner: the tiles of each request and its estimate.

The service makes the plan, without the core, and the worker reads it. Only maps and basins have more than one tile. A
map's grid is cut into equal rectangles (the last ones smaller) that should take `TILE_SECONDS` each, as tall as
possible, because the clearances of one omega run side by side; the bytes of a result do not depend on the cut. A
sweep's tiles are whole columns. An adaptive map's are strips of `ADAPTIVE_COLUMNS`: which of its points are computed
does depend on them.
"""

from __future__ import annotations

import math

import numpy as np

from grazemap.wire import (
    BasinsRequest,
    BifurcationCurvesRequest,
    BifurcationDiagramsRequest,
    CodimensionTwoPointsRequest,
    DiscontinuityMappingsRequest,
    Estimate,
    GrazingCurvesRequest,
    OrbitBranchesRequest,
    PeriodicOrbitsRequest,
    ProcessRequest,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
    UnfoldingMapsRequest,
    grid_points,
    grid_values,
)
from grazemap_worker.planning.costs import expected_periods, period_costs
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.rates import (
    ADAPTIVE_COLUMNS,
    ADAPTIVE_PERIODS,
    ADAPTIVE_POWER,
    ADAPTIVE_ROWS,
    ADAPTIVE_SIDE,
    ADAPTIVE_STRIPS_CLOSED,
    BASIN_PERIODS_PER_SECOND,
    BASIN_UNSETTLED,
    BORDERS_POINT_SECONDS,
    BORDERS_SIDE_SECONDS,
    BORDERS_STEPS,
    BRANCH_IMPACTS,
    BRANCH_POINTS,
    BRANCH_SECONDS,
    CURVE_POINT_BRANCHES,
    CURVE_POINT_SECONDS,
    CURVE_SECONDS,
    CURVES_PLACES,
    CURVES_POINTS,
    DIAGRAM_EXPONENT_PERIODS,
    FULL_COLUMN,
    LONGEST_COLUMN,
    MAP_PERIODS_PER_SECOND,
    MAPPING_SECONDS,
    MOST_STEPS_AFTER,
    PERIODS_PER_SECOND,
    PERIODS_TO_SETTLE,
    POINTS_SECONDS,
    PREVIEW_FASTER,
    SEARCH_PERIODS,
    SWEEP_PERIODS_PER_SECOND,
    TALLEST_TILE,
    TILE_SECONDS,
    WINDOW_BRANCH_POINTS,
    WORST_SLOWER,
    WORST_TILE_SECONDS,
)


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
    """Return the seconds that the curves and points over the map of a diagram take."""
    over = (
        plan("grazing-curves", request.grazing_curve),
        plan("codimension-two-points", request.codimension_two_points),
        plan("bifurcation-curves", request.bifurcation_curves),
    )
    return sum(planned.estimate.seconds for planned in over)


def borders_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return the seconds that explaining the borders of a map takes."""
    if not request.borders:
        return 0.0
    points = float(grid_points(request.omega) * grid_points(request.clearance))
    return request.oscillator.size * (BORDERS_POINT_SECONDS * points + BORDERS_SIDE_SECONDS * math.sqrt(points))


def _diagram_plan(request: UnfoldingDiagramsRequest) -> Plan:
    """Return the plan of the map, with steps after its tiles: as many as tiles would take the same time."""
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
