"""The cost of finding a periodic orbit, by trajectories where no impacts are given."""

from __future__ import annotations

from grazemap.wire import Estimate, PeriodicOrbitsRequest
from grazemap_worker.planning.costs import period_cost, setup_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning
from grazemap_worker.planning.rates import PERIODS_PER_SECOND, SEARCH_PERIODS


def plan(request: PeriodicOrbitsRequest) -> Plan:
    """Return the cost of finding an orbit."""
    periods = float(request.transient_periods) if request.motion is None else 0.0
    if request.motion is not None:
        periods = SEARCH_PERIODS if request.motion.phases is None else 0.0
    seconds = periods * period_cost(request.oscillator, request.omega, request.clearance) / PERIODS_PER_SECOND
    return Plan(estimate=Estimate(periods=periods, seconds=seconds + setup_seconds(request.oscillator)))


def counts(request: PeriodicOrbitsRequest, limits: Limits) -> list[Count]:
    """Return the periods of the transient."""
    return [Count("/transient_periods", "periods", request.transient_periods, limits.tile_periods)]


PLANNING = Planning(plan, counts, lambda request: period_cost(request.oscillator, request.omega, request.clearance))
