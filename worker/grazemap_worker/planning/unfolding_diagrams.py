"""The tiles of an unfolding diagram, which are those of its map, and the steps after them."""

from __future__ import annotations

import math

from grazemap.wire import UnfoldingDiagramsRequest
from grazemap_worker.planning import bifurcation_curves, codimension_two_points, grazing_curves, unfolding_maps
from grazemap_worker.planning.costs import longest_period
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import Count, Limits, Planning, Step
from grazemap_worker.planning.rates import (
    BORDERS_POINT_SECONDS,
    BORDERS_SIDE_SECONDS,
    BORDERS_STEPS,
    MOST_BORDER_NUMBERS,
    MOST_STEPS_AFTER,
)


def _plan(request: UnfoldingDiagramsRequest) -> Plan:
    """Return the plan of the map, with the steps after its tiles, each of about the time of a tile."""
    shape = unfolding_maps.plan(request.unfolding_map)
    seconds = _curves_seconds(request) + _borders_seconds(request)
    after = math.ceil(min(seconds * shape.count / shape.estimate.seconds, MOST_STEPS_AFTER))
    estimate = shape.estimate.model_copy(update={"seconds": shape.estimate.seconds + seconds})
    return shape.model_copy(update={"after": max(after, BORDERS_STEPS if request.borders else 1), "estimate": estimate})


def _curves_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return the seconds for the curves and points over the map."""
    curves = request.bifurcation_curves
    over = [] if curves is None else [bifurcation_curves.PLANNING.plan(curves)]
    if request.horizontal is None:
        over.append(grazing_curves.PLANNING.plan(request.grazing_curve))
        over.append(codimension_two_points.PLANNING.plan(request.codimension_two_points))
    return sum(planned.estimate.seconds for planned in over)


def _borders_seconds(request: UnfoldingDiagramsRequest) -> float:
    """Return the seconds for explaining the borders of the map."""
    if not request.borders:
        return 0.0
    points = float(math.prod(request.plane.shape))
    return request.oscillator.size * (BORDERS_POINT_SECONDS * points + BORDERS_SIDE_SECONDS * math.sqrt(points))


def _counts(request: UnfoldingDiagramsRequest, limits: Limits) -> list[Count]:
    (grid,) = unfolding_maps.PLANNING.counts(request.unfolding_map, limits)
    if not request.borders:
        return [grid]
    return [grid, Count("/borders", "points", grid.number, MOST_BORDER_NUMBERS // request.oscillator.size)]


def _after(request: UnfoldingDiagramsRequest) -> list[Step]:
    return [
        Step("/max_multiple", _curves_seconds(request), timed=True),
        Step("/borders", _borders_seconds(request), timed=False),
    ]


PLANNING = Planning(
    _plan,
    _counts,
    lambda request: longest_period(request.plane),
    _after,
    kernels="diagrams",
    apart=lambda request: unfolding_maps.apart(request.unfolding_map),
    of_masses=True,
)
