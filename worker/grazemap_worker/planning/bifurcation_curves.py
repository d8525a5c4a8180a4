"""The cost of bifurcation curves: in closed form, or those of given motions."""

from __future__ import annotations

from grazemap.wire import BifurcationCurvesRequest, Estimate
from grazemap_worker.planning.costs import branch_point_seconds, period_cost
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Planning
from grazemap_worker.planning.rates import (
    CURVE_POINT_BRANCHES,
    CURVE_POINT_MASS_SECONDS,
    CURVE_POINT_SECONDS,
    CURVES_PLACES,
    CURVES_POINTS,
    PERIODS_PER_SECOND,
    SEARCH_PERIODS,
    WINDOW_BRANCH_POINTS,
)


def _plan(request: BifurcationCurvesRequest) -> Plan:
    if request.motions is not None:
        return _of_motions(request)
    each = CURVE_POINT_SECONDS + CURVE_POINT_MASS_SECONDS * request.oscillator.size
    seconds = request.max_multiple * request.points * each
    return Plan(estimate=Estimate(seconds=seconds))


def _of_motions(request: BifurcationCurvesRequest) -> Plan:
    """Return the cost of finding motions in a window, and of following their curves.

    A point of a curve needs singular values and differences, and costs a few times as much as a point of a branch.
    """
    cost = period_cost(request.oscillator, request.omega.start, request.clearance.start)
    periods, seconds = 0.0, 0.0
    for motion in request.motions or ():
        impacts = len(motion.stops)
        places = 0 if motion.phases is not None else 1
        places *= 1 if motion.omega is not None and motion.clearance is not None else CURVES_PLACES
        periods += places * SEARCH_PERIODS
        point = branch_point_seconds(request.oscillator, float(impacts))
        seconds += (WINDOW_BRANCH_POINTS + CURVE_POINT_BRANCHES * CURVES_POINTS) * point
    return Plan(estimate=Estimate(periods=periods, seconds=seconds + periods * cost / PERIODS_PER_SECOND))


def _longest_period(request: BifurcationCurvesRequest) -> float | None:
    return (
        None
        if request.motions is None
        else period_cost(request.oscillator, request.omega.start, request.clearance.start)
    )


PLANNING = Planning(_plan, longest_period=_longest_period)
