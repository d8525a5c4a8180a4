"""The process grazing-curves: the clearances at which the steady motion touches a stop, and the special points."""

from __future__ import annotations

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import CodimensionTwoPointsRequest, GrazingCurvesRequest, grid_points, grid_values
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import codimension_two_seconds, peaks_seconds
from grazemap_worker.planning.limits import BYTES_PER_NUMBER, Count, RequestLimits, points_pointer
from grazemap_worker.processes.codimension_two_points import special_points, varied_stops
from grazemap_worker.processes.conversion import core_oscillator, fields
from grazemap_worker.processes.process import Process, Report


def expected_seconds(request: GrazingCurvesRequest) -> float:
    """Return the expected processor time."""
    omega, ends, order = request.axis.values, request.axis.ends, request.max_order
    seconds_per_mass = rates.CURVE_SECONDS + rates.SEQUENCE_SECONDS * order * request.sequence
    seconds = grid_points(omega) * request.oscillator.size * seconds_per_mass
    seconds += peaks_seconds(request.oscillator, *ends, grid_points(omega))
    return seconds + codimension_two_seconds(request, *ends, order, _MAX_MULTIPLE)


def _counts(request: GrazingCurvesRequest, limits: RequestLimits) -> list[Count]:
    points = grid_points(request.axis.values)
    counts = [Count(points_pointer("axis/values", request.axis.values), "points", points, limits.points)]
    if request.sequence:
        sequence = points * request.max_order * BYTES_PER_NUMBER
        counts.append(Count("/max_order", "bytes", sequence, limits.result_bytes))
    return counts


_MAX_MULTIPLE: int = CodimensionTwoPointsRequest.model_fields["max_multiple"].default
_SIDES = {1: "right", -1: "left"}


def compute(request: GrazingCurvesRequest, report: Report) -> ClassDocument:
    """Return one curve if both stops are grazed at once, or else a curve of each stop; and the special points.

    The special points are the codimension-two points of all kinds between the first and the last omega, up to the
    default max_multiple. Raises CoreError.
    """
    from grazemap_core.grazing.grazing_curve import grazing_curve, stop_grazes
    from grazemap_core.grazing.recurrence import xi_along
    from grazemap_core.model.equilibrium import contact_equilibrium

    oscillator = core_oscillator(request.oscillator)
    omega = grid_values(request.axis.values)
    report(0, 2)
    varied = varied_stops(request)
    alike = varied[0].alike
    curve = grazing_curve(oscillator, omega, request.max_order) if alike else None
    sequence = {"xi": xi_along(oscillator, omega, request.max_order)} if alike and request.sequence else {}
    stop_curves: Document = {}
    for stop in () if alike else varied:
        grazes, side = stop_grazes(oscillator, omega, stop, request.max_order), _SIDES[stop.stop]
        curve_fields = fields(grazes, "clearance", "phase", "virtual", "first_recurrence")
        curve_fields["margin"] = np.where(np.isfinite(grazes.margin), grazes.margin, np.nan)
        stop_curves |= {f"{name}_{side}": values for name, values in curve_fields.items()}
    report(1, 2)
    points = special_points(oscillator, float(omega[0]), float(omega[-1]), request.max_order, _MAX_MULTIPLE, varied)
    if curve is not None:
        return document_of(results.GrazingCurve, curve, points=points, **sequence)
    equilibrium = contact_equilibrium(oscillator)
    return document_of(
        results.StopGrazingCurves, contact_equilibrium=equilibrium, omega=omega, points=points, **stop_curves
    )


PROCESS = Process(whole=compute, seconds=expected_seconds, counts=_counts)
