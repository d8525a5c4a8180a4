"""The limits of this server, besides those of the wire models.

The cheap counts are checked before the plan is made, so that a range of 10**18 points costs nothing; then the plan's
estimate. A refusal is a "too-much-work" problem with the members `estimate` and `limit`.
"""

from __future__ import annotations

import numpy as np

from grazemap.wire import (
    BasinsRequest,
    BifurcationCurvesRequest,
    BifurcationDiagramsRequest,
    CoordinateRange,
    DiscontinuityMappingsRequest,
    GrazingCurvesRequest,
    Grid,
    PeriodicOrbitsRequest,
    ProblemError,
    ProcessRequest,
    TrajectoriesRequest,
    UnfoldingDiagramsRequest,
    UnfoldingMapsRequest,
    grid_points,
    grid_values,
)
from grazemap_service.problems import ProblemException
from grazemap_service.settings import Settings
from grazemap_worker.planning import Plan, borders_seconds, curves_seconds, plan
from grazemap_worker.planning.costs import period_costs
from grazemap_worker.planning.rates import MOST_BORDER_NUMBERS, PERIODS_PER_SECOND
from grazemap_worker.queue.entries import TILE_TIMEOUT
from grazemap_worker.store import MOST_RESULT_BYTES

# Larger estimates are reported as this: a number that was sent must not come back digit by digit.
_MOST_REPORTED = 1e18
# A tile that is estimated to take longer might be cut off at the end: machines differ.
MOST_TILE_SECONDS = TILE_TIMEOUT / 4
_BYTES_PER_NUMBER = 8


def checked_plan(process: str, request: ProcessRequest, settings: Settings) -> Plan:
    """Return the plan of a request that this server takes.

    Parameters
    ----------
    process : str
        Name in `grazemap.wire.PROCESSES`.
    request : ProcessRequest
        Validated.
    settings : Settings
        The limits.

    Raises
    ------
    ProblemException
        "invalid-request" (too many masses) or "too-much-work".
    """
    if request.oscillator.size > settings.max_masses:
        allowed = f"at most {settings.max_masses} masses"
        error = ProblemError(pointer="/oscillator/masses", detail="Too many masses for this server", allowed=allowed)
        raise ProblemException("invalid-request", errors=[error])
    for pointer, quantity, count, limit in _counts(request, settings):
        if count > limit:
            raise _too_much(pointer, quantity, count, limit)
    _check_stiffness(request, settings)
    planned = plan(process, request)
    # written so that a nan, from an estimate that overflowed, is refused too
    if not planned.estimate.periods <= settings.max_work:
        raise _too_much("", "forcing periods", planned.estimate.periods, settings.max_work)
    most_seconds = MOST_TILE_SECONDS * planned.count
    if isinstance(request, UnfoldingDiagramsRequest):
        curves = curves_seconds(request)
        most_seconds += curves + borders_seconds(request)
        if curves > TILE_TIMEOUT:
            raise _too_much("/max_multiple", "seconds", curves, TILE_TIMEOUT)
    most_seconds = min(settings.max_seconds, most_seconds)
    if not planned.estimate.seconds <= most_seconds:
        raise _too_much("", "seconds", planned.estimate.seconds, most_seconds)
    return planned


def _counts(request: ProcessRequest, settings: Settings) -> list[tuple[str, str, int, int]]:
    """Return what can be counted without a plan: pointer, quantity, count, limit."""
    if isinstance(request, GrazingCurvesRequest):
        points = grid_points(request.omega)
        counts = [(_of_points("omega", request.omega), "points", points, settings.max_points)]
        if request.sequence:
            counts.append(("/max_order", "bytes", points * request.max_order * _BYTES_PER_NUMBER, MOST_RESULT_BYTES))
        return counts
    if isinstance(request, DiscontinuityMappingsRequest):
        # two states, by the map and by the motion, at every return
        numbers = 2 * (2 * request.oscillator.size + 1) * (request.returns + 1) * len(request.overshoot)
        return [
            ("/returns", "bytes", numbers * _BYTES_PER_NUMBER, MOST_RESULT_BYTES),
            ("/returns", "periods", len(request.overshoot) * request.returns, settings.max_tile_periods),
        ]
    if isinstance(request, BifurcationDiagramsRequest):
        values, each = grid_points(request.range), request.transient_periods + request.periods
        return [
            (_of_points("range", request.range), "points", values, settings.max_points),
            ("/periods", "samples", values * request.periods, settings.max_points),
            ("/periods", "periods", values * each, settings.max_tile_periods),
        ]
    if isinstance(request, PeriodicOrbitsRequest):
        return [("/transient_periods", "periods", request.transient_periods, settings.max_tile_periods)]
    if isinstance(request, BasinsRequest):
        across, down = grid_points(request.horizontal.values), grid_points(request.vertical.values)
        name = "horizontal" if across > down else "vertical"
        values = getattr(request, name).values
        return [(_of_points(f"{name}/values", values), "points", across * down, settings.max_pixels)]
    if isinstance(request, UnfoldingMapsRequest | UnfoldingDiagramsRequest):
        across, down = grid_points(request.omega), grid_points(request.clearance)
        longer = ("omega", request.omega) if across > down else ("clearance", request.clearance)
        adaptive = isinstance(request, UnfoldingMapsRequest) and request.adaptive
        most = settings.max_adaptive_pixels if adaptive else settings.max_pixels
        counts = [(_of_points(*longer), "points", across * down, most)]
        if isinstance(request, UnfoldingDiagramsRequest) and request.borders:
            counts.append(("/borders", "points", across * down, MOST_BORDER_NUMBERS // request.oscillator.size))
        return counts
    if isinstance(request, TrajectoriesRequest):
        states, periods = len(request.states), request.periods + request.transient_periods
        samples = states * request.samples
        sampled = "/samples_per_period" if request.times is None else "/times"
        if states * periods > settings.max_tile_periods >= periods:
            return [("/initial", "periods", states * periods, settings.max_tile_periods)]
        return [
            ("/periods", "periods", states * periods, settings.max_tile_periods),
            (sampled, "samples", samples, settings.max_points),
            (sampled, "bytes", samples * _sample_bytes(request), MOST_RESULT_BYTES),
        ]
    return []


def _of_points(name: str, grid: Grid | CoordinateRange) -> str:
    """Return the pointer to the field that gives the number of points of a grid."""
    return f"/{name}" if isinstance(grid, list) else f"/{name}/points"


def _sample_bytes(request: TrajectoriesRequest) -> int:
    """Return the bytes of one sample: its time, and displacement and velocity of every mass."""
    return _BYTES_PER_NUMBER * (1 + 2 * request.oscillator.size)


def _check_stiffness(request: ProcessRequest, settings: Settings) -> None:
    """Refuse a system one period of which is over the limit, before its plan is made: estimates would overflow."""
    match request:
        case UnfoldingMapsRequest() | UnfoldingDiagramsRequest():
            least = float(grid_values(request.omega)[0])
        case BifurcationDiagramsRequest():
            least = float(grid_values(request.range)[0]) if request.vary == "omega" else request.fixed
        case TrajectoriesRequest() | BasinsRequest() | DiscontinuityMappingsRequest() | PeriodicOrbitsRequest():
            least = request.omega
        case BifurcationCurvesRequest() if request.motions is not None:
            least = request.omega.start
        case _:
            return
    with np.errstate(all="ignore"):
        cost = period_costs(request.oscillator, np.array([least]))[0]
    seconds = float(cost) / PERIODS_PER_SECOND
    if not seconds <= settings.max_seconds:
        raise _too_much("/oscillator", "seconds", seconds, settings.max_seconds)


def _too_much(pointer: str, quantity: str, estimate: float, limit: float) -> ProblemException:
    # a nan is an estimate that overflowed
    reported = float(f"{estimate:.10g}") if estimate < _MOST_REPORTED else _MOST_REPORTED
    word = "about" if estimate < _MOST_REPORTED else "at least"
    allowed = f"at most {limit:.10g} {quantity}"
    detail = f"The job would take {word} {reported:.10g} {quantity}"
    name = quantity.replace(" ", "_")
    return ProblemException(
        "too-much-work",
        f"{detail}; allowed are {allowed}.",
        errors=[ProblemError(pointer=pointer, detail=detail, allowed=allowed)],
        extensions={"estimate": {name: reported}, "limit": {name: limit}},
    )
