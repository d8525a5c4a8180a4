"""The process codimension-two-points: all codimension-two points of the grazing curves over an interval of omega."""

from __future__ import annotations

from typing import TYPE_CHECKING

from grazemap import results
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import CodimensionTwoPointsRequest, DiscontinuityMappingsRequest, GrazingCurvesRequest
from grazemap.wire.structure import varied_stop
from grazemap_worker.planning.costs import codimension_two_seconds, peaks_seconds, setup_seconds
from grazemap_worker.processes.conversion import core_oscillator
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.grazing.codimension_two import CodimensionTwoPoint
    from grazemap_core.grazing.grazing_curve import VariedStop
    from grazemap_core.model.oscillator import Oscillator


def expected_seconds(request: CodimensionTwoPointsRequest) -> float:
    """Return the expected processor time."""
    ends = request.axis.ends
    seconds = codimension_two_seconds(request, *ends, request.max_order, request.max_multiple)
    seconds += peaks_seconds(request.oscillator, *ends)
    return setup_seconds(request.oscillator) + seconds


def varied_stops(
    request: CodimensionTwoPointsRequest | GrazingCurvesRequest | DiscontinuityMappingsRequest,
) -> list[VariedStop]:
    """Return the stops with separate grazing curves; one pair if both stops are always grazed at once."""
    from grazemap_core.grazing.grazing_curve import ALIKE, VariedStop
    from grazemap_core.model.equilibrium import contact_equilibrium

    if request.clearance is not None:
        return [VariedStop(*varied_stop(request.clearance))]
    oscillator = core_oscillator(request.oscillator)
    if contact_equilibrium(oscillator) == 0.0 and oscillator.is_half_wave_symmetric:
        return [ALIKE]
    return [VariedStop(stop, together=True) for stop in (1, -1)]


def special_points(
    oscillator: Oscillator, start: float, stop: float, max_order: int, max_multiple: int, varied: list[VariedStop]
) -> list[CodimensionTwoPoint]:
    """Return the codimension-two points of the grazing curves of some stops, in increasing omega."""
    from grazemap_core.grazing.codimension_two import codimension_two_points

    points = [
        point
        for varied_stop in varied
        for point in codimension_two_points(oscillator, start, stop, max_order, max_multiple, varied_stop)
    ]
    return sorted(points, key=lambda point: point.omega)


def compute(request: CodimensionTwoPointsRequest, report: Report) -> ClassDocument:
    """Return points, a list of records in increasing omega. Raises CoreError."""
    orders = request.max_order, request.max_multiple
    points = special_points(core_oscillator(request.oscillator), *request.axis.ends, *orders, varied_stops(request))
    return document_of(results.CodimensionTwoPoints, points=points)


PROCESS = Process(whole=compute, seconds=expected_seconds)
