"""The tiles of basin fractions: values of the parameter by initial states; the states of a value run side by side."""

from __future__ import annotations

from grazemap.wire import BasinFractionsRequest, grid_points
from grazemap_worker.planning import rates
from grazemap_worker.planning.basins import plan_of_states
from grazemap_worker.planning.costs import Samples, longest_period, setup_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning, of_points


def _plan(request: BasinFractionsRequest) -> Plan:
    samples = Samples.of(request.line)
    grid = Plan(rows=grid_points(request.range), columns=request.states)
    setup = setup_seconds(request.oscillator) / request.states
    settles = samples.settling(request.max_periods)
    return plan_of_states(request, grid, request.states, settles, samples.mean_cost(), setup)


def _counts(request: BasinFractionsRequest, limits: Limits) -> list[Count]:
    values = grid_points(request.range)
    return [
        Count(of_points("range", request.range), "points", values, min(limits.points, rates.FRACTION_VALUES)),
        Count("/states", "points", values * request.states, limits.pixels),
    ]


PLANNING = Planning(_plan, _counts, lambda request: longest_period(request.line), kernels="maps", of_masses=True)
