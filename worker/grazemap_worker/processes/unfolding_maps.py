"""The process unfolding-maps: the motion that every point of a grid settles to, in tiles of the grid.

The document of an adaptive map has arrays of the grid for values that are known at inferred points too. All others are
in `at_computed`, with values at computed points only, in the order of numpy's ``array[computed]``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.wire import UnfoldingMapsRequest, grid_values
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.processes.conversion import (
    Report,
    chance_document,
    fields,
    joined,
    parameter_point,
    record,
    varying_oscillator,
)
from grazemap_worker.processes.observables import MEANS, OUTPUTS, core_observables, observed_document
from grazemap_worker.processes.process import Process

if TYPE_CHECKING:
    from grazemap.wire.planes import Plane
    from grazemap_core.maps.planes import Plane as CorePlane

_AXES = ("omega", "clearance", "horizontal", "vertical")
_NAMES = ("kinds", "reasons")
_AT_COMPUTED = "at_computed"
_SETTINGS = ("max_periods", "max_period", "policy", "initial_conditions", "seed", "preview")


def compute_tile(request: UnfoldingMapsRequest, tile: Tile) -> Document:
    """Return a rectangle of the map: the values of its parameters, and the arrays [vertical, horizontal] of the core.

    The values are slices of those of the whole grid, so the bytes of a map that is not adaptive do not depend on its
    tiles (those of a sweep are as tall as the map). Raises CoreError.
    """
    from grazemap_core.codes import ROUNDING_DECIDES
    from grazemap_core.maps.adaptive_map import NOT_COMPUTED, NOT_COMPUTED_REASON, adaptive_map_tile
    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.simulation.motion import KINDS, REASONS, SENSITIVE

    plane, settings = core_plane(request.plane).part(tile.rows, tile.columns), fields(request, *_SETTINGS)
    reasons = [REASONS.get(code, "") for code in range(1 + max(REASONS))]
    reasons[ROUNDING_DECIDES] = f"{SENSITIVE} {_remedy_of_sensitive(request)}"
    arrays: Document
    if request.adaptive:
        arrays = _without_figures_of_inferred(adaptive_map_tile(plane, **settings))
        assert len(reasons) == NOT_COMPUTED
        reasons.append(NOT_COMPUTED_REASON)
    else:
        observed = core_observables(request)
        arrays = unfolding_map_tile(plane, **settings, resolve_sensitive=request.resolve_sensitive, observed=observed)
        arrays |= observed_document(request, arrays.pop("figures", None))
    return {
        **_axes(request, plane),
        **arrays,
        **_margins(request, plane),
        "kinds": np.array(KINDS),
        "reasons": np.array(reasons),
    }


def assemble(
    request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], report: Report | None = None
) -> Document:
    """Return the whole map from the documents of its tiles, in the plan's order. Raises CoreError."""
    from grazemap_core.maps.chaotic_transients import chance_in_map

    plane = core_plane(request.plane)
    names = [name for name in tiles[0] if name not in (*_AXES, *_NAMES, _AT_COMPUTED, OUTPUTS)]
    whole: Document = {name: joined(plan, [tile[name] for tile in tiles]) for name in names}
    if OUTPUTS in tiles[0]:
        whole[OUTPUTS] = [
            one | {name: joined(plan, [tile[OUTPUTS][k][name] for tile in tiles]) for name in MEANS}
            for k, one in enumerate(tiles[0][OUTPUTS])
        ]
    if request.adaptive:
        whole |= _completed(request, plan, tiles, whole, report)
    chance = chance_in_map(whole["kind"], plane, **fields(request, *_SETTINGS))
    return {
        **_axes(request, plane),
        **whole,
        **{name: tiles[0][name] for name in _NAMES},
        **chance_document(chance),
    }


def core_plane(plane: Plane) -> CorePlane:
    """Return the core's plane of two parameters. Raises CoreError."""
    from grazemap_core.maps.planes import Axis
    from grazemap_core.maps.planes import Plane as CorePlane

    across, up = plane.horizontal, plane.vertical
    oscillator = varying_oscillator(plane.parameters.oscillator, across.vary, up.vary)
    axes = (Axis(one.vary, grid_values(one.values)) for one in (across, up))
    return CorePlane(oscillator, parameter_point(oscillator, plane.parameters), *axes)


def _axes(request: UnfoldingMapsRequest, plane: CorePlane) -> Document:
    """Return the values of the parameters, named omega and clearance where they are given as ranges of these."""
    names = ("omega", "clearance") if request.horizontal is None else ("horizontal", "vertical")
    return dict(zip(names, (plane.horizontal.values, plane.vertical.values), strict=True))


def _margins(request: UnfoldingMapsRequest, plane: CorePlane) -> Document:
    """Return how far the stops are from the steady motion, whose zeros are the grazing curves in any plane."""
    from grazemap_core.maps.margins import grazing_margins

    if request.horizontal is None:  # their curves are those of grazing-curves
        return {}
    margins = zip(("margin_right", "margin_left"), grazing_margins(plane), strict=True)
    return {name: np.where(np.isinf(margin), np.nan, margin) for name, margin in margins}


def _remedy_of_sensitive(request: UnfoldingMapsRequest) -> str:
    """Return what decides where a sensitive point of a map leads."""
    if request.policy.startswith("sweep"):
        return "Remedy: a map from rest with resolve_sensitive; a point of a sweep starts at a rounded state."
    if request.adaptive:
        return "Remedy: a map of the points around it that is not adaptive, with resolve_sensitive."
    if request.resolve_sensitive:
        return "More digits have not decided it either. Remedy: simulate more periods (max_periods)."
    return "Remedy: an unfolding map with resolve_sensitive, which computes the point in more digits."


def _without_figures_of_inferred(arrays: dict[str, NDArray[Any]]) -> Document:
    """Return an adaptive map's document."""
    from grazemap_core.maps.adaptive_map import LABEL

    dense = (*LABEL, "computed")
    figures = {name: array[arrays["computed"]] for name, array in arrays.items() if name not in dense}
    return {name: arrays[name] for name in dense} | {_AT_COMPUTED: figures}


def _completed(
    request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], whole: Document, report: Report | None
) -> Document:
    """Complete an adaptive map, in place. Return the values at computed points, and how many inferred ones are wrong.

    Without a point that is inferred to have a motion, or to be chaotic, the latter is left out.
    """
    from grazemap_core.maps.adaptive_map import complete_map

    rows, columns, fresh, wrong = complete_map(
        core_plane(request.plane),
        whole | {"sensitive": _of_grid(plan, tiles, "sensitive")},
        list(range(plan.tile_rows, plan.rows, plan.tile_rows)),
        list(range(plan.tile_columns, plan.columns, plan.tile_columns)),
        **fields(request, *_SETTINGS),
    )
    if report is not None:
        report(1, 2)
    figures: Document = {}
    for name in tiles[0][_AT_COMPUTED]:  # one at a time, as each needs an array of the grid
        array = _of_grid(plan, tiles, name)
        if len(rows):
            array[rows, columns] = fresh[name]
        figures[name] = array[whole["computed"]]
    return {_AT_COMPUTED: figures} | ({} if wrong is None else {"inferred_wrong": record(wrong)})


def _of_grid(plan: Plan, tiles: list[Document], name: str) -> NDArray[Any]:
    """Return an array of the grid from the values at the computed points of its tiles; 0 or false at the others."""
    array = np.zeros((plan.rows, plan.columns), dtype=tiles[0][_AT_COMPUTED][name].dtype)
    for place, tile in zip(plan.tiles, tiles, strict=True):
        array[place.rows, place.columns][tile["computed"]] = tile[_AT_COMPUTED][name]
    return array


PROCESS = Process(tile=compute_tile, assembled=assemble)
