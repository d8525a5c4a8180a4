"""The cost of a proof, which its time limit bounds."""

from __future__ import annotations

from grazemap.wire import Estimate, ProofsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning


def _plan(request: ProofsRequest) -> Plan:
    return Plan(estimate=Estimate(seconds=min(rates.PROOF_SECONDS[request.statement.kind], request.time_limit)))


PLANNING = Planning(_plan, kernels="orbits")
