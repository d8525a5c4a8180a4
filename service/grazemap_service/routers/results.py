"""Results: whole results, and finished tiles of a map that is still computed.

A client that has the result already gets 304. A request for a result that was evicted computes it again, and gets 202
and the job. If other numerics compute it, it has another ETag.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

from anyio.to_thread import run_sync
from fastapi import APIRouter, Header, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel

from grazemap.wire import FINISHED, Job, Link
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import CurrentRequester, KnownJob, job_path, job_response, submit_again
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import ProblemException, problem_response
from grazemap_service.representations import (
    MEDIA_TYPES,
    NPZ_TYPE,
    ResultResponse,
    cache_headers,
    is_fresh,
    negotiate,
    render,
)
from grazemap_service.result_schemas import RESULT, TILE, reference
from grazemap_worker.store import Requester, ResultInfo

router = APIRouter(tags=["results"])
# A result of at most so many bytes is read together with its size and entity tag.
_READ_AT_ONCE = 1 << 16

Form = Annotated[
    str | None,
    Query(
        alias="f",
        description="The form of the result; overrides Accept.",
        json_schema_extra={"enum": sorted(MEDIA_TYPES)},
    ),
]
# These are lists, because a header may have several lines (RFC 9110 5.3).
Accept = Annotated[list[str] | None, Header(include_in_schema=False)]
IfNoneMatch = Annotated[list[str] | None, Header(include_in_schema=False)]
_IF_NONE_MATCH = {
    "name": "if-none-match",
    "in": "header",
    "required": False,
    "schema": {"type": "string"},
    "description": "ETags that the client has.",
}
_BINARY = {"schema": {"type": "string", "format": "binary"}}


def _forms(name: str) -> dict[str, Any]:
    """Return the `content` of a response: JSON with the schema of a component, or npz."""
    return {"application/json": {"schema": reference(name)}, NPZ_TYPE: _BINARY}


class TileLink(BaseModel):
    """A finished tile: its rows (clearance) and columns (omega) in the map's grid, stops excluded."""

    index: int
    rows: tuple[int, int]
    columns: tuple[int, int]
    href: str


class TileIndex(BaseModel):
    """The finished tiles of a job."""

    total: int
    tiles: list[TileLink]
    links: list[Link]


_RESULT_DOCS: dict[str, Any] = {
    "response_class": Response,
    "openapi_extra": {"parameters": [_IF_NONE_MATCH]},
    "responses": {
        200: {"description": "The result.", "content": _forms(RESULT)},
        202: {"model": Job, "description": "The result was evicted, or is of another version: this job computes it."},
        304: {"description": "The client has it already."},
        **problem_responses("unknown-job", "not-acceptable", "unfinished-job", "dismissed-job", "outdated-job"),
    },
}


@router.get("/v1/jobs/{job_id}/result", operation_id="get_result", summary="Result of a job", **_RESULT_DOCS)
@router.head("/v1/jobs/{job_id}/result", include_in_schema=False, response_class=Response)
async def get_result(
    request: Request,
    job: KnownJob,
    context: CurrentContext,
    requester: CurrentRequester,
    form: Form = None,
    accept: Accept = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return the whole result; for a failed job, the problem that it failed with."""
    return await result_response(request, context, job, requester, form, if_none_match)


async def result_response(
    request: Request,
    context: Context,
    job: Job,
    requester: Requester,
    form: str | None = None,
    if_none_match: Sequence[str] | None = None,
) -> Response:
    """Return a response with the result of a job, in the form that the request accepts."""
    name = negotiate(", ".join(request.headers.getlist("accept")), form)
    if job.status == "failed" and job.problem is not None:
        return problem_response(job.problem)
    results = context.store.results
    finished = job.status == "successful"
    if finished and job.core_version != context.core_version:
        return await _computed_again(request, context, job, requester)
    info = await run_sync(results.info, job.id, _READ_AT_ONCE, limiter=context.threads) if finished else None
    # a job keeps the entity tag of an evicted result, so a client with a copy of it gets 304
    etag = info.etag if info is not None else await run_sync(results.etag, job.id, limiter=context.threads)
    headers = cache_headers(etag or "", name)
    if etag is not None and is_fresh(", ".join(if_none_match or ()), headers["ETag"]):
        return Response(status_code=304, headers=headers)
    if not finished:
        raise ProblemException("dismissed-job" if job.status in FINISHED else "unfinished-job")
    if info is None:
        return await _computed_again(request, context, job, requester)
    headers["Content-Disposition"] = f'attachment; filename="{job.process}-{job.id[:12]}.{name}"'
    if request.method == "HEAD":
        return _head(info, name, headers)
    if name == "npz" and info.data is not None:
        return Response(info.data, media_type=NPZ_TYPE, headers=headers)
    content = await context.renderings.give(headers["ETag"], name, info.size, lambda: info.data or results.data(job.id))
    if content is None:
        return await _computed_again(request, context, job, requester)
    return ResultResponse(content, context.renderings, name, headers)


@router.get(
    "/v1/jobs/{job_id}/result/tiles",
    operation_id="list_tiles",
    summary="Finished tiles of a job",
    responses=problem_responses("unknown-job"),
)
@router.head("/v1/jobs/{job_id}/result/tiles", include_in_schema=False)
async def list_tiles(job: KnownJob, context: CurrentContext) -> TileIndex:
    """List the finished tiles; a job of one tile has none, and those of an assembled map are soon removed."""
    finished = await run_sync(context.store.tiles.finished, job.id, limiter=context.threads)
    plan = await run_sync(context.store.jobs.plan_of, job.id, limiter=context.threads)
    if plan is None:
        raise ProblemException("unknown-job")
    path = f"{job_path(job.id)}/result/tiles"
    tiles = [TileLink(**plan.place(index), href=f"{path}/{index}") for index in finished]
    links = [Link(href=path, rel="self"), Link(href=job_path(job.id), rel="up")]
    return TileIndex(total=plan.count, tiles=tiles, links=links)


@router.get(
    "/v1/jobs/{job_id}/result/tiles/{index}",
    operation_id="get_tile",
    summary="One finished tile",
    response_class=Response,
    responses={
        200: {"description": "The tile's part of the arrays.", "content": _forms(TILE)},
        **problem_responses("unknown-job", "unfinished-tile", "not-acceptable", "outdated-job"),
    },
)
@router.head("/v1/jobs/{job_id}/result/tiles/{index}", include_in_schema=False, response_class=Response)
async def get_tile(
    job: KnownJob,
    context: CurrentContext,
    index: Annotated[str, Path(description="The tile's number.")],
    form: Form = None,
    accept: Accept = None,
) -> Response:
    """Return a finished tile."""
    name = negotiate(", ".join(accept or ()), form)
    if job.core_version != context.core_version:
        raise ProblemException("outdated-job")
    # the number of a tile has at most nine digits
    number = int(index) if index.isascii() and index.isdigit() and len(index) < 10 else -1
    npz = await run_sync(context.store.tiles.data, job.id, number, limiter=context.threads) if number >= 0 else None
    if npz is None:
        raise ProblemException("unfinished-tile")
    data = await run_in_threadpool(render, npz, name)
    return Response(data, media_type=MEDIA_TYPES[name], headers={"Vary": "Accept", "Cache-Control": "private"})


async def _computed_again(request: Request, context: Context, job: Job, requester: Requester) -> Response:
    """Return 202 and the job that computes a result again; a HEAD request starts no job."""
    if request.method == "HEAD":
        return Response(status_code=202, media_type="application/json", headers={"Cache-Control": "no-store"})
    return job_response(await run_sync(submit_again, context, job, requester, limiter=context.threads), 202)


def _head(info: ResultInfo, name: str, headers: dict[str, str]) -> Response:
    """Return the headers of the response to a GET; the length of JSON is left out, as it is not known in advance."""
    if name == "npz":
        headers = {**headers, "Content-Length": str(info.size)}
    response = Response(status_code=200, headers=headers, media_type=MEDIA_TYPES[name])
    if name != "npz":
        del response.headers["content-length"]
    return response
