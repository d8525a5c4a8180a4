"""The process structures: the linear properties of an oscillator."""

from __future__ import annotations

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import StructuresRequest, grid_points, grid_values
from grazemap.wire.structure import as_pair
from grazemap_worker.planning import rates
from grazemap_worker.planning.limits import BYTES_PER_NUMBER, Count, RequestLimits, points_pointer
from grazemap_worker.processes.conversion import core_oscillator, fields
from grazemap_worker.processes.process import Process, Report

# Numbers of the result at each frequency and harmonic.
_NUMBERS_OF_A_POINT = 3


def _harmonics(request: StructuresRequest) -> int:
    return max(1, len(request.oscillator.harmonics))


def _seconds(request: StructuresRequest) -> float:
    size, points = request.oscillator.size, grid_points(request.omega) * _harmonics(request)
    is_chain = request.oscillator.matrices is None
    modes = (rates.CHAIN_MODES_SECONDS if is_chain else rates.MATRICES_MODES_SECONDS) * size**2
    mass_seconds = rates.RESPONSE_MASS_SECONDS * size if is_chain else rates.RESPONSE_SQUARE_SECONDS * size**2
    response = rates.RESPONSE_SECONDS + mass_seconds
    impulse = rates.IMPULSE_SECONDS * size * len(request.times)
    return rates.STRUCTURE_SECONDS + modes + response * points + impulse


def _counts(request: StructuresRequest, limits: RequestLimits) -> list[Count]:
    points = grid_points(request.omega)
    numbers = BYTES_PER_NUMBER * points * _NUMBERS_OF_A_POINT * _harmonics(request)
    return [
        Count(points_pointer("omega", request.omega), "points", points, limits.points),
        Count("/oscillator/forcing", "bytes", numbers, limits.result_bytes),
    ]


def compute(request: StructuresRequest, report: Report) -> ClassDocument:
    """Return the linear properties: modes, harmonic responses, impulse response and gaps. Raises CoreError."""
    from grazemap_core.model.equilibrium import effective_gaps
    from grazemap_core.model.summary import summary

    oscillator = core_oscillator(request.oscillator)
    omega = grid_values(request.omega)
    properties = summary(oscillator, omega, request.times)
    report(1, 1)

    more: Document = {}
    if len(properties.harmonics) == 1:
        more |= fields(properties.harmonics[0], "amplitude", "phase", "amplitude_slope")
    if request.clearance is not None:
        stops = as_pair(request.clearance)
        gaps = effective_gaps(oscillator, stops.right, stops.left)
        right, left = (gap if np.isfinite(gap) else None for gap in gaps)
        more["gaps"] = document_of(results.Gaps, right=right, left=left)
    return document_of(
        results.Structure,
        properties,
        omega=omega,
        harmonics=[
            document_of(results.HarmonicResponse, response, harmonic=response.order)
            for response in properties.harmonics
        ],
        time=np.array(request.times, dtype=np.float64),
        **more,
    )


PROCESS = Process(whole=compute, seconds=_seconds, counts=_counts)
