"""The process grazing-curves: where the steady motion touches a stop, its first recurrences, and the special points."""

from __future__ import annotations

import numpy as np

from grazemap.codec import Document
from grazemap.wire import CodimensionTwoPointsRequest, GrazingCurvesRequest, grid_values
from grazemap_worker.processes.codimension_two_points import special_points, varied_stops
from grazemap_worker.processes.conversion import Report, core_oscillator, fields
from grazemap_worker.processes.process import Process

_MOST_MULTIPLE: int = CodimensionTwoPointsRequest.model_fields["max_multiple"].default
_SIDES = {1: "right", -1: "left"}


def compute(request: GrazingCurvesRequest, report: Report) -> Document:
    """Return the fields of the result's schema: one curve of equal stops, or one of each stop that varies.

    The points are the codimension-two points between the first and the last omega, of all kinds, with the default
    largest multiple. Raises CoreError.
    """
    from grazemap_core.grazing.one_stop import grazing_curve, stop_grazes
    from grazemap_core.grazing.recurrence import xi_along
    from grazemap_core.model.equilibrium import contact_equilibrium

    oscillator = core_oscillator(request.oscillator)
    omega = grid_values(request.omega)
    report(0, 2)
    varied = varied_stops(request)
    document: Document
    if not varied:
        curve = grazing_curve(oscillator, omega, request.max_order)
        document = {"xi": xi_along(oscillator, omega, request.max_order)} if request.sequence else {}
        document |= fields(curve, "omega", "clearance", "phase", "first_recurrence", "recurrence_stop")
    else:
        document = {"contact_equilibrium": contact_equilibrium(oscillator), "omega": omega}
        for stop in varied:
            grazes, side = stop_grazes(oscillator, omega, stop, request.max_order), _SIDES[stop.stop]
            found = fields(grazes, "clearance", "phase", "virtual", "first_recurrence")
            found["margin"] = np.where(np.isfinite(grazes.margin), grazes.margin, np.nan)
            document |= {f"{name}_{side}": values for name, values in found.items()}
    report(1, 2)
    ends = float(omega[0]), float(omega[-1])
    return document | {"points": special_points(oscillator, *ends, request.max_order, _MOST_MULTIPLE, varied)}


PROCESS = Process(whole=compute)
