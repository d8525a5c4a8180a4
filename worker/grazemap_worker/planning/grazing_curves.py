"""The cost of a grazing curve: of its points, of their sequences, and of the codimension-two points on it."""

from __future__ import annotations

from grazemap.wire import CodimensionTwoPointsRequest, Estimate, GrazingCurvesRequest, grid_points
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import codimension_two_seconds, peaks_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import BYTES_PER_NUMBER, Count, Limits, Planning, of_points

_MOST_MULTIPLE: int = CodimensionTwoPointsRequest.model_fields["max_multiple"].default


def _plan(request: GrazingCurvesRequest) -> Plan:
    omega, order = request.omega, request.max_order
    ends = (omega[0], omega[-1]) if isinstance(omega, list) else (omega.start, omega.stop)
    each = rates.CURVE_SECONDS + rates.SEQUENCE_SECONDS * order * request.sequence
    seconds = grid_points(omega) * request.oscillator.size * each
    seconds += peaks_seconds(request.oscillator, *ends, grid_points(omega))
    return Plan(estimate=Estimate(seconds=seconds + codimension_two_seconds(request, *ends, order, _MOST_MULTIPLE)))


def _counts(request: GrazingCurvesRequest, limits: Limits) -> list[Count]:
    points = grid_points(request.omega)
    counts = [Count(of_points("omega", request.omega), "points", points, limits.points)]
    if request.sequence:
        sequence = points * request.max_order * BYTES_PER_NUMBER
        counts.append(Count("/max_order", "bytes", sequence, limits.result_bytes))
    return counts


PLANNING = Planning(_plan, _counts)
