"""The tiles of an unfolding map.

Its grid is cut into equal rectangles (the last ones smaller) that should take `TILE_SECONDS` each, as tall as possible,
because the clearances of one omega run side by side. The result does not depend on the tiles. The tiles of a sweep are
whole columns. Those of an adaptive map are strips of `ADAPTIVE_COLUMNS`, which do affect the choice of the computed
points.
"""

from __future__ import annotations

import math

from grazemap.wire import UnfoldingDiagramsRequest, UnfoldingMapsRequest, grid_points, grid_values
from grazemap_worker.planning.costs import (
    chance_seconds,
    expected_periods,
    mean_cost,
    orbit_seconds,
    period_cost,
    setup_seconds,
)
from grazemap_worker.planning.plan import Plan, estimated, even, pixels_per_tile
from grazemap_worker.planning.planning import Count, Limits, Planning, of_grid
from grazemap_worker.planning.rates import (
    ADAPTIVE_COLUMNS,
    ADAPTIVE_PERIODS,
    ADAPTIVE_POWER,
    ADAPTIVE_ROWS,
    ADAPTIVE_SIDE,
    ADAPTIVE_STRIPS_CLOSED,
    COLUMN_SETUPS,
    FULL_COLUMN,
    LONGEST_COLUMN,
    MAP_PERIODS_PER_SECOND,
    PREVIEW_FASTER,
    RESOLUTION_AT_WORST,
    RESOLUTION_SECONDS,
    SENSITIVE,
    SWEEP_PERIODS_PER_SECOND,
    TALLEST_TILE,
    WORST_SLOWER,
    WORST_TILE_SECONDS,
)


def plan(request: UnfoldingMapsRequest) -> Plan:
    """Return the tiles of a map and its estimate."""
    rows, columns = grid_points(request.clearance), grid_points(request.omega)
    cost = mean_cost(request.oscillator, request.omega, request.clearance)
    periods_per_pixel = expected_periods(request.oscillator, request.max_periods)
    sweeps = request.policy.startswith("sweep")
    rate = SWEEP_PERIODS_PER_SECOND if sweeps else MAP_PERIODS_PER_SECOND
    starts = request.initial_conditions if request.policy == "ensemble" else 1
    more = setup_seconds(request.oscillator)
    column = COLUMN_SETUPS * more
    orbit = 0.0
    if request.preview:
        cost /= PREVIEW_FASTER
    else:
        orbit = orbit_seconds(request.oscillator, request.omega, request.clearance, request.max_periods)
        more += chance_seconds(request.oscillator, starts * rows * columns, request.max_periods, cost)
    if not sweeps:
        cost *= starts * math.sqrt(FULL_COLUMN / min(starts * rows, LONGEST_COLUMN))
    if request.adaptive:
        return _adaptive_plan(request, starts, cost / MAP_PERIODS_PER_SECOND, starts * orbit, more + columns * column)
    pixel_seconds = periods_per_pixel * cost / rate + starts * orbit + column / rows
    at_worst = request.max_periods * cost / rate
    if request.resolve_sensitive:
        pixel_seconds += starts * SENSITIVE * RESOLUTION_SECONDS
        at_worst += starts * RESOLUTION_AT_WORST
    pixels = pixels_per_tile(pixel_seconds, WORST_SLOWER * at_worst)
    tile_rows = rows if sweeps else even(rows, min(pixels, TALLEST_TILE))
    tile_columns = even(columns, max(1, pixels // tile_rows))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return estimated(shape, starts * periods_per_pixel, pixel_seconds, more)


def _adaptive_plan(
    request: UnfoldingMapsRequest, starts: int, period_seconds: float, orbit_seconds: float, more_seconds: float
) -> Plan:
    """Return a plan of strips, with the cost from the expected share of computed pixels.

    `period_seconds` is the time for a forcing period of all trajectories of a pixel, `orbit_seconds` that
    for their orbits, `more_seconds` that of all else.
    """
    rows, columns, max_periods = grid_points(request.clearance), grid_points(request.omega), request.max_periods
    share = min(1.0, (ADAPTIVE_SIDE / math.sqrt(rows * columns)) ** ADAPTIVE_POWER)
    periods = share * min(float(max_periods), ADAPTIVE_PERIODS * expected_periods(request.oscillator, max_periods))
    longest = round(WORST_TILE_SECONDS / (WORST_SLOWER * max_periods * period_seconds * ADAPTIVE_COLUMNS))
    shape = Plan(
        rows=rows,
        columns=columns,
        tile_rows=even(rows, max(1, min(longest, ADAPTIVE_ROWS))),
        tile_columns=min(columns, ADAPTIVE_COLUMNS),
    )
    shape = shape.model_copy(update={"after": shape.count // ADAPTIVE_STRIPS_CLOSED})
    return estimated(shape, starts * periods, periods * period_seconds + share * orbit_seconds, more_seconds)


def grid_count(request: UnfoldingMapsRequest | UnfoldingDiagramsRequest, limit: int) -> Count:
    """Return the points of the grid of a map, or of a diagram."""
    return of_grid(("omega", request.omega), ("clearance", request.clearance), limit)


def _counts(request: UnfoldingMapsRequest, limits: Limits) -> list[Count]:
    return [grid_count(request, limits.adaptive_pixels if request.adaptive else limits.pixels)]


def longest_period(request: UnfoldingMapsRequest | UnfoldingDiagramsRequest) -> float:
    """Return the cost of a period at the minimum omega of the grid."""
    omega, clearance = (float(grid_values(side)[0]) for side in (request.omega, request.clearance))
    return period_cost(request.oscillator, omega, clearance)


PLANNING = Planning(plan, _counts, longest_period, kernels="maps", of_masses=True)
