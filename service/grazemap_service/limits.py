"""The limits of this server, in addition to those of the wire models.

The counts of a request and the cost of its longest forcing period are checked before the plan is made, so that a range
of 10**18 points costs nothing. Then the estimate of the plan is checked. A refusal is a "too-much-work" problem with
the members `estimate` and `limit`.
"""

from __future__ import annotations

import numpy as np

from grazemap.wire import ProblemError, ProcessRequest
from grazemap_service.problems import ProblemException, invalid
from grazemap_service.settings import ServiceSettings
from grazemap_worker.planning import Plan, RequestLimits
from grazemap_worker.planning.limits import MAX_RESULT_BYTES
from grazemap_worker.planning.rates import MAX_TILE_SECONDS, PERIODS_PER_SECOND
from grazemap_worker.processes import IMPLEMENTATIONS

# Larger estimates, and those that are not numbers, are reported as this number.
_MAX_REPORTED = 1e18
# Maximum estimate of a step after the tiles of a job, if the time limit of a tile (an hour) applies to the step.
MAX_STEP_SECONDS = 3600.0


def checked_plan(process: str, request: ProcessRequest, settings: ServiceSettings) -> Plan:
    """Return the plan of a request, after checking the limits.

    Raises
    ------
    ProblemException
        "invalid-request" (too many masses) or "too-much-work".
    """
    if request.oscillator.size > settings.max_masses:
        allowed = f"at most {settings.max_masses} masses"
        raise invalid("/oscillator/masses", "Too many masses for this server", allowed)
    implementation = IMPLEMENTATIONS[process]
    for count in implementation.counts(request, _limits(settings)):
        if count.number > count.limit:
            raise _too_much(request.pointer_as_written(count.pointer), *count[1:])
    with np.errstate(all="ignore"):
        cost = implementation.longest_period_cost(request)
    # the oscillator may be so stiff that a single period exceeds the limit
    if cost is not None and not cost / PERIODS_PER_SECOND <= settings.max_seconds:
        raise _too_much("/oscillator", "seconds", cost / PERIODS_PER_SECOND, settings.max_seconds)
    plan = implementation.plan(request)
    # the conditions are negated so that nan, from an estimate that overflowed, is refused too
    if not plan.estimate.periods <= settings.max_work:
        raise _too_much("", "forcing periods", plan.estimate.periods, settings.max_work)
    # no job may take longer than all its tiles and the steps after them may
    max_seconds = MAX_TILE_SECONDS * plan.tile_count
    for step in implementation.after(request):
        max_seconds += step.seconds
        if step.timed and step.seconds > MAX_STEP_SECONDS:
            pointer = request.pointer_as_written(step.pointer)
            raise _too_much(pointer, "seconds", step.seconds, MAX_STEP_SECONDS)
    max_seconds = min(settings.max_seconds, max_seconds)
    if not plan.estimate.seconds <= max_seconds:
        raise _too_much("", "seconds", plan.estimate.seconds, max_seconds)
    return plan


def _limits(settings: ServiceSettings) -> RequestLimits:
    return RequestLimits(
        points=settings.max_points,
        pixels=settings.max_pixels,
        adaptive_pixels=settings.max_adaptive_pixels,
        tile_periods=settings.max_tile_periods,
        result_bytes=MAX_RESULT_BYTES,
    )


def _too_much(pointer: str, quantity: str, estimate: float, limit: float) -> ProblemException:
    # an estimate that overflowed is nan
    reported = float(f"{estimate:.10g}") if estimate < _MAX_REPORTED else _MAX_REPORTED
    word = "about" if estimate < _MAX_REPORTED else "at least"
    allowed = f"at most {limit:.10g} {quantity}"
    detail = f"The job would take {word} {reported:.10g} {quantity}"
    name = quantity.replace(" ", "_")
    return ProblemException(
        "too-much-work",
        f"{detail}; allowed are {allowed}.",
        errors=[ProblemError(pointer=pointer, detail=detail, allowed=allowed)],
        extensions={"estimate": {name: reported}, "limit": {name: limit}},
    )
