"""The tiles of basins: whole rows, if they are short enough, because all states of a tile run side by side."""

from __future__ import annotations

import math

from grazemap.wire import BasinsRequest, grid_points
from grazemap_worker.planning.costs import chance_seconds, expected_periods, orbit_seconds, period_cost, setup_seconds
from grazemap_worker.planning.plan import Plan, estimated, even, pixels_per_tile
from grazemap_worker.planning.planning import Count, Limits, Planning, of_grid
from grazemap_worker.planning.rates import (
    BASIN_PERIODS_PER_SECOND,
    BASIN_UNSETTLED,
    FULL_COLUMN,
    MAP_PERIODS_PER_SECOND,
    WORST_SLOWER,
)


def _plan(request: BasinsRequest) -> Plan:
    rows, columns = grid_points(request.vertical.values), grid_points(request.horizontal.values)
    cost = period_cost(request.oscillator, request.omega, request.clearance, lanes=True)
    periods = expected_periods(request.oscillator, request.max_periods, BASIN_UNSETTLED)
    lanes = math.sqrt(FULL_COLUMN / min(rows * columns, FULL_COLUMN))
    orbit = orbit_seconds(request.oscillator, [request.omega], [request.clearance], request.max_periods)
    seconds = periods * cost * lanes / BASIN_PERIODS_PER_SECOND + orbit
    at_worst = WORST_SLOWER * request.max_periods * cost / MAP_PERIODS_PER_SECOND
    chance = BASIN_UNSETTLED * chance_seconds(request.oscillator, rows * columns, request.max_periods, cost)
    pixels = pixels_per_tile(seconds, at_worst)
    tile_columns = even(columns, pixels)
    tile_rows = even(rows, max(1, pixels // tile_columns))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return estimated(shape, periods, seconds, shape.count * setup_seconds(request.oscillator) + chance)


def _counts(request: BasinsRequest, limits: Limits) -> list[Count]:
    across, down = ("horizontal/values", request.horizontal.values), ("vertical/values", request.vertical.values)
    return [of_grid(across, down, limits.pixels)]


PLANNING = Planning(
    _plan,
    _counts,
    lambda request: period_cost(request.oscillator, request.omega, request.clearance),
    kernels="maps",
    of_masses=True,
)
