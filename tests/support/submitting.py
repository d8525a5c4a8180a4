"""One request, submitted to a store as the service does."""

from __future__ import annotations

from grazemap.wire import Job, ProcessRequest
from grazemap_worker.planning import Plan
from grazemap_worker.processes import kernels_of
from grazemap_worker.store import ANYBODY, Asker, Bell, Store, Submission


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
