"""The process unfolding-diagrams: a map in tiles, and with them the curves, points and borders over it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap.codec import Document
from grazemap.wire import UnfoldingDiagramsRequest, motion_label
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes import bifurcation_curves, codimension_two_points, grazing_curves, unfolding_maps
from grazemap_worker.processes.conversion import Report, core_oscillator, fields
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap_core.maps.borders.map_borders import BorderCurve, MapBorders


def compute_tile(request: UnfoldingDiagramsRequest, tile: Tile) -> Document:
    """Return a rectangle of the map, as the process unfolding-maps would. Raises CoreError."""
    return unfolding_maps.compute_tile(request.unfolding_map, tile)


def assemble(request: UnfoldingDiagramsRequest, plan: Plan, tiles: list[Document], report: Report) -> Document:
    """Return the documents of the map, the curves and the points, and borders where they are asked for.

    Each equals the document of its own process. Only the steps of the borders are reported. Raises CoreError.
    """
    whole = unfolding_maps.assemble(request.unfolding_map, plan, tiles)
    over = {
        "grazing_curve": grazing_curves.compute(request.grazing_curve, _silent),
        "codimension_two_points": codimension_two_points.compute(request.codimension_two_points, _silent),
        "bifurcation_curves": bifurcation_curves.compute(request.bifurcation_curves, _silent),
    }
    borders = {"borders": _borders(request, whole, report)} if request.borders else {}
    return {"unfolding_map": whole, **over, **borders}


def _silent(done: int, total: int) -> None:
    """Report nothing: these steps are not counted."""


def _borders(request: UnfoldingDiagramsRequest, whole: Document, report: Report) -> Document:
    """Return arrays (p,) of the pairs of neighbouring points, and the curves that explain them, a list of records."""
    from grazemap_core.maps.borders.map_borders import EXPLANATIONS, REASONS, map_borders

    found = map_borders(core_oscillator(request.oscillator), whole["omega"], whole["clearance"], whole, report)
    names = ("row", "column", "along", "regular", "explanation", "reason", "curve", "distance")
    return {
        **fields(found, *names),
        "explanations": np.array(EXPLANATIONS),
        "reasons": np.array(REASONS),
        "curves": [_curve(found, number, curve) for number, curve in enumerate(found.curves)],
        "without_orbit": int(np.count_nonzero(found.without_orbit)),
        "irregular_pairs": found.irregular_pairs,
    }


def _curve(found: MapBorders, number: int, curve: BorderCurve) -> dict[str, Any]:
    name = curve.name
    return {
        **fields(curve, "type", "omega", "clearance", "admissible"),
        "motion": motion_label(name.period, name.more, name.fewer),
        "period": name.period,
        "impacts_right": name.more,
        "impacts_left": name.fewer,
        "symmetric": name.symmetric,
        "pairs": int(np.count_nonzero(found.curve == number)),
        "ends": ["window", "window"] if curve.orbits is None else list(curve.orbits.ends),
    }


PROCESS = Process(tile=compute_tile, assembled=assemble)
