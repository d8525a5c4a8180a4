"""The process basins: the motion that every initial state of a rectangle leads to, in tiles of the rectangle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import BasinCoordinate, BasinFractionsRequest, BasinsRequest, grid_points, grid_values
from grazemap_worker.planning import Plan, Tile, rates
from grazemap_worker.planning.costs import (
    Points,
    SettlingEstimate,
    chance_seconds,
    period_cost,
    period_cost_at_point,
    settling,
    setup_seconds,
)
from grazemap_worker.planning.limits import Count, RequestLimits, grid_count
from grazemap_worker.planning.plan import even_pieces, pixels_per_tile, with_estimate
from grazemap_worker.processes.conversion import (
    core_clearance,
    core_oscillator,
    join_tiles,
    label,
    reasons,
    without_none,
)
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.maps.basins import Attractor, Coordinate


def _tiling(request: BasinsRequest) -> Plan:
    rows, columns = grid_points(request.vertical.values), grid_points(request.horizontal.values)
    cost = period_cost(request.oscillator, request.omega, request.clearance, lanes=True)
    settles = settling(request.oscillator, Points.create([(request.omega, request.clearance)]), request.max_periods)
    return plan_of_states(request, Plan(rows=rows, columns=columns), rows * columns, settles, cost)


def plan_of_states(
    request: BasinsRequest | BasinFractionsRequest,
    grid: Plan,
    together: int,
    settles: SettlingEstimate,
    cost: float,
    setup: float = 0.0,
) -> Plan:
    """Return the tiles of a grid of initial states, and the estimate.

    Parameters
    ----------
    grid : Plan
        The rows and columns of the grid.
    together : int
        Number of states that run side by side.
    settles : SettlingEstimate
        How the trajectories settle.
    cost : float
        Mean cost of a forcing period, as `costs.period_costs` returns it.
    setup : float
        Seconds for each state in addition to those of its forcing periods and of its orbit.
    """
    oscillator, max_periods = request.oscillator, request.max_periods
    lanes = math.sqrt(rates.FULL_COLUMN / min(together, rates.FULL_COLUMN))
    seconds = settles.periods * cost * lanes / rates.BASIN_PERIODS_PER_SECOND
    seconds += rates.BASIN_ORBITS * settles.orbit_seconds + setup
    max_seconds = rates.WORST_SLOWER * max_periods * cost / rates.MAP_PERIODS_PER_SECOND
    sample = chance_seconds(grid.rows * grid.columns, max_periods, cost, rates.RUN_ON_SAMPLE)
    chance = settles.unsettled * sample  # either all trajectories are chaotic, or none is
    pixels = pixels_per_tile(seconds, max_seconds)
    tile_columns = even_pieces(grid.columns, pixels)
    tile_rows = even_pieces(grid.rows, max(1, pixels // tile_columns))
    shape = grid.model_copy(update={"tile_rows": tile_rows, "tile_columns": tile_columns})
    return with_estimate(shape, settles.periods, seconds, shape.tile_count * setup_seconds(oscillator) + chance)


def _counts(request: BasinsRequest, limits: RequestLimits) -> list[Count]:
    across, up = ("horizontal/values", request.horizontal.values), ("vertical/values", request.vertical.values)
    return [grid_count(across, up, limits.pixels)]


_STATE_ARRAYS = ("settled_after", "lyapunov", "verified", "sensitive", "transient_growth", "reason")


def compute_tile(request: BasinsRequest, tile: Tile) -> Document:
    """Return the arrays [vertical, horizontal] of the core for a part of the rectangle. Raises CoreError."""
    from grazemap_core.maps.basins import basin_tile

    return basin_tile(*_arguments(request, tile.row_slice, tile.column_slice))


def assemble(request: BasinsRequest, plan: Plan, tiles: list[Document], report: Report | None = None) -> ClassDocument:
    """Return the attractors, and the label of every state, from the documents of the tiles in the plan's order."""
    from grazemap_core.maps.basin_boundary import basin_entropy, evenly_spaced, uncertainty
    from grazemap_core.maps.basins import attractors
    from grazemap_core.maps.chaotic_transients import chance_in_basins

    whole = join_tiles(plan, tiles)
    labels, every_attractor = attractors(whole)
    chance = chance_in_basins(whole["kind"], *_arguments(request, slice(None), slice(None)))
    sides = {name: grid_values(getattr(request, name).values) for name in ("horizontal", "vertical")}
    is_even = all(map(evenly_spaced, sides.values()))
    measures = {"basin_entropy": basin_entropy, "uncertainty": uncertainty} if is_even else {}
    boundary = {name: measure(labels) for name, measure in measures.items()}
    return document_of(
        results.Basins,
        **sides,
        label=labels,
        attractors=list(map(_attractor, every_attractor)),
        **{name: whole[name] for name in _STATE_ARRAYS},
        reasons=np.array(reasons()),
        **without_none(boundary | {"chance_to_settle": chance}),
    )


def _arguments(request: BasinsRequest, rows: slice, columns: slice) -> tuple[Any, ...]:
    """Return the arguments of the core's `basin_tile` for a part of the rectangle."""
    initial = request.initial
    return (
        core_oscillator(request.oscillator),
        request.omega,
        core_clearance(request.clearance),
        _coordinate(request.horizontal, columns),
        _coordinate(request.vertical, rows),
        None if initial.displacement is None else np.array(initial.displacement),
        None if initial.velocity is None else np.array(initial.velocity),
        initial.phase,
        request.max_periods,
        request.max_period,
    )


def _coordinate(coordinate: BasinCoordinate, part: slice) -> Coordinate:
    from grazemap_core.maps.basins import Coordinate

    return Coordinate(coordinate.quantity, coordinate.mass, grid_values(coordinate.values)[part])


def _attractor(attractor: Attractor) -> Document:
    """Return the document of an attractor with the label of its motion; unknown figures are None."""
    unknown = {name: None for name in ("multiplier", "lyapunov") if np.isnan(getattr(attractor, name))}
    return document_of(results.Attractor, attractor, label=label(attractor), **unknown)


PROCESS = Process(
    tile=compute_tile,
    assembled=assemble,
    tiling=_tiling,
    counts=_counts,
    longest_period_cost=period_cost_at_point,
    kernels="maps",
)
