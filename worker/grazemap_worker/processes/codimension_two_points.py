"""The process codimension-two-points: every such point of the grazing curve over an interval of omega."""

from __future__ import annotations

from grazemap.codec import Document
from grazemap.wire import CodimensionTwoPointsRequest
from grazemap_worker.processes.conversion import Report, core_oscillator, record
from grazemap_worker.processes.process import Process


def compute(request: CodimensionTwoPointsRequest, report: Report) -> Document:
    """Return points, a list of records in the order of omega. Raises CoreError."""
    from grazemap_core.grazing.codimension_two import codimension_two_points

    points = codimension_two_points(
        core_oscillator(request.oscillator),
        request.omega.start,
        request.omega.stop,
        request.max_order,
        request.max_multiple,
    )
    return {"points": [record(point) for point in points]}


PROCESS = Process(whole=compute)
