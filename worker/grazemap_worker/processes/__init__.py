"""The processes: what each of them computes, one module per process.

In: a validated request. Out: a document (see `grazemap.codec`). The core is imported when a process is first used,
so that this table can be read without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from grazemap.codec import Document
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes import (
    basins,
    bifurcation_curves,
    bifurcation_diagrams,
    codimension_two_points,
    discontinuity_mappings,
    grazing_curves,
    orbits,
    trajectories,
    unfolding_diagrams,
    unfolding_maps,
)
from grazemap_worker.processes.conversion import Report


@dataclass(frozen=True)
class Process:
    """How the result of a process comes about.

    Attributes
    ----------
    whole : callable (request, report) -> document, optional
        Computes everything at once; for processes of one tile.
    tile : callable (request, tile) -> document, optional
        Computes a rectangle of the grid.
    assembled : callable (request, plan, tiles, report) -> document, optional
        Puts the tiles' documents, in the plan's order, together; `report` counts for plans with steps after the tiles.
    """

    whole: Callable[[Any, Report], Document] | None = None
    tile: Callable[[Any, Tile], Document] | None = None
    assembled: Callable[[Any, Plan, list[Document], Report], Document] | None = None


PROCESSES: Mapping[str, Process] = {
    "grazing-curves": Process(whole=grazing_curves.compute),
    "codimension-two-points": Process(whole=codimension_two_points.compute),
    "discontinuity-mappings": Process(whole=discontinuity_mappings.compute),
    "trajectories": Process(whole=trajectories.compute),
    "bifurcation-diagrams": Process(whole=bifurcation_diagrams.compute),
    "unfolding-maps": Process(tile=unfolding_maps.compute_tile, assembled=unfolding_maps.assemble),
    "unfolding-diagrams": Process(tile=unfolding_diagrams.compute_tile, assembled=unfolding_diagrams.assemble),
    "periodic-orbits": Process(whole=orbits.compute_orbit),
    "orbit-branches": Process(whole=orbits.compute_branch),
    "bifurcation-curves": Process(whole=bifurcation_curves.compute),
    "basins": Process(tile=basins.compute_tile, assembled=basins.assemble),
}
