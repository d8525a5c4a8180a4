"""The cost of a bifurcation diagram: the same number of forcing periods at each value of the parameter."""

from __future__ import annotations

import numpy as np

from grazemap.wire import BifurcationDiagramsRequest, Estimate, grid_points, grid_values
from grazemap_worker.planning.costs import period_cost, period_costs
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning, of_points
from grazemap_worker.planning.rates import DIAGRAM_SETTLING_PERIODS, PERIODS_PER_SECOND


def _plan(request: BifurcationDiagramsRequest) -> Plan:
    values = grid_values(request.range)
    each = request.transient_periods + request.periods
    omegas = values if request.vary == "omega" else np.full(len(values), request.fixed)
    costs = float(period_costs(request.oscillator, omegas).sum())
    seconds = (each + DIAGRAM_SETTLING_PERIODS) * costs / PERIODS_PER_SECOND
    return Plan(estimate=Estimate(periods=float(len(values) * each), seconds=seconds))


def _counts(request: BifurcationDiagramsRequest, limits: Limits) -> list[Count]:
    values, each = grid_points(request.range), request.transient_periods + request.periods
    return [
        Count(of_points("range", request.range), "points", values, limits.points),
        Count("/periods", "samples", values * request.periods, limits.points),
        Count("/periods", "periods", values * each, limits.tile_periods),
    ]


def _longest_period(request: BifurcationDiagramsRequest) -> float:
    least = float(grid_values(request.range)[0]) if request.vary == "omega" else request.fixed
    return period_cost(request.oscillator, least)


PLANNING = Planning(_plan, _counts, _longest_period, kernels="diagrams", of_masses=True)
