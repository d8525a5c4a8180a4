"""Health of the process, readiness for jobs, and metrics: /healthz, /readyz, /metrics."""

from __future__ import annotations

from anyio.to_thread import run_sync
from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST
from pydantic import BaseModel

from grazemap_service.context import CurrentContext
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import ProblemException

# A worker's first start compiles for some seconds.
_RETRY_SECONDS = 2

router = APIRouter(tags=["operations"])


class Health(BaseModel):
    """The service answers."""

    status: str = "ok"


class Readiness(BaseModel):
    """Jobs will be computed."""

    status: str = "ready"
    workers: int


@router.get("/healthz", operation_id="get_health", summary="Liveness")
@router.head("/healthz", include_in_schema=False)
async def get_health() -> Health:
    """Answer 200 as long as the process runs, also without Redis or workers."""
    return Health()


@router.get(
    "/readyz",
    operation_id="get_readiness",
    summary="Readiness",
    responses=problem_responses("store-unavailable", "not-ready"),
)
@router.head("/readyz", include_in_schema=False)
async def get_readiness(context: CurrentContext) -> Readiness:
    """Answer 200 when Redis answers and at least one worker of this release is alive."""
    live = await run_sync(context.store.workers.live, limiter=context.threads)
    workers = [worker for worker in live if worker.core_version == context.core_version]
    if not workers:
        starting = await run_sync(context.store.workers.starting, limiter=context.threads)
        detail = f"{starting[0].upper()}{starting[1:]}." if starting else ""
        raise ProblemException("not-ready", detail, headers={"Retry-After": str(_RETRY_SECONDS)})
    return Readiness(workers=len(workers))


@router.get(
    "/metrics",
    operation_id="get_metrics",
    summary="Prometheus metrics",
    response_class=Response,
    responses={200: {"description": "Prometheus text format.", "content": {"text/plain": {}}}},
)
@router.head("/metrics", include_in_schema=False)
def get_metrics(context: CurrentContext) -> Response:
    """Return requests, latencies, jobs by status, unfinished tiles and live workers."""
    return Response(context.metrics.render(), headers={"Content-Type": CONTENT_TYPE_LATEST})
