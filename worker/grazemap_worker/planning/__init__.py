"""How a request is cut into tiles, and what it is expected to cost: pure functions of it, without the core.

The service plans a request, and the worker reads the plan. What a process costs, and what of it a server limits, stands
in the module of this folder that is named as the process, in its `PLANNING`. Only maps and basins have more than one
tile.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from grazemap.wire import PROCESSES
from grazemap_worker.planning.plan import Plan, Tile
from grazemap_worker.planning.planning import Limits, Planning
from grazemap_worker.planning.rates import TILE_SECONDS

PLANNING: Mapping[str, Planning] = {
    process: import_module(f"{__name__}.{process.replace('-', '_')}").PLANNING for process in PROCESSES
}

__all__ = ["PLANNING", "TILE_SECONDS", "Limits", "Plan", "Tile"]
