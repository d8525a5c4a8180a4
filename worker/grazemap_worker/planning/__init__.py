"""Cuts a request into tiles and estimates its cost: pure functions of the request, without the core.

The service plans a request, and the worker reads the plan. The cost of a process, and the quantities that a server
limits, are in `PLANNING` of the module that is named after the process. Only maps and basins have more than one tile.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES
from grazemap_worker.planning.plan import Plan, Tile
from grazemap_worker.planning.planning import COMPILING_SECONDS, Limits, Planning
from grazemap_worker.planning.rates import TILE_SECONDS

PLANNING: Mapping[str, Planning] = {
    process: import_module(f"{__name__}.{process.replace('-', '_')}").PLANNING for process in PROCESSES
}

__all__ = ["COMPILING_SECONDS", "PLANNING", "TILE_SECONDS", "Limits", "Plan", "Tile"]
