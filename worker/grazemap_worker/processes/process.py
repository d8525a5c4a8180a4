"""How the worker computes the result of a process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from grazemap.codec import Document
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes.conversion import Report


@dataclass(frozen=True)
class Process:
    """The functions that compute the result of a process.

    Attributes
    ----------
    whole : callable (request, report) -> document, optional
        Computes everything at once; for processes of one tile.
    tile : callable (request, tile) -> document, optional
        Computes a rectangle of the grid.
    assembled : callable (request, plan, tiles, report) -> document, optional
        Joins the tiles' documents, in the plan's order; `report` is for plans with steps after the tiles.
    lasting : callable (document) -> bool
        Whether a result is the answer whenever the request is made again; else it is computed again then.
    """

    whole: Callable[[Any, Report], Document] | None = None
    tile: Callable[[Any, Tile], Document] | None = None
    assembled: Callable[[Any, Plan, list[Document], Report], Document] | None = None
    lasting: Callable[[Document], bool] = lambda document: True
