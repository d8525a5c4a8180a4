"""The cost of bifurcation curves: in closed form, or those of given motions."""

from __future__ import annotations

from grazemap.wire import BifurcationCurvesRequest, Estimate
from grazemap_worker.planning.costs import branch_point_seconds, longest_period, period_cost
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning
from grazemap_worker.planning.rates import (
    CURVE_POINT_BRANCHES,
    CURVE_POINT_MASS_SECONDS,
    CURVE_POINT_SECONDS,
    CURVES_PLACES,
    CURVES_POINTS,
    EXPLICIT_POINT_MASS_SECONDS,
    EXPLICIT_POINT_SECONDS,
    PERIODS_PER_SECOND,
    SEARCH_PERIODS,
    WINDOW_BRANCH_POINTS,
)

_OF_BOTH = {"clearance", "forcing"}
"""Parameters that keep equal stops equal."""


def _plan(request: BifurcationCurvesRequest) -> Plan:
    if not request.is_explicit:
        return _of_motions(request)
    return Plan(estimate=Estimate(seconds=request.max_multiple * request.points * _frequency_seconds(request)))


def _frequency_seconds(request: BifurcationCurvesRequest) -> float:
    """Return the seconds for a frequency and a period of the curves in closed form."""
    oscillator, clearance = request.oscillator, request.plane.corners()[0].clearance
    stops = [one for one in (clearance.right, clearance.left) if one is not None]
    alike = oscillator.is_symmetric and oscillator.has_equal_restitution and {*request.plane.names} & _OF_BOTH
    if alike and len(stops) == 2 and stops[0] == stops[1] and len(oscillator.orders) == 1:
        return CURVE_POINT_SECONDS + CURVE_POINT_MASS_SECONDS * oscillator.size
    harmonics = len(oscillator.orders)
    return len(stops) * harmonics * (EXPLICIT_POINT_SECONDS + EXPLICIT_POINT_MASS_SECONDS * oscillator.size)


def _of_motions(request: BifurcationCurvesRequest) -> Plan:
    """Return the cost of finding motions in a window, and of following their curves.

    A point of a curve needs singular values and differences, and costs a few times as much as a point of a branch.
    """
    corner = request.plane.corners()[0]
    cost = period_cost(corner.oscillator, corner.omega, corner.clearance)
    periods, seconds = 0.0, 0.0
    for motion in request.followed:
        impacts = len(motion.stops)
        places = 0 if motion.phases is not None else 1
        placed = all(getattr(motion, name) is not None for name in request.axes)
        places *= 1 if placed else CURVES_PLACES
        periods += places * SEARCH_PERIODS
        point = branch_point_seconds(request.oscillator, float(impacts))
        seconds += (WINDOW_BRANCH_POINTS + CURVE_POINT_BRANCHES * CURVES_POINTS) * point
    return Plan(estimate=Estimate(periods=periods, seconds=seconds + periods * cost / PERIODS_PER_SECOND))


def _longest_period(request: BifurcationCurvesRequest) -> float | None:
    return None if request.is_explicit else longest_period(request.plane)


PLANNING = Planning(_plan, longest_period=_longest_period, kernels="orbits")
