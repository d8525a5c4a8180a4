"""How a request is cut into tiles, and what it is expected to cost: pure functions of it, without the core."""

from __future__ import annotations

from grazemap_worker.planning.plan import Plan, Tile
from grazemap_worker.planning.planner import PLANNING, plan
from grazemap_worker.planning.planning import Limits
from grazemap_worker.planning.rates import TILE_SECONDS

__all__ = ["PLANNING", "TILE_SECONDS", "Limits", "Plan", "Tile", "plan"]
