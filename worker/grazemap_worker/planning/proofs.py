"""The cost of a proof, which its time limit bounds."""

from __future__ import annotations

from grazemap.wire import Estimate, ProofsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.plan import SMALL_SECONDS, Plan
from grazemap_worker.planning.planning import Planning


def _plan(request: ProofsRequest) -> Plan:
    seconds = min(rates.PROOF_SECONDS[request.statement.kind], request.time_limit)
    # it has a process of its own for its limit of time, so it is not small
    return Plan(estimate=Estimate(seconds=max(SMALL_SECONDS, seconds)))


PLANNING = Planning(_plan, kernels="orbits")
