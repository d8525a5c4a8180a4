"""The cost of a discontinuity mapping: of its graze, of each overshoot, and of its returns."""

from __future__ import annotations

from grazemap.wire import DiscontinuityMappingsRequest, Estimate
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import period_cost
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import BYTES_PER_NUMBER, Count, Limits, Planning


def _plan(request: DiscontinuityMappingsRequest) -> Plan:
    cost = period_cost(request.oscillator, request.omega, max(request.overshoot))
    each = rates.OVERSHOOT_SECONDS + rates.OVERSHOOT_MASS_SECONDS * request.oscillator.size
    returns = request.returns * (1 if request.are_alike else 2)
    seconds = rates.MAPPING_SECONDS + len(request.overshoot) * (each + returns * cost / rates.PERIODS_PER_SECOND)
    return Plan(estimate=Estimate(seconds=seconds))


def _counts(request: DiscontinuityMappingsRequest, limits: Limits) -> list[Count]:
    # two states, by the map and by the motion, at every return
    numbers = 2 * (2 * request.oscillator.size + 1) * (request.returns + 1) * len(request.overshoot)
    return [
        Count("/returns", "bytes", numbers * BYTES_PER_NUMBER, limits.result_bytes),
        Count("/returns", "periods", len(request.overshoot) * request.returns, limits.tile_periods),
    ]


PLANNING = Planning(
    _plan,
    _counts,
    lambda request: period_cost(request.oscillator, request.omega, max(request.overshoot)),
    kernels="orbits",
)
