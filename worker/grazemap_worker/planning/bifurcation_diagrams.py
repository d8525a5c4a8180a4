"""The cost of a bifurcation diagram: the same number of forcing periods at each value of the parameter."""

from __future__ import annotations

import math

from grazemap.wire import BifurcationDiagramsRequest, Estimate, grid_points, grid_values
from grazemap_worker.planning.costs import (
    chance_seconds,
    expected_periods,
    mean_cost,
    orbit_seconds,
    period_cost,
    setup_seconds,
)
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning, of_points
from grazemap_worker.planning.rates import (
    DIAGRAM_SETTLING_PERIODS,
    FULL_COLUMN,
    MAP_PERIODS_PER_SECOND,
    PERIODS_PER_SECOND,
)


def _plan(request: BifurcationDiagramsRequest) -> Plan:
    values = grid_values(request.range)
    each = request.transient_periods + request.periods
    fixed = [request.fixed]
    omega, clearance = (request.range, fixed) if request.vary == "omega" else (fixed, request.range)
    costs = len(values) * mean_cost(request.oscillator, omega, clearance)
    watched = each + DIAGRAM_SETTLING_PERIODS
    alone = 4.0 * math.sqrt(FULL_COLUMN) / MAP_PERIODS_PER_SECOND  # and with the growth of changes
    seconds = costs * (each / PERIODS_PER_SECOND + expected_periods(request.oscillator, watched) * alone)
    seconds += chance_seconds(request.oscillator, len(values), watched, costs / len(values))
    orbit = orbit_seconds(request.oscillator, omega, clearance, watched)
    seconds += len(values) * (setup_seconds(request.oscillator) + orbit)
    return Plan(estimate=Estimate(periods=float(len(values) * each), seconds=seconds))


def _counts(request: BifurcationDiagramsRequest, limits: Limits) -> list[Count]:
    values, each = grid_points(request.range), request.transient_periods + request.periods
    return [
        Count(of_points("range", request.range), "points", values, limits.points),
        Count("/periods", "samples", values * request.periods, limits.points),
        Count("/periods", "periods", values * each, limits.tile_periods),
    ]


def _longest_period(request: BifurcationDiagramsRequest) -> float:
    least = float(grid_values(request.range)[0])
    omega, clearance = (least, request.fixed) if request.vary == "omega" else (request.fixed, least)
    return period_cost(request.oscillator, omega, clearance)


PLANNING = Planning(_plan, _counts, _longest_period, kernels="diagrams", of_masses=True)
