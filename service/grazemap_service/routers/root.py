"""GET /v1: the service's versions, processes and limits."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from grazemap.version import __version__
from grazemap.wire import PROCESSES, Link
from grazemap_service.context import CurrentContext
from grazemap_service.jobs import PREFIX
from grazemap_service.middleware import GUIDE
from grazemap_service.routers import docs
from grazemap_worker.planning.limits import MAX_RESULT_BYTES
from grazemap_worker.planning.rates import MAX_TILE_SECONDS

router = APIRouter(tags=["operations"])


class ProcessDescription(BaseModel):
    """A process and the address to post requests to."""

    name: str
    description: str
    href: str


class Limits(BaseModel):
    """The maximum sizes that the service accepts."""

    body_bytes: int
    masses: int
    points: int
    pixels: int
    adaptive_pixels: int
    work_periods: float
    work_seconds: float
    single_tile_seconds: float
    result_bytes: int
    trajectory_periods: int
    pending_tiles: int
    wait_seconds: float


class ServiceDescription(BaseModel):
    """The answer of GET /v1."""

    name: str
    version: str
    core_version: str
    processes: list[ProcessDescription]
    limits: Limits
    links: list[Link]


@router.get("/v1", operation_id="get_service", summary="Versions, processes and limits")
@router.head("/v1", include_in_schema=False)
async def get_service(context: CurrentContext) -> ServiceDescription:
    """Describe the service."""
    settings = context.settings
    return ServiceDescription(
        name="grazemap",
        version=__version__,
        core_version=context.core_version,
        processes=[
            ProcessDescription(
                name=name, description=(model.__doc__ or "").strip().splitlines()[0], href=f"{PREFIX}/{name}"
            )
            for name, model in PROCESSES.items()
        ],
        limits=Limits(
            body_bytes=settings.max_body_bytes,
            masses=settings.max_masses,
            points=settings.max_points,
            pixels=settings.max_pixels,
            adaptive_pixels=settings.max_adaptive_pixels,
            work_periods=settings.max_work,
            work_seconds=settings.max_seconds,
            single_tile_seconds=min(settings.max_seconds, MAX_TILE_SECONDS),
            result_bytes=MAX_RESULT_BYTES,
            trajectory_periods=settings.max_tile_periods,
            pending_tiles=settings.max_pending_tiles,
            wait_seconds=settings.max_wait_seconds,
        ),
        links=[
            Link(href=f"{PREFIX}/jobs", rel="jobs"),
            Link(href="/docs", rel="service-doc", type="text/html"),
            *([Link(href=f"{GUIDE}/", rel="help", type="text/html")] if docs.GUIDE.is_built else []),
            Link(href="/openapi.json", rel="service-desc"),
        ],
    )
