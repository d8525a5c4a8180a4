"""The tiles of basins: whole rows, if they are short enough, because all states of a tile run side by side."""

from __future__ import annotations

import math

from grazemap.wire import BasinFractionsRequest, BasinsRequest, grid_points
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import (
    Points,
    Settling,
    chance_seconds,
    longest_at_point,
    period_cost,
    settling,
    setup_seconds,
)
from grazemap_worker.planning.plan import Plan, estimated, even, pixels_per_tile
from grazemap_worker.planning.planning import Count, Limits, Planning, of_grid


def _plan(request: BasinsRequest) -> Plan:
    rows, columns = grid_points(request.vertical.values), grid_points(request.horizontal.values)
    cost = period_cost(request.oscillator, request.omega, request.clearance, lanes=True)
    settles = settling(request.oscillator, Points.of([(request.omega, request.clearance)]), request.max_periods)
    return plan_of_states(request, Plan(rows=rows, columns=columns), rows * columns, settles, cost)


def plan_of_states(
    request: BasinsRequest | BasinFractionsRequest,
    grid: Plan,
    together: int,
    settles: Settling,
    cost: float,
    setup: float = 0.0,
) -> Plan:
    """Return the tiles of a grid of initial states, and the estimate.

    Parameters
    ----------
    grid : Plan
        With its rows and columns.
    together : int
        Number of states that may run side by side.
    settles : Settling
    cost : float
        Mean cost of a forcing period, as `costs.period_costs`.
    setup : float
        Seconds for each state besides those of its forcing periods and of its orbit.
    """
    oscillator, most = request.oscillator, request.max_periods
    lanes = math.sqrt(rates.FULL_COLUMN / min(together, rates.FULL_COLUMN))
    seconds = settles.periods * cost * lanes / rates.BASIN_PERIODS_PER_SECOND
    seconds += rates.BASIN_ORBITS * settles.orbit_seconds + setup
    at_worst = rates.WORST_SLOWER * most * cost / rates.MAP_PERIODS_PER_SECOND
    sample = chance_seconds(grid.rows * grid.columns, most, cost, rates.RUN_ON_SAMPLE)
    chance = settles.unsettled * sample  # all are chaotic, or none is
    pixels = pixels_per_tile(seconds, at_worst)
    tile_columns = even(grid.columns, pixels)
    tile_rows = even(grid.rows, max(1, pixels // tile_columns))
    shape = grid.model_copy(update={"tile_rows": tile_rows, "tile_columns": tile_columns})
    return estimated(shape, settles.periods, seconds, shape.count * setup_seconds(oscillator) + chance)


def _counts(request: BasinsRequest, limits: Limits) -> list[Count]:
    across, down = ("horizontal/values", request.horizontal.values), ("vertical/values", request.vertical.values)
    return [of_grid(across, down, limits.pixels)]


PLANNING = Planning(_plan, _counts, longest_at_point, kernels="maps", of_masses=True)
