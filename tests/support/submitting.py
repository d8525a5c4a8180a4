"""Requests, submitted to a store as the service does."""

from __future__ import annotations

from grazemap.wire import GrazingCurvesRequest, Job, ProcessRequest, UnfoldingMapsRequest
from grazemap_worker.planning import Plan
from grazemap_worker.processes import kernels_of
from grazemap_worker.store import ANONYMOUS, Requester, Store, Submission, WorkerQueue

AT_ONCE = Plan()


def submit(
    store: Store,
    process: str,
    request: ProcessRequest,
    core_version: str,
    plan: Plan,
    max_pending_tiles: int = 10**6,
    requester: Requester = ANONYMOUS,
    max_seconds: float | None = None,
) -> tuple[Job, WorkerQueue | None]:
    """Return the job and the queue of the workers to wake, if it is new; raise the error of a refusal."""
    submission = Submission(process, request, plan, kernels_of(process, request))
    outcome = store.jobs.submit([submission], core_version, max_pending_tiles, requester, max_seconds)[0]
    if isinstance(outcome, Exception):
        raise outcome
    return outcome


def submit_curve(
    store: Store,
    number: int = 0,
    plan: Plan = AT_ONCE,
    requester: Requester = ANONYMOUS,
    version: str = "1",
    most: int = 10**6,
) -> Job:
    """Return the job of one of many curves."""
    return submit(store, "grazing-curves", GrazingCurvesRequest(omega=[1, 2 + number]), version, plan, most, requester)[
        0
    ]


def submit_map(store: Store, number: int, plan: Plan, requester: Requester = ANONYMOUS) -> Job:
    """Return the job of one of many maps."""
    request = UnfoldingMapsRequest(omega=[1, 2 + number], clearance=[1, 2])
    return submit(store, "unfolding-maps", request, "1", plan, requester=requester)[0]
