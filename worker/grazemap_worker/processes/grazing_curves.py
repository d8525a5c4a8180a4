"""The process grazing-curves: clearance = A(omega), its first recurrences, and the special points on it."""

from __future__ import annotations

from grazemap.codec import Document
from grazemap.wire import CodimensionTwoPointsRequest, GrazingCurvesRequest, grid_values
from grazemap_worker.processes.conversion import Report, core_oscillator, fields, record
from grazemap_worker.processes.process import Process

_MOST_MULTIPLE: int = CodimensionTwoPointsRequest.model_fields["max_multiple"].default


def compute(request: GrazingCurvesRequest, report: Report) -> Document:
    """Return omega, clearance, phase, first_recurrence and recurrence_stop, shape (n,), and points, records.

    The points are the codimension-two points between the first and the last omega, both kinds, with the default
    largest multiple. Where the request asks for the sequence: xi, shape (n, max_order). Raises CoreError.
    """
    from grazemap_core.grazing.codimension_two import codimension_two_points
    from grazemap_core.grazing.curve import grazing_curve
    from grazemap_core.grazing.recurrence import xi_along

    oscillator = core_oscillator(request.oscillator)
    omega = grid_values(request.omega)
    report(0, 2)
    curve = grazing_curve(oscillator, omega, request.max_order)
    report(1, 2)
    points = codimension_two_points(oscillator, float(omega[0]), float(omega[-1]), request.max_order, _MOST_MULTIPLE)
    sequence = {"xi": xi_along(oscillator, omega, request.max_order)} if request.sequence else {}
    return {
        **sequence,
        **fields(curve, "omega", "clearance", "phase", "first_recurrence", "recurrence_stop"),
        "points": [record(point) for point in points],
    }


PROCESS = Process(whole=compute)
