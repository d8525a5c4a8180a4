"""The cost of the branch of a periodic orbit: of finding the orbit, and of points by the width of the range."""

from __future__ import annotations

from grazemap.wire import OrbitBranchesRequest
from grazemap.wire.planes import is_structural
from grazemap_worker.planning import periodic_orbits, rates
from grazemap_worker.planning.costs import (
    Points,
    branch_point_seconds,
    contact_force,
    longest_at_point,
    period_impacts,
)
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning


def _plan(request: OrbitBranchesRequest) -> Plan:
    orbit = periodic_orbits.plan(request)
    if request.motion is not None:
        impacts = float(len(request.motion.stops))
    else:
        at = Points.of([(request.omega, request.clearance)])
        impacts = min(float(period_impacts(request.oscillator, at)[0]), rates.MOST_ORBIT_IMPACTS)
    points = min(2 * request.max_points, _points(request)) + rates.BRANCH_SPECIAL_POINTS
    branch = points * branch_point_seconds(request.oscillator, impacts)
    if is_structural(request.vary):
        modes = rates.BRANCH_MODES_SECONDS + rates.SETUP_MASS_SECONDS * request.oscillator.size**2
        branch += points * rates.BRANCH_STRUCTURES * modes
    if request.observed:
        branch += points * rates.OBSERVED_ORBIT_SECONDS
    estimate = orbit.estimate.model_copy(update={"seconds": orbit.estimate.seconds + branch})
    return orbit.model_copy(update={"estimate": estimate})


def _points(request: OrbitBranchesRequest) -> float:
    """Return the expected number of points in both directions.

    In a narrow range a branch turns, and its phases and speeds change more than the parameter; far away they do not.
    """
    unit = abs(request.value) if request.vary == "omega" or is_structural(request.vary) else 1.0
    if request.vary.startswith("clearance"):
        at = Points.of([(request.omega, request.clearance)])
        unit = float(at.width(contact_force(request.oscillator, at.omega)[1])[0])
    steps = (request.range.stop - request.range.start) / (rates.BRANCH_STEP * (unit or 1.0))
    turning = min(steps * rates.BRANCH_POINTS_A_STEP, rates.BRANCH_POINTS_TURNING + steps)
    return rates.BRANCH_POINTS + turning


PLANNING = Planning(_plan, periodic_orbits.counts, longest_at_point, kernels="orbits")
