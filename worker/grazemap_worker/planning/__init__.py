"""Tiles, estimates and limits: pure functions of requests, without the core.

The service plans a request, and the worker reads the plan. How each process is planned stands in its module in
`grazemap_worker.processes`. Only maps, diagrams of maps, basins and basin fractions have more than one tile.
"""

from __future__ import annotations

from grazemap_worker.planning.limits import Limits
from grazemap_worker.planning.plan import LANE_WEIGHTS, SHORT_SECONDS, Lane, Plan, Tile
from grazemap_worker.planning.rates import TILE_SECONDS

__all__ = ["LANE_WEIGHTS", "SHORT_SECONDS", "TILE_SECONDS", "Lane", "Limits", "Plan", "Tile"]
