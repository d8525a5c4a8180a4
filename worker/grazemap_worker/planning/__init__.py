"""Cuts a request into tiles and estimates its cost: pure functions of the request, without the core.

The service plans a request, and the worker reads the plan. The cost of a process, and the quantities that a server
limits, are in `PLANNING` of the module that is named after the process. Only maps, basins and basin
fractions have more than one tile.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.observables import ObservedRequest
from grazemap_worker.planning.plan import LANE_WEIGHTS, SHORT_SECONDS, Lane, Plan, Tile
from grazemap_worker.planning.planning import Limits, Planning, compiling_seconds
from grazemap_worker.planning.rates import TILE_SECONDS

PLANNING: Mapping[str, Planning] = {
    process: import_module(f"{__name__}.{process.replace('-', '_')}").PLANNING for process in PROCESSES
}


def kernels_of(process: str, request: ProcessRequest) -> str:
    """Return the name of the kernels that a request needs: those of maps depend on the number of masses."""
    planning, size, kernels = PLANNING[process], request.oscillator.size, PLANNING[process].kernels
    if isinstance(request, ObservedRequest) and request.observed:
        kernels = "map_observables" if planning.of_masses else "observables"
    if planning.apart(request):
        kernels = f"apart_{kernels}"
    return f"{kernels}-{size}" if planning.of_masses else kernels


__all__ = [
    "LANE_WEIGHTS",
    "PLANNING",
    "SHORT_SECONDS",
    "TILE_SECONDS",
    "Lane",
    "Limits",
    "Plan",
    "Tile",
    "compiling_seconds",
    "kernels_of",
]
