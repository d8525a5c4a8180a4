"""The cost of codimension-two points, which grows with the square of the maximum order."""

from __future__ import annotations

from grazemap.wire import CodimensionTwoPointsRequest, Estimate
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning
from grazemap_worker.planning.rates import POINTS_SECONDS


def _plan(request: CodimensionTwoPointsRequest) -> Plan:
    orders = request.max_order + 2 * request.max_multiple
    work = orders**2 * (request.omega.stop - request.omega.start) * request.oscillator.size
    return Plan(estimate=Estimate(seconds=work * POINTS_SECONDS))


PLANNING = Planning(_plan)
