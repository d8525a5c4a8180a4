"""The cost of codimension-two points, which grows with the maximum order."""

from __future__ import annotations

from grazemap.wire import CodimensionTwoPointsRequest, Estimate
from grazemap_worker.planning.costs import codimension_two_seconds, peaks_seconds, setup_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning


def _plan(request: CodimensionTwoPointsRequest) -> Plan:
    ends = request.omega.start, request.omega.stop
    seconds = codimension_two_seconds(request, *ends, request.max_order, request.max_multiple)
    seconds += peaks_seconds(request.oscillator, *ends)
    return Plan(estimate=Estimate(seconds=setup_seconds(request.oscillator) + seconds))


PLANNING = Planning(_plan)
