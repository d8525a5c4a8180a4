"""The process structures: the linear properties of an oscillator."""

from __future__ import annotations

from typing import Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import StructuresRequest, grid_values
from grazemap_worker.processes.conversion import Report, core_oscillator, fields
from grazemap_worker.processes.process import Process


def compute(request: StructuresRequest, report: Report) -> Document:
    """Return the fields of the result's schema. Raises CoreError."""
    from grazemap_core.model.equilibrium import effective_gaps
    from grazemap_core.model.summary import HarmonicResponse, summary

    oscillator = core_oscillator(request.oscillator)
    omega = grid_values(request.omega)
    found = summary(oscillator, omega, request.times)
    report(1, 1)

    def response(one: HarmonicResponse) -> dict[str, Any]:
        return fields(one, "amplitude", "phase", "amplitude_slope")

    document: Document = {
        **fields(found, "effective_mass", "kappa", "equilibrium", "contact_equilibrium"),
        **fields(found, "natural_frequencies", "damping_ratios"),
        "omega": omega,
        "harmonics": [{"harmonic": one.order, **response(one)} for one in found.harmonics],
        "time": np.array(request.times, dtype=np.float64),
        "impulse_response": found.impulse_response,
    }
    if found.contact_weights is not None:
        document["contact_weights"] = found.contact_weights
    if len(found.harmonics) == 1:
        document |= response(found.harmonics[0])
    if request.clearance is not None:
        gaps = effective_gaps(oscillator, request.stops.right, request.stops.left)
        document["gaps"] = {
            name: gap if np.isfinite(gap) else None for name, gap in zip(("right", "left"), gaps, strict=True)
        }
    return document


PROCESS = Process(whole=compute)
