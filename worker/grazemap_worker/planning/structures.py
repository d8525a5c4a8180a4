"""The cost of the linear properties of a structure: of its modes, and of the response at every frequency."""

from __future__ import annotations

from grazemap.wire import Estimate, StructuresRequest, grid_points
from grazemap_worker.planning import rates
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import BYTES_PER_NUMBER, Count, Limits, Planning, of_points

_NUMBERS_OF_A_POINT = 3


def _harmonics(request: StructuresRequest) -> int:
    return max(1, len(request.oscillator.harmonics))


def _plan(request: StructuresRequest) -> Plan:
    size, points = request.oscillator.size, grid_points(request.omega) * _harmonics(request)
    is_chain = request.oscillator.matrices is None
    modes = (rates.CHAIN_MODES_SECONDS if is_chain else rates.MATRICES_MODES_SECONDS) * size**2
    more = rates.RESPONSE_MASS_SECONDS * size if is_chain else rates.RESPONSE_SQUARE_SECONDS * size**2
    each = rates.RESPONSE_SECONDS + more
    impulse = rates.IMPULSE_SECONDS * size * len(request.times)
    return Plan(estimate=Estimate(seconds=rates.STRUCTURE_SECONDS + modes + each * points + impulse))


def _counts(request: StructuresRequest, limits: Limits) -> list[Count]:
    points = grid_points(request.omega)
    numbers = BYTES_PER_NUMBER * points * _NUMBERS_OF_A_POINT * _harmonics(request)
    return [
        Count(of_points("omega", request.omega), "points", points, limits.points),
        Count("/oscillator/forcing", "bytes", numbers, limits.result_bytes),
    ]


PLANNING = Planning(_plan, _counts)
