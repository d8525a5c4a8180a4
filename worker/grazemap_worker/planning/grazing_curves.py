"""The cost of a grazing curve: of every order at each of its points."""

from __future__ import annotations

from grazemap.wire import Estimate, GrazingCurvesRequest, grid_points
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import BYTES_PER_NUMBER, Count, Limits, Planning, of_points
from grazemap_worker.planning.rates import CURVE_SECONDS


def _plan(request: GrazingCurvesRequest) -> Plan:
    seconds = grid_points(request.omega) * (1 + request.max_order) * request.oscillator.size * CURVE_SECONDS
    return Plan(estimate=Estimate(seconds=seconds))


def _counts(request: GrazingCurvesRequest, limits: Limits) -> list[Count]:
    points = grid_points(request.omega)
    counts = [Count(of_points("omega", request.omega), "points", points, limits.points)]
    if request.sequence:
        sequence = points * request.max_order * BYTES_PER_NUMBER
        counts.append(Count("/max_order", "bytes", sequence, limits.result_bytes))
    return counts


PLANNING = Planning(_plan, _counts)
