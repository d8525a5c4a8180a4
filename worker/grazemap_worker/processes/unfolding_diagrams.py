"""The process unfolding-diagrams: a map in tiles, and after them the curves, points and borders over the map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import UnfoldingDiagramsRequest, motion_label
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.planning.costs import longest_period_cost
from grazemap_worker.planning.limits import Count, RequestLimits, Step
from grazemap_worker.planning.rates import (
    BORDERS_POINT_SECONDS,
    BORDERS_SIDE_SECONDS,
    BORDERS_STEPS,
    MAX_BORDER_NUMBERS,
    MAX_STEPS_AFTER,
)
from grazemap_worker.processes import bifurcation_curves, codimension_two_points, grazing_curves, unfolding_maps
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.maps.borders.map_borders import BorderCurve, MapBorders


def _tiling(request: UnfoldingDiagramsRequest) -> Plan:
    """Return the plan of the map with steps after its tiles; such a step takes about the time of a tile."""
    shape = unfolding_maps.tiling(request.unfolding_map)
    seconds = _curves_seconds(request) + _borders_seconds(request)
    after = math.ceil(min(seconds * shape.tile_count / shape.estimate.seconds, MAX_STEPS_AFTER))
    estimate = shape.estimate.model_copy(update={"seconds": shape.estimate.seconds + seconds})
    return shape.model_copy(update={"after": max(after, BORDERS_STEPS if request.borders else 1), "estimate": estimate})


def _curves_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return the seconds for the curves and points over the map."""
    curves = request.bifurcation_curves
    seconds = 0.0 if curves is None else bifurcation_curves.expected_seconds(curves)
    if request.is_usual:
        seconds += grazing_curves.expected_seconds(request.grazing_curve)
        seconds += codimension_two_points.expected_seconds(request.codimension_two_points)
    return seconds


def _borders_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return the seconds for explaining the borders of the map."""
    if not request.borders:
        return 0.0
    points = float(math.prod(request.plane.shape))
    return request.oscillator.size * (BORDERS_POINT_SECONDS * points + BORDERS_SIDE_SECONDS * math.sqrt(points))


def _counts(request: UnfoldingDiagramsRequest, limits: RequestLimits) -> list[Count]:
    (grid,) = unfolding_maps.counts(request.unfolding_map, limits)
    if not request.borders:
        return [grid]
    return [grid, Count("/borders", "points", grid.number, MAX_BORDER_NUMBERS // request.oscillator.size)]


def _after(request: UnfoldingDiagramsRequest) -> list[Step]:
    return [
        Step("/max_multiple", _curves_seconds(request), timed=True),
        Step("/borders", _borders_seconds(request), timed=False),
    ]


def compute_tile(request: UnfoldingDiagramsRequest, tile: Tile) -> Document:
    """Return a rectangle of the map, equal to that of the process unfolding-maps. Raises CoreError."""
    return unfolding_maps.compute_tile(request.unfolding_map, tile)


def assemble(request: UnfoldingDiagramsRequest, plan: Plan, tiles: list[Document], report: Report) -> ClassDocument:
    """Return the map, the curves and the points, and on request the borders. Raises CoreError.

    Each document equals that of its own process. Only the steps of the borders are reported.
    """
    from grazemap_core.maps.plane_grazes import graze_lines

    whole = unfolding_maps.assemble(request.unfolding_map, plan, tiles)
    overlays = (
        _grazing_documents(request)
        if request.is_usual
        else {"grazing_curves": graze_lines(unfolding_maps.core_plane(request.plane))}
    )
    overlays |= _bifurcation_curves(request)
    borders = {"borders": _borders(request, whole, report)} if request.borders else {}
    return document_of(results.UnfoldingDiagram, unfolding_map=whole, **overlays, **borders)


def _bifurcation_curves(request: UnfoldingDiagramsRequest) -> Document:
    """Return the curves of motions with one impact; none if the varied factor of the forces has no such curves."""
    from grazemap_core.errors import ParameterError

    if request.bifurcation_curves is None:
        return {}
    try:
        return {"bifurcation_curves": bifurcation_curves.compute(request.bifurcation_curves, _silent)}
    except ParameterError as error:
        if not {"forcing", "bias"} & {*request.plane.names} or error.name not in ("clearance", "bias"):
            raise
        return {"bifurcation_curves": document_of(results.BifurcationCurves, curves=[], motions=[])}


def _grazing_documents(request: UnfoldingDiagramsRequest) -> Document:
    """Return the grazing curve of both stops or of each stop, and the special points.

    There are none if the equilibrium lies beyond the fixed stop.
    """
    from grazemap_core.errors import ParameterError

    try:
        curve = grazing_curves.compute(request.grazing_curve, _silent)
        points = codimension_two_points.compute(request.codimension_two_points, _silent)
    except ParameterError as error:
        if request.grazing_curve.clearance is None or error.name != "clearance":
            raise
        return {"codimension_two_points": document_of(results.CodimensionTwoPoints, points=[])}
    both_stops = "clearance" in curve
    return {"grazing_curve" if both_stops else "stop_grazing_curves": curve, "codimension_two_points": points}


def _silent(done: int, total: int) -> None:
    """Report nothing, because these steps are not counted."""


def _borders(request: UnfoldingDiagramsRequest, whole: Document, report: Report) -> Document:
    """Return arrays (p,) of the pairs of neighbouring points on borders, and the curves that explain the borders."""
    from grazemap_core.maps.borders.map_borders import BORDER_REASONS, EXPLANATIONS, map_borders

    borders = map_borders(unfolding_maps.core_plane(request.plane), whole, report)
    return document_of(
        results.MapBorders,
        borders,
        explanations=np.array(EXPLANATIONS),
        reasons=np.array(BORDER_REASONS),
        curves=[_curve(borders, number, curve, request) for number, curve in enumerate(borders.curves)],
        without_orbit=int(np.count_nonzero(borders.without_orbit)),
    )


def _curve(borders: MapBorders, number: int, curve: BorderCurve, request: UnfoldingDiagramsRequest) -> Document:
    name = curve.name
    return document_of(
        results.BorderCurve,
        type=curve.type,
        **dict(zip(request.plane.fields, (curve.horizontal, curve.vertical), strict=True)),
        admissible=curve.admissible,
        motion=motion_label(name.period, name.right, name.left),
        period=name.period,
        impacts_right=name.right,
        impacts_left=name.left,
        symmetric=name.symmetric,
        pairs=int(np.count_nonzero(borders.curve == number)),
        ends=["window", "window"] if curve.orbits is None else list(curve.orbits.ends),
    )


PROCESS = Process(
    tile=compute_tile,
    assembled=assemble,
    tiling=_tiling,
    counts=_counts,
    longest_period_cost=lambda request: longest_period_cost(request.plane),
    after=_after,
    kernels="diagrams",
    own_tables=lambda request: unfolding_maps.own_tables(request.unfolding_map),
)
