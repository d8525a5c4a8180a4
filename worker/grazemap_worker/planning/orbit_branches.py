"""The cost of the branch of a periodic orbit: of finding the orbit, and of a typical number of points."""

from __future__ import annotations

import numpy as np

from grazemap.wire import OrbitBranchesRequest
from grazemap_worker.planning import periodic_orbits, rates
from grazemap_worker.planning.costs import (
    branch_point_seconds,
    longest_at_point,
    period_impacts,
    stop_distance,
)
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning


def _plan(request: OrbitBranchesRequest) -> Plan:
    orbit = periodic_orbits.plan(request)
    if request.motion is not None:
        impacts = float(len(request.motion.stops))
    else:
        distance, single = stop_distance(request.clearance)
        at = np.array([request.omega]), np.array([distance])
        impacts = min(float(period_impacts(request.oscillator, *at, single=single)[0]), rates.MOST_ORBIT_IMPACTS)
    points = min(2 * request.max_points, rates.BRANCH_POINTS) + rates.BRANCH_SPECIAL_POINTS
    branch = points * branch_point_seconds(request.oscillator, impacts)
    if request.observed:
        branch += points * rates.OBSERVED_ORBIT_SECONDS
    estimate = orbit.estimate.model_copy(update={"seconds": orbit.estimate.seconds + branch})
    return orbit.model_copy(update={"estimate": estimate})


PLANNING = Planning(_plan, periodic_orbits.counts, longest_at_point, kernels="orbits")
