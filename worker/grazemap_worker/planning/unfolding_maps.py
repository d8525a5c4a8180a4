"""The tiles of an unfolding map.

Its grid is cut into equal rectangles (the last ones smaller) that should take `TILE_SECONDS` each, as tall as possible,
because the clearances of one omega run side by side. The result does not depend on the tiles. The tiles of a sweep are
whole columns. Those of an adaptive map are strips of `ADAPTIVE_COLUMNS`, which do affect the choice of the computed
points.
"""

from __future__ import annotations

import math

from grazemap.wire import UnfoldingMapsRequest
from grazemap.wire.planes import Axis, Plane, is_scalar, is_structural
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import (
    Samples,
    chance_seconds,
    longest_period,
    setup_seconds,
)
from grazemap_worker.planning.plan import Plan, estimated, even, pixels_per_tile
from grazemap_worker.planning.planning import Count, Limits, Planning, of_grid


def plan(request: UnfoldingMapsRequest) -> Plan:
    """Return the tiles of a map and its estimate."""
    rows, columns = request.plane.shape
    samples, sweeps = Samples.of(request.plane), request.policy.startswith("sweep")
    # the trajectories of a sweep, one after another, never share a lockstep
    cost = samples.mean_cost() * (rates.ALONE_SLOWER if _share_none(request.plane) and not sweeps else 1.0)
    settling = samples.settling(request.max_periods)
    rate = rates.SWEEP_PERIODS_PER_SECOND if sweeps else rates.MAP_PERIODS_PER_SECOND
    starts = request.initial_conditions if request.policy == "ensemble" else 1
    more = setup_seconds(request.oscillator)
    column = rates.COLUMN_SETUPS * more
    observed = starts * samples.observed_seconds(request, cost, 0.0 if request.preview else settling.unsettled)
    orbit = 0.0
    if request.preview:
        cost /= rates.PREVIEW_FASTER
    else:
        orbit = settling.orbit_seconds
        together = rates.RUN_ON_TOGETHER if request.policy == "rest" else 1
        more += chance_seconds(settling.unsettled * starts * rows * columns, request.max_periods, cost, together)
    if not sweeps:
        cost *= starts * math.sqrt(rates.FULL_COLUMN / min(starts * rows, rates.LONGEST_COLUMN))
    if request.adaptive:
        period = cost / rates.MAP_PERIODS_PER_SECOND
        return _adaptive_plan(request, starts, settling.periods, period, starts * orbit, more + columns * column)
    pixel_seconds = settling.periods * cost / rate + starts * orbit + column / rows + observed
    at_worst = request.max_periods * cost / rate + observed
    if request.resolve_sensitive:
        pixel_seconds += starts * rates.SENSITIVE * rates.RESOLUTION_SECONDS
        at_worst += starts * rates.RESOLUTION_AT_WORST
    pixels = pixels_per_tile(pixel_seconds, rates.WORST_SLOWER * at_worst)
    tile_rows = rows if sweeps else even(rows, min(pixels, rates.TALLEST_TILE))
    tile_columns = even(columns, max(1, pixels // tile_rows))
    if not sweeps and _rows_share(request.plane):
        tile_columns = even(columns, min(pixels, rates.TALLEST_TILE))
        tile_rows = even(rows, max(1, pixels // tile_columns))
    shape = Plan(rows=rows, columns=columns, tile_rows=tile_rows, tile_columns=tile_columns)
    return estimated(shape, starts * settling.periods, pixel_seconds, more)


def _adaptive_plan(
    request: UnfoldingMapsRequest,
    starts: int,
    periods_per_pixel: float,
    period_seconds: float,
    orbit_seconds: float,
    more_seconds: float,
) -> Plan:
    """Return a plan of strips, with the cost from the expected share of computed pixels.

    `periods_per_pixel` are those of a map that is not adaptive; `period_seconds` is the time for a forcing period of
    all trajectories of a pixel, `orbit_seconds` that for their orbits, `more_seconds` that of all else.
    """
    (rows, columns), max_periods = request.plane.shape, request.max_periods
    share = min(1.0, (rates.ADAPTIVE_SIDE / math.sqrt(rows * columns)) ** rates.ADAPTIVE_POWER)
    expected = rates.ADAPTIVE_PERIODS * periods_per_pixel
    periods = share * min(float(max_periods), expected)
    row_seconds = rates.WORST_SLOWER * max_periods * period_seconds * rates.ADAPTIVE_COLUMNS
    longest = round(rates.WORST_TILE_SECONDS / row_seconds)
    shape = Plan(
        rows=rows,
        columns=columns,
        tile_rows=even(rows, max(1, min(longest, rates.ADAPTIVE_ROWS))),
        tile_columns=min(columns, rates.ADAPTIVE_COLUMNS),
    )
    shape = shape.model_copy(update={"after": shape.count // rates.ADAPTIVE_STRIPS_CLOSED})
    return estimated(shape, starts * periods, periods * period_seconds + share * orbit_seconds, more_seconds)


def _rows_share(plane: Plane) -> bool:
    """Return whether the points of a row share tables, or the modes that these are made of, and those of a column not.

    The modes do not depend on omega.
    """
    across, up = plane.horizontal.vary, plane.vertical.vary
    return (is_scalar(across) and not is_scalar(up)) or (across == "omega" and is_structural(up))


def _share_none(plane: Plane) -> bool:
    """Return whether no two points of a plane share their tables."""
    return all(axis.vary == "omega" or is_structural(axis.vary) for axis in (plane.horizontal, plane.vertical))


def apart(request: UnfoldingMapsRequest) -> bool:
    """Return whether trajectories from rest share no tables, and so run each with its own."""
    return request.policy == "rest" and _share_none(request.plane)


def grid_count(horizontal: Axis, vertical: Axis, names: tuple[str, str], limit: int) -> Count:
    """Return the points of the grid of a map, or of a diagram, whose fields have these names."""
    return of_grid((names[0], horizontal.values), (names[1], vertical.values), limit)


def _counts(request: UnfoldingMapsRequest, limits: Limits) -> list[Count]:
    names = ("omega", "clearance") if request.horizontal is None else ("horizontal/values", "vertical/values")
    most = limits.adaptive_pixels if request.adaptive else limits.pixels
    return [grid_count(request.plane.horizontal, request.plane.vertical, names, most)]


PLANNING = Planning(
    plan, _counts, lambda request: longest_period(request.plane), kernels="maps", apart=apart, of_masses=True
)
