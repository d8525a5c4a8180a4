"""What this server computes at most, beyond what the wire models refuse.

The cheap counts are checked before the plan is made, so that a range of 10**18 points costs nothing; then the plan's
estimate. A refusal is a "too-much-work" problem with the members `estimate` and `limit`.
"""

from __future__ import annotations

import numpy as np

from grazemap.models import (
    GrazingCurvesRequest,
    ProblemError,
    ProcessRequest,
    TrajectoriesRequest,
    UnfoldingMapsRequest,
    grid_points,
    grid_values,
)
from grazemap_service.problems import ProblemException
from grazemap_service.settings import Settings
from grazemap_worker.store.plan import PERIODS_PER_SECOND, Plan, period_costs, plan

# Larger estimates are reported as this: a number that was sent must not come back digit by digit.
_MOST_REPORTED = 1e18


def checked_plan(process: str, request: ProcessRequest, settings: Settings) -> Plan:
    """Return the plan of a request that this server takes.

    Parameters
    ----------
    process : str
        Name in `grazemap.models.PROCESSES`.
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
    if not planned.estimate.seconds <= settings.max_seconds:
        raise _too_much("", "seconds", planned.estimate.seconds, settings.max_seconds)
    return planned


def _counts(request: ProcessRequest, settings: Settings) -> list[tuple[str, str, int, int]]:
    """Return what can be counted without a plan: pointer, quantity, count, limit."""
    if isinstance(request, GrazingCurvesRequest):
        return [("/omega", "points", grid_points(request.omega), settings.max_points)]
    if isinstance(request, UnfoldingMapsRequest):
        pixels = grid_points(request.omega) * grid_points(request.clearance)
        return [("", "points", pixels, settings.max_pixels)]
    if isinstance(request, TrajectoriesRequest):
        periods = request.periods + request.transient_periods
        samples = request.periods * request.samples_per_period
        return [
            ("/periods", "periods", periods, settings.max_tile_periods),
            ("/samples_per_period", "samples", samples, settings.max_points),
        ]
    return []


def _check_stiffness(request: ProcessRequest, settings: Settings) -> None:
    """Refuse a system one period of which is over the limit, before its plan is made: estimates would overflow."""
    if not isinstance(request, TrajectoriesRequest | UnfoldingMapsRequest):
        return
    least = grid_values(request.omega)[0] if isinstance(request, UnfoldingMapsRequest) else request.omega
    with np.errstate(all="ignore"):
        cost = period_costs(request.oscillator, np.array([least]))[0]
    seconds = float(cost) / PERIODS_PER_SECOND
    if not seconds <= settings.max_seconds:
        raise _too_much("/oscillator", "seconds", seconds, settings.max_seconds)


def _too_much(pointer: str, quantity: str, estimate: float, limit: float) -> ProblemException:
    # a nan is an estimate that overflowed on its way
    reported = float(f"{estimate:.10g}") if estimate < _MOST_REPORTED else _MOST_REPORTED
    word = "about" if estimate < _MOST_REPORTED else "at least"
    allowed = f"at most {limit:.10g} {quantity}"
    detail = f"The job would take {word} {reported:.10g} {quantity}; allowed are {allowed}."
    name = quantity.replace(" ", "_")
    return ProblemException(
        "too-much-work",
        detail,
        errors=[ProblemError(pointer=pointer, detail=detail, allowed=allowed)],
        extensions={"estimate": {name: reported}, "limit": {name: limit}},
    )
