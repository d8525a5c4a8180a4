"""The cost of the branch of a periodic orbit: of finding the orbit, and of a typical number of points."""

from __future__ import annotations

import numpy as np

from grazemap.wire import OrbitBranchesRequest
from grazemap_worker.planning import periodic_orbits
from grazemap_worker.planning.costs import branch_point_seconds, period_cost, period_impacts
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning
from grazemap_worker.planning.rates import BRANCH_POINTS, BRANCH_SPECIAL_POINTS, MOST_ORBIT_IMPACTS


def _plan(request: OrbitBranchesRequest) -> Plan:
    orbit = periodic_orbits.plan(request)
    if request.motion is not None:
        impacts = float(len(request.motion.stops))
    else:
        at = np.array([request.omega]), np.array([request.clearance])
        impacts = min(float(period_impacts(request.oscillator, *at)[0]), MOST_ORBIT_IMPACTS)
    points = min(2 * request.max_points, BRANCH_POINTS) + BRANCH_SPECIAL_POINTS
    branch = points * branch_point_seconds(request.oscillator, impacts)
    estimate = orbit.estimate.model_copy(update={"seconds": orbit.estimate.seconds + branch})
    return orbit.model_copy(update={"estimate": estimate})


PLANNING = Planning(
    _plan, periodic_orbits.counts, lambda request: period_cost(request.oscillator, request.omega, request.clearance)
)
