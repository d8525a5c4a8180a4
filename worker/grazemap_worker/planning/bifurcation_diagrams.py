"""The cost of a bifurcation diagram: the same number of forcing periods at each value of the parameter."""

from __future__ import annotations

from grazemap.wire import BifurcationDiagramsRequest, Estimate, grid_points, grid_values
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import (
    Samples,
    chance_seconds,
    longest_period,
    setup_seconds,
)
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning, of_points


def _plan(request: BifurcationDiagramsRequest) -> Plan:
    values = grid_values(request.range)
    each = request.transient_periods + request.periods
    samples = Samples.of(request.line)
    costs = len(values) * samples.mean_cost(lanes=False)
    watched = each + rates.DIAGRAM_SETTLING_PERIODS
    settling = samples.settling(watched)
    # a motion that has not settled is looked at once more from the end of the record
    named = settling.periods + settling.unsettled * rates.DIAGRAM_SETTLING_PERIODS
    seconds = costs * (each + rates.GROWTH_SLOWER * named) / rates.PERIODS_PER_SECOND
    seconds += chance_seconds(settling.unsettled * len(values), watched, costs / len(values))
    orbit = settling.orbit_seconds
    seconds += len(values) * (setup_seconds(request.oscillator) + orbit)
    seconds += len(values) * samples.observed_seconds(request, costs / len(values), settling.unsettled)
    return Plan(estimate=Estimate(periods=float(len(values) * each), seconds=seconds))


def _counts(request: BifurcationDiagramsRequest, limits: Limits) -> list[Count]:
    values, each = grid_points(request.range), request.transient_periods + request.periods
    return [
        Count(of_points("range", request.range), "points", values, limits.points),
        Count("/periods", "samples", values * request.periods, limits.points),
        Count("/periods", "periods", values * each, limits.tile_periods),
    ]


PLANNING = Planning(_plan, _counts, lambda request: longest_period(request.line), kernels="diagrams", of_masses=True)
