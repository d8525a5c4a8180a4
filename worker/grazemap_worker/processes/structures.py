"""The process structures: the linear properties of an oscillator."""

from __future__ import annotations

from typing import Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import StructuresRequest, grid_points, grid_values
from grazemap_worker.planning import rates
from grazemap_worker.planning.limits import BYTES_PER_NUMBER, Count, Limits, of_points
from grazemap_worker.processes.conversion import core_oscillator, fields
from grazemap_worker.processes.process import Process, Report

_NUMBERS_OF_A_POINT = 3


def _harmonics(request: StructuresRequest) -> int:
    return max(1, len(request.oscillator.harmonics))


def _seconds(request: StructuresRequest) -> float:
    size, points = request.oscillator.size, grid_points(request.omega) * _harmonics(request)
    is_chain = request.oscillator.matrices is None
    modes = (rates.CHAIN_MODES_SECONDS if is_chain else rates.MATRICES_MODES_SECONDS) * size**2
    more = rates.RESPONSE_MASS_SECONDS * size if is_chain else rates.RESPONSE_SQUARE_SECONDS * size**2
    each = rates.RESPONSE_SECONDS + more
    impulse = rates.IMPULSE_SECONDS * size * len(request.times)
    return rates.STRUCTURE_SECONDS + modes + each * points + impulse


def _counts(request: StructuresRequest, limits: Limits) -> list[Count]:
    points = grid_points(request.omega)
    numbers = BYTES_PER_NUMBER * points * _NUMBERS_OF_A_POINT * _harmonics(request)
    return [
        Count(of_points("omega", request.omega), "points", points, limits.points),
        Count("/oscillator/forcing", "bytes", numbers, limits.result_bytes),
    ]


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


PROCESS = Process(whole=compute, seconds=_seconds, counts=_counts)
