"""The cost of the branch of a periodic orbit: of finding the orbit, and of a typical number of points."""

from __future__ import annotations

from grazemap.wire import OrbitBranchesRequest
from grazemap_worker.planning import periodic_orbits
from grazemap_worker.planning.costs import branch_point_seconds, period_cost
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning
from grazemap_worker.planning.rates import BRANCH_POINTS


def _plan(request: OrbitBranchesRequest) -> Plan:
    orbit = periodic_orbits.plan(request)
    impacts = float(request.max_period if request.motion is None else len(request.motion.stops))
    branch = min(request.max_points, BRANCH_POINTS) * branch_point_seconds(request.oscillator, impacts)
    estimate = orbit.estimate.model_copy(update={"seconds": orbit.estimate.seconds + branch})
    return orbit.model_copy(update={"estimate": estimate})


PLANNING = Planning(
    _plan, periodic_orbits.counts, lambda request: period_cost(request.oscillator, request.omega), kernels="orbits"
)
