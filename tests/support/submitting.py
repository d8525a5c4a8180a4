"""Requests, submitted to a store as the service does."""

from __future__ import annotations

from grazemap.wire import GrazingCurvesRequest, Job, ProcessRequest, UnfoldingMapsRequest
from grazemap_worker.planning import Plan
from grazemap_worker.processes import kernels_of
from grazemap_worker.store import ANYBODY, Asker, Bell, Store, Submission

AT_ONCE = Plan()


def submit(
    store: Store,
    process: str,
    request: ProcessRequest,
    core_version: str,
    plan: Plan,
    max_pending_tiles: int = 10**6,
    asker: Asker = ANYBODY,
    max_seconds: float | None = None,
) -> tuple[Job, Bell | None]:
    """Return the job and where to ring for a worker, if it is new; raise what stood against it."""
    submission = Submission(process, request, plan, kernels_of(process, request))
    outcome = store.jobs.submit([submission], core_version, max_pending_tiles, asker, max_seconds)[0]
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def submit_curve(
    store: Store, number: int = 0, plan: Plan = AT_ONCE, asker: Asker = ANYBODY, version: str = "1", most: int = 10**6
) -> Job:
    """Return the job of one of many curves."""
    return submit(store, "grazing-curves", GrazingCurvesRequest(omega=[1, 2 + number]), version, plan, most, asker)[0]


def submit_map(store: Store, number: int, plan: Plan, asker: Asker = ANYBODY) -> Job:
    """Return the job of one of many maps."""
    request = UnfoldingMapsRequest(omega=[1, 2 + number], clearance=[1, 2])
    return submit(store, "unfolding-maps", request, "1", plan, asker=asker)[0]
