"""The cost of finding a periodic orbit, by trajectories where no impacts are given."""

from __future__ import annotations

from grazemap.wire import Estimate, PeriodicOrbitsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import longest_at_point, period_cost, setup_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning


def plan(request: PeriodicOrbitsRequest) -> Plan:
    """Return the cost of finding an orbit."""
    periods = float(request.transient_periods) if request.motion is None else 0.0
    if request.motion is not None:
        periods = rates.SEARCH_PERIODS if request.motion.phases is None else 0.0
    seconds = periods * period_cost(request.oscillator, request.omega, request.clearance) / rates.PERIODS_PER_SECOND
    if request.observed:
        seconds += rates.OBSERVED_ORBIT_SECONDS
    return Plan(estimate=Estimate(periods=periods, seconds=seconds + setup_seconds(request.oscillator)))


def counts(request: PeriodicOrbitsRequest, limits: Limits) -> list[Count]:
    """Return the periods of the transient."""
    return [Count("/transient_periods", "periods", request.transient_periods, limits.tile_periods)]


PLANNING = Planning(plan, counts, longest_at_point, kernels="orbits")
