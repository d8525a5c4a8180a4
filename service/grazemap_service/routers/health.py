"""Health of the process, readiness for jobs, status and metrics: /healthz, /readyz, /v1/status, /metrics."""

from __future__ import annotations

import redis.exceptions
from anyio.to_thread import run_sync
from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel, Field

from grazemap.version import __version__
from grazemap.wire import ServiceStatus
from grazemap.wire.problems import make_problem
from grazemap_service.context import Context, CurrentContext
from grazemap_service.metrics import with_zeros
from grazemap_service.openapi import problem_responses
from grazemap_worker.store import is_full
from grazemap_worker.system import not_kept

router = APIRouter(tags=["operations"])


class Health(BaseModel):
    """The service answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """Requests are taken, and stored results are served; new results are computed when there are workers."""

    status: str = "ready"
    workers: int = Field(description="Live workers of this release, without those for small tiles alone.")
    detail: str = Field(default="", description="Why no worker computes yet; empty while one is alive.")
    not_kept: list[str] = Field(
        default_factory=not_kept, description="Limits that the system of the service cannot keep; empty on Linux."
    )


@router.get("/healthz", operation_id="get_health", summary="Liveness")
@router.head("/healthz", include_in_schema=False)
async def get_health() -> Health:
    """Answer 200 as long as the process runs, also without Redis or workers."""
    return Health()


@router.get(
    "/readyz",
    operation_id="get_readiness",
    summary="Readiness",
    responses=problem_responses("store-unavailable", "storage-full"),
)
@router.head("/readyz", include_in_schema=False)
async def get_readiness(context: CurrentContext) -> Readiness:
    """Answer 200 when Redis takes a write; `workers` says how many workers are alive."""
    return await run_sync(_readiness, context, limiter=context.threads)


def _readiness(context: Context) -> Readiness:
    """Write to the store; return the number of live workers, or what starting workers do (blocking)."""
    context.store.try_write()
    live = [worker for worker in context.store.workers.live() if worker.core_version == context.core_version]
    count = sum(not worker.small for worker in live)
    if count:
        return Readiness(workers=count)
    starting = context.store.workers.starting()
    if starting:
        return Readiness(workers=0, detail=f"{starting[0].upper()}{starting[1:]}.")
    return Readiness(
        workers=0, detail="Only workers for small tiles are alive yet." if live else "No worker is alive yet."
    )


@router.get(
    "/v1/status",
    operation_id="get_status",
    summary="What the service does",
    responses=problem_responses("store-unavailable"),
)
@router.head("/v1/status", include_in_schema=False)
async def get_status(context: CurrentContext) -> ServiceStatus:
    """Return what the workers do, what waits, what is stored, and what has failed."""
    return await run_sync(_status, context, limiter=context.threads)


def _status(context: Context) -> ServiceStatus:
    counts = context.store.counts()
    ready = True
    try:
        detail = _readiness(context).detail
    except redis.exceptions.RedisError as error:
        if not is_full(error):
            raise
        ready, detail = False, make_problem("storage-full").detail
    return ServiceStatus(
        version=__version__,
        ready=ready,
        detail=detail,
        workers=counts.workers,
        jobs=counts.jobs,
        pending_tiles=counts.pending_tiles,
        waiting=counts.waiting,
        claimed_seconds=counts.claimed_seconds,
        stored_bytes=counts.bytes,
        budget_bytes=counts.budget,
        events=with_zeros(counts.events),
    )


@router.get(
    "/metrics",
    operation_id="get_metrics",
    summary="Prometheus metrics",
    response_class=Response,
    responses={200: {"description": "Prometheus text format.", "content": {"text/plain": {}}}},
)
@router.head("/metrics", include_in_schema=False)
def get_metrics(context: CurrentContext) -> Response:
    """Return requests and latencies, what the store holds and does, what waits, and what has failed."""
    return Response(context.metrics.render(), headers={"Content-Type": CONTENT_TYPE_LATEST})
