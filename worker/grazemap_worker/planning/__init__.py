"""Tiles, estimates and limits: pure functions of requests, without the core.

The service makes the plan of a request, and the worker reads it. The module of each process in
`grazemap_worker.processes` plans its requests. Only maps, diagrams of maps, basins and basin fractions have more than
one tile.
"""

from __future__ import annotations

from grazemap_worker.planning.limits import RequestLimits
from grazemap_worker.planning.plan import LANE_WEIGHTS, SHORT_SECONDS, Lane, Plan, Tile
from grazemap_worker.planning.rates import TILE_SECONDS

__all__ = ["LANE_WEIGHTS", "SHORT_SECONDS", "TILE_SECONDS", "Lane", "Plan", "RequestLimits", "Tile"]
