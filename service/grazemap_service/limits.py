"""The limits of this server, besides those of the wire models.

The cheap counts are checked before the plan is made, so that a range of 10**18 points costs nothing; then the plan's
estimate. A refusal is a "too-much-work" problem with the members `estimate` and `limit`.
"""

from __future__ import annotations

import numpy as np

from grazemap.wire import ProblemError, ProcessRequest
from grazemap_service.problems import ProblemException, invalid
from grazemap_service.settings import Settings
from grazemap_worker.planning import Limits, Plan
from grazemap_worker.planning.limits import MOST_RESULT_BYTES
from grazemap_worker.planning.rates import MOST_TILE_SECONDS, PERIODS_PER_SECOND
from grazemap_worker.processes import PROCESSES

# Larger estimates are reported as this number, so that no number that was sent is repeated.
_MOST_REPORTED = 1e18
# Of a step after the tiles of a job, as estimated; it is stopped after an hour of processor time.
MOST_STEP_SECONDS = 3600.0


def checked_plan(process: str, request: ProcessRequest, settings: Settings) -> Plan:
    """Return the plan of a request that this server takes.

    Raises
    ------
    ProblemException
        "invalid-request" (too many masses) or "too-much-work".
    """
    if request.oscillator.size > settings.max_masses:
        most = f"at most {settings.max_masses} masses"
        raise invalid("/oscillator/masses", "Too many masses for this server", most)
    planning = PROCESSES[process]
    for counted in planning.counts(request, _limits(settings)):
        if counted.number > counted.limit:
            raise _too_much(*counted)
    with np.errstate(all="ignore"):
        cost = planning.longest_period(request)
    # a system so stiff that one period of it is over the limit
    if cost is not None and not cost / PERIODS_PER_SECOND <= settings.max_seconds:
        raise _too_much("/oscillator", "seconds", cost / PERIODS_PER_SECOND, settings.max_seconds)
    planned = planning.plan(request)
    # written so that a nan, from an estimate that overflowed, is refused too
    if not planned.estimate.periods <= settings.max_work:
        raise _too_much("", "forcing periods", planned.estimate.periods, settings.max_work)
    most_seconds = MOST_TILE_SECONDS * planned.count
    for step in planning.after(request):
        most_seconds += step.seconds
        if step.timed and step.seconds > MOST_STEP_SECONDS:
            raise _too_much(step.pointer, "seconds", step.seconds, MOST_STEP_SECONDS)
    most_seconds = min(settings.max_seconds, most_seconds)
    if not planned.estimate.seconds <= most_seconds:
        raise _too_much("", "seconds", planned.estimate.seconds, most_seconds)
    return planned


def _limits(settings: Settings) -> Limits:
    return Limits(
        points=settings.max_points,
        pixels=settings.max_pixels,
        adaptive_pixels=settings.max_adaptive_pixels,
        tile_periods=settings.max_tile_periods,
        result_bytes=MOST_RESULT_BYTES,
    )


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
