"""The process basin-fractions: the shares of random initial states that lead to each attractor along a parameter.

The rows of a tile are values of the parameter, its columns initial states.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap import results
from grazemap.codec import Document
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import BasinFractionsRequest, StateRange, grid_points, grid_values
from grazemap_worker.planning import Plan, Tile, rates
from grazemap_worker.planning.costs import Samples, longest_period_cost, setup_seconds
from grazemap_worker.planning.limits import Count, RequestLimits, points_pointer
from grazemap_worker.processes.basins import plan_of_states
from grazemap_worker.processes.conversion import core_line, join_tiles, label, without_none
from grazemap_worker.processes.process import Process, Report

if TYPE_CHECKING:
    from grazemap_core.maps.basin_fractions import StateRanges
    from grazemap_core.maps.basins import Attractor
    from grazemap_core.maps.planes import Point


def _tiling(request: BasinFractionsRequest) -> Plan:
    samples = Samples.create(request.line)
    grid = Plan(rows=grid_points(request.axis.values), columns=request.states)
    setup = setup_seconds(request.oscillator) / request.states
    settles = samples.settling(request.max_periods)
    return plan_of_states(request, grid, request.states, settles, samples.mean_cost(), setup)


def _counts(request: BasinFractionsRequest, limits: RequestLimits) -> list[Count]:
    values = grid_points(request.axis.values)
    return [
        Count(
            points_pointer("axis/values", request.axis.values),
            "points",
            values,
            min(limits.points, rates.FRACTION_VALUES),
        ),
        Count("/states", "points", values * request.states, limits.pixels),
    ]


def compute_tile(request: BasinFractionsRequest, tile: Tile) -> Document:
    """Return the arrays [value, state] of the core for the values and states of a tile. Raises CoreError."""
    from grazemap_core.maps.basin_fractions import fraction_tile, random_states

    points = _points(request)
    states = random_states(points, _ranges(request, points), request.states, request.seed)
    return fraction_tile(
        points[tile.row_slice], states[tile.column_slice], request.phase, request.max_periods, request.max_period
    )


def assemble(
    request: BasinFractionsRequest, plan: Plan, tiles: list[Document], report: Report | None = None
) -> ClassDocument:
    """Return the attractors along the parameter and their shares, from the documents of the tiles."""
    from grazemap_core.maps.basin_fractions import basin_fractions, random_states
    from grazemap_core.maps.chaotic_transients import chance_in_fractions

    whole = join_tiles(plan, tiles)
    points = _points(request)
    ranges = _ranges(request, points)
    states = random_states(points, ranges, request.states, request.seed)
    fractions = basin_fractions(whole)
    values = grid_values(request.axis.values)
    chance = chance_in_fractions(whole["kind"], points, states, request.phase, request.max_periods, request.max_period)
    return document_of(
        results.BasinFractions,
        fractions,
        parameter=values,
        attractors=[
            _attractor(attractor, values[states > 0])
            for attractor, states in zip(fractions.attractors, fractions.states, strict=True)
        ],
        displacement=ranges.displacement,
        velocity=ranges.velocity,
        **without_none({"chance_to_settle": chance}),
    )


def _points(request: BasinFractionsRequest) -> list[Point]:
    from grazemap_core.maps.basin_fractions import points_along

    return points_along(core_line(request.line))


def _ranges(request: BasinFractionsRequest, points: list[Point]) -> StateRanges:
    from grazemap_core.maps.basin_fractions import ranges_of

    return ranges_of(points, *map(_pairs, (request.displacement, request.velocity)))


def _pairs(ranges: list[StateRange] | None) -> Any:
    return None if ranges is None else np.array([(interval.start, interval.stop) for interval in ranges])


def _attractor(attractor: Attractor, values: NDArray[np.float64]) -> Document:
    """Return the document of an attractor with its label, and the values between which it was found."""
    ends = {"first": float(values[0]), "last": float(values[-1])}
    return document_of(results.ContinuedAttractor, attractor, label=label(attractor), found=len(values), **ends)


PROCESS = Process(
    tile=compute_tile,
    assembled=assemble,
    tiling=_tiling,
    counts=_counts,
    longest_period_cost=lambda request: longest_period_cost(request.line),
    kernels="maps",
)
