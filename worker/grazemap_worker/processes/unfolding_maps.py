"""The process unfolding-maps: the motion to which every point of a grid settles, in tiles of the grid.

>>> plan = tiling(request)
>>> plan.tile_count, plan.tile(0)
(1, Tile(row_start=0, row_stop=2, column_start=0, column_stop=2))
>>> compute_tile(request, plan.tile(0))["impacts_right"]
array([[2, 3], [2, 2]], dtype=int32)

In an adaptive map some points are computed, and the others are inferred from them. The document has arrays of the whole
grid for values that are known at inferred points too. The other values are in `at_computed`, for computed points only,
in the order of numpy's ``array[computed]``.
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.results.unfolding import FiguresAtComputedPoints
from grazemap.wire import UnfoldingMapsRequest, grid_values
from grazemap.wire.planes import AXES, SCALARS, Plane, is_structural
from grazemap_worker.planning import Plan, Tile, rates
from grazemap_worker.planning.costs import Samples, chance_seconds, longest_period_cost, setup_seconds
from grazemap_worker.planning.limits import Count, RequestLimits, grid_count
from grazemap_worker.planning.plan import even_pieces, pixels_per_tile, with_estimate
from grazemap_worker.processes import other_starts
from grazemap_worker.processes.conversion import (
    fields,
    join_tiles,
    parameter_point,
    reasons,
    varying_oscillator,
    without_none,
)
from grazemap_worker.processes.observables import OUTPUTS, core_observables, observed_document
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.maps.map_settings import MapSettings
    from grazemap_core.maps.planes import Plane as CorePlane


def tiling(request: UnfoldingMapsRequest) -> Plan:
    """Return the tiles of a map and its estimate."""
    rows, columns = request.plane.shape
    samples, sweeps = Samples.create(request.plane), request.policy.startswith("sweep")
    cost = samples.mean_cost()
    # with their own tables, trajectories that run side by side are slower; a sweep computes one after another
    if _points_have_own_tables(request.plane) and not sweeps:
        cost *= rates.OWN_TABLES_SLOWER
    settling = samples.settling(request.max_periods)
    rate = rates.SWEEP_PERIODS_PER_SECOND if sweeps else rates.MAP_PERIODS_PER_SECOND
    starts = request.initial_conditions if request.policy == "ensemble" else 1
    more_seconds = setup_seconds(request.oscillator)
    column_seconds = rates.COLUMN_SETUPS * more_seconds
    more_seconds += other_starts.seconds_of_map(request, samples)
    observed = starts * samples.observed_seconds(request, cost, 0.0 if request.preview else settling.unsettled)
    orbit_seconds = 0.0
    if request.preview:
        cost /= rates.PREVIEW_FASTER
    else:
        orbit_seconds = starts * settling.orbit_seconds
        chaotic = settling.unsettled * starts * rows * columns
        together = rates.RUN_ON_TOGETHER if request.policy == "rest" else 1
        more_seconds += chance_seconds(chaotic, request.max_periods, cost, together)
    if not sweeps:
        cost *= starts * math.sqrt(rates.FULL_COLUMN / min(starts * rows, rates.MAX_COLUMN))
    if request.adaptive:
        period = cost / rates.MAP_PERIODS_PER_SECOND
        more_seconds += columns * column_seconds
        return _adaptive_plan(request, starts, settling.periods, period, orbit_seconds, more_seconds)
    pixel_seconds = settling.periods * cost / rate + orbit_seconds + column_seconds / rows + observed
    max_seconds = request.max_periods * cost / rate + observed
    if request.resolve_sensitive:
        pixel_seconds += starts * rates.SENSITIVE * rates.RESOLUTION_SECONDS
        max_seconds += starts * rates.RESOLUTION_AT_WORST
    pixels = pixels_per_tile(pixel_seconds, rates.WORST_SLOWER * max_seconds)
    tile_rows = rows if sweeps else even_pieces(rows, min(pixels, rates.MAX_TILE_ROWS))
    tile_columns = even_pieces(columns, max(1, pixels // tile_rows))
    if not sweeps and _rows_share_tables(request.plane):
        # wide tiles in place of tall ones, with the same maximum
        tile_columns = even_pieces(columns, min(pixels, rates.MAX_TILE_ROWS))
        tile_rows = even_pieces(rows, max(1, pixels // tile_columns))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return with_estimate(shape, starts * settling.periods, pixel_seconds, more_seconds)


def _adaptive_plan(
    request: UnfoldingMapsRequest,
    starts: int,
    periods_per_pixel: float,
    period_seconds: float,
    orbit_seconds: float,
    more_seconds: float,
) -> Plan:
    """Return a plan of strips, which are tall tiles; its estimate is based on the expected share of computed pixels.

    `periods_per_pixel` is the number of forcing periods of a pixel in a map that is not adaptive. `period_seconds` is
    the time for a forcing period of all trajectories of a pixel, `orbit_seconds` the time for their orbits, and
    `more_seconds` the time for everything else.
    """
    (rows, columns), max_periods = request.plane.shape, request.max_periods
    share = min(1.0, (rates.ADAPTIVE_SIDE / math.sqrt(rows * columns)) ** rates.ADAPTIVE_POWER)
    expected = rates.ADAPTIVE_PERIODS * periods_per_pixel
    periods = share * min(float(max_periods), expected)
    row_seconds = rates.WORST_SLOWER * max_periods * period_seconds * rates.ADAPTIVE_COLUMNS
    max_rows = round(rates.WORST_TILE_SECONDS / row_seconds)
    shape = Plan(
        rows=rows,
        columns=columns,
        tile_rows=even_pieces(rows, max(1, min(max_rows, rates.ADAPTIVE_ROWS))),
        tile_columns=min(columns, rates.ADAPTIVE_COLUMNS),
    )
    # the steps after the tiles close the seams between the strips, and join them
    shape = shape.model_copy(update={"after": shape.tile_count // rates.ADAPTIVE_STRIPS_CLOSED})
    return with_estimate(shape, starts * periods, periods * period_seconds + share * orbit_seconds, more_seconds)


def _rows_share_tables(plane: Plane) -> bool:
    """Return whether the points of a row share their tables, or their modes, while the points of a column do not.

    Tables are made from the modes and omega; the modes do not depend on omega.
    """
    across, up = plane.horizontal.vary, plane.vertical.vary
    return (across in SCALARS and up not in SCALARS) or (across == "omega" and is_structural(up))


def _points_have_own_tables(plane: Plane) -> bool:
    """Return whether every point of a plane needs its own tables."""
    return all(axis.vary == "omega" or is_structural(axis.vary) for axis in (plane.horizontal, plane.vertical))


def own_tables(request: UnfoldingMapsRequest) -> bool:
    """Return whether a request needs the kernels of trajectories from rest that have their own tables."""
    return request.policy == "rest" and _points_have_own_tables(request.plane)


def counts(request: UnfoldingMapsRequest, limits: RequestLimits) -> list[Count]:
    """Return the count of the points of the map."""
    max_pixels = limits.adaptive_pixels if request.adaptive else limits.pixels
    across, up = ((f"{name}/values", getattr(request, name).values) for name in AXES)
    return [grid_count(across, up, max_pixels)]


_OF_AXES = ("omega", "clearance", *AXES)
_NAMES = ("kinds", "reasons")
_AT_COMPUTED = "at_computed"


def compute_tile(request: UnfoldingMapsRequest, tile: Tile) -> Document:
    """Return a rectangle of the map: the values of the parameters, and the arrays [vertical, horizontal] of the core.

    The values of the parameters are slices of those of the whole grid. Therefore the bytes of a map that is not
    adaptive do not depend on how the map is cut into tiles. The tiles of a sweep are as tall as the map. Raises
    CoreError.
    """
    from grazemap_core.codes import ROUNDING_DECIDES
    from grazemap_core.maps.adaptive_map import NOT_COMPUTED, NOT_COMPUTED_REASON, adaptive_map_tile
    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.simulation.motion import KINDS, SENSITIVE_REASON

    plane, settings = core_plane(request.plane).part(tile.row_slice, tile.column_slice), core_settings(request)
    texts = reasons()
    texts[ROUNDING_DECIDES] = f"{SENSITIVE_REASON} {_remedy_of_sensitive(request)}"
    arrays: Document
    if request.adaptive:
        arrays = _adaptive_document(adaptive_map_tile(plane, settings))
        assert len(texts) == NOT_COMPUTED
        texts.append(NOT_COMPUTED_REASON)
    else:
        observed = core_observables(request)
        arrays = unfolding_map_tile(plane, settings, resolve_sensitive=request.resolve_sensitive, observed=observed)
        arrays |= observed_document(request, arrays.pop("figures", None))
    return {
        **_axes(request, plane),
        **arrays,
        **_margins(request, plane),
        "kinds": np.array(KINDS),
        "reasons": np.array(texts),
    }


def assemble(
    request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], report: Report | None = None
) -> ClassDocument:
    """Return the whole map from the documents of its tiles in the order of the plan. Raises CoreError."""
    from grazemap_core.maps.chaotic_transients import chance_in_map

    plane = core_plane(request.plane)
    whole = join_tiles(plan, tiles, omitted=(*_OF_AXES, *_NAMES, _AT_COMPUTED, OUTPUTS))
    if OUTPUTS in tiles[0]:
        outputs = zip(*(tile[OUTPUTS] for tile in tiles), strict=True)
        whole[OUTPUTS] = [parts[0] | join_tiles(plan, parts, omitted=("name", "unit")) for parts in outputs]
    if request.adaptive:
        whole |= _completed(request, plan, tiles, whole, report)
    chance = chance_in_map(whole["kind"], plane, core_settings(request))
    return document_of(
        results.UnfoldingMap,
        **_axes(request, plane),
        **whole,
        **{name: tiles[0][name] for name in _NAMES},
        **without_none({"chance_to_settle": chance}),
        **other_starts.in_map(request, plane),
    )


def core_plane(plane: Plane) -> CorePlane:
    """Return the core's plane of two parameters. Raises CoreError."""
    from grazemap_core.maps.planes import Axis
    from grazemap_core.maps.planes import Plane as CorePlane

    across, up = plane.horizontal, plane.vertical
    oscillator = varying_oscillator(plane.parameters.oscillator, across.vary, up.vary)
    axes = (Axis(axis.vary, grid_values(axis.grid)) for axis in (across, up))
    return CorePlane(oscillator, parameter_point(oscillator, plane.parameters), *axes)


def core_settings(request: UnfoldingMapsRequest) -> MapSettings:
    """Return the core's settings of a map."""
    from grazemap_core.maps.map_settings import MapSettings

    return MapSettings(**fields(request, *(field.name for field in dataclasses.fields(MapSettings))))


def _axes(request: UnfoldingMapsRequest, plane: CorePlane) -> Document:
    """Return the values of the two parameters, in the fields of the plane."""
    return dict(zip(request.plane.fields, (plane.horizontal.values, plane.vertical.values), strict=True))


def _margins(request: UnfoldingMapsRequest, plane: CorePlane) -> Document:
    """Return the distances of the stops from the steady motion; the zeros of the distances are the grazing curves."""
    from grazemap_core.maps.plane_grazes import grazing_margins

    if request.plane.fields != AXES:  # the process grazing-curves has the grazing curves of such a plane
        return {}
    # infinite: the stop is absent
    margins = zip(("margin_right", "margin_left"), grazing_margins(plane), strict=True)
    return {name: np.where(np.isinf(margin), np.nan, margin) for name, margin in margins}


def _remedy_of_sensitive(request: UnfoldingMapsRequest) -> str:
    """Return a text that says how to find out the motion of a sensitive point of a map."""
    if request.policy.startswith("sweep"):
        return "Remedy: a map from rest with resolve_sensitive; a point of a sweep starts at a rounded state."
    if request.adaptive:
        return "Remedy: a map of the points around it that is not adaptive, with resolve_sensitive."
    if request.resolve_sensitive:
        return "More digits have not decided it either. Remedy: simulate more periods (max_periods)."
    return "Remedy: an unfolding map with resolve_sensitive, which computes the point in more digits."


def _adaptive_document(arrays: dict[str, NDArray[Any]]) -> Document:
    """Return the document of an adaptive map; values that inferred points lack are in `at_computed`."""
    from grazemap_core.maps.adaptive_map import LABEL

    dense = (*LABEL, "computed")
    figures = {name: array[arrays["computed"]] for name, array in arrays.items() if name not in dense}
    return {name: arrays[name] for name in dense} | {_AT_COMPUTED: figures}


def _completed(
    request: UnfoldingMapsRequest, plan: Plan, tiles: list[Document], whole: Document, report: Report | None
) -> Document:
    """Complete an adaptive map in place; return the values at computed points, and the number of wrong inferred points.

    This number is left out if no point is inferred to have a motion or to be chaotic.
    """
    from grazemap_core.maps.adaptive_map import complete_map

    rows, columns, fresh, wrong = complete_map(
        core_plane(request.plane),
        whole | {"sensitive": _dense_array(plan, tiles, "sensitive")},
        list(range(plan.tile_rows, plan.rows, plan.tile_rows)),
        list(range(plan.tile_columns, plan.columns, plan.tile_columns)),
        core_settings(request),
    )
    if report is not None:
        report(1, 2)  # half of the steps after the tiles
    figures: Document = {}
    for name in tiles[0][_AT_COMPUTED]:  # one after the other, because each needs an array of the whole grid
        array = _dense_array(plan, tiles, name)
        if len(rows):
            array[rows, columns] = fresh[name]
        figures[name] = array[whole["computed"]]
    return {_AT_COMPUTED: document_of(FiguresAtComputedPoints, **figures), **without_none({"inferred_wrong": wrong})}


def _dense_array(plan: Plan, tiles: list[Document], name: str) -> NDArray[Any]:
    """Return an array of the grid from the values at computed points of its tiles; elsewhere it is 0 or False."""
    array = np.zeros((plan.rows, plan.columns), dtype=tiles[0][_AT_COMPUTED][name].dtype)
    for place, tile in zip(plan.tiles, tiles, strict=True):
        array[place.row_slice, place.column_slice][tile["computed"]] = tile[_AT_COMPUTED][name]
    return array


PROCESS = Process(
    tile=compute_tile,
    assembled=assemble,
    tiling=tiling,
    counts=counts,
    longest_period_cost=lambda request: longest_period_cost(request.plane),
    kernels="maps",
    notes=other_starts.notes,
    own_tables=own_tables,
)
