"""Results: whole results, and finished tiles of a job that is still being computed.

A client that has the result already gets 304. If the result was evicted, or if another version of the core computed it,
a GET starts a job, and is answered with 202 and that job. If the result is computed again with other numerics, for
example with another numpy, its ETag changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Annotated, Any

from anyio.to_thread import run_sync
from fastapi import APIRouter, Header, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel

from grazemap.constants import PICTURE_FILES, PICTURE_STYLES, TABLE_FILES, PictureStyle
from grazemap.wire import FINISHED, Job, Link
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import CurrentRequester, KnownJob, job_path, job_response, submit_again
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import ProblemException, problem_response
from grazemap_service.rendered import RENDERED_TYPES
from grazemap_service.representations import (
    MEDIA_TYPES,
    NPZ_TYPE,
    RESULT_TYPES,
    ResultResponse,
    cache_headers,
    is_fresh,
    negotiate,
    render,
)
from grazemap_service.result_schemas import RESULT, TILE, reference
from grazemap_worker.store import Requester, ResultInfo

router = APIRouter(tags=["results"])
# Results of up to this many bytes are read in the same call as their size and digest.
_READ_AT_ONCE = 1 << 16


def _form(description: str, forms: Iterable[str]) -> Any:
    """Return the query parameter of the form of an answer."""
    return Query(alias="f", description=description, json_schema_extra={"enum": sorted(forms)})


TileForm = Annotated[str | None, _form("The form of the tile; overrides Accept.", MEDIA_TYPES)]
ResultForm = Annotated[
    str | None,
    _form("The form of the result: all of it (json, npz), a table, or a picture; overrides Accept.", RESULT_TYPES),
]
Table = Annotated[
    str,
    Query(
        max_length=64,
        pattern="^[a-z_]*$",
        description="The table, for csv, parquet and xlsx. Without it: the points of a map, of basins or of "
        "bifurcation curves, or else the arrays of the result; all tables in xlsx.",
    ),
]
Style = Annotated[
    PictureStyle,
    Query(description="The style of a picture, for pdf, png and svg: column is 3.4 inches wide, for a journal."),
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


def _content(component: str) -> dict[str, Any]:
    """Return the `content` of a response: JSON with the schema of a component, or npz."""
    return {"application/json": {"schema": reference(component)}, NPZ_TYPE: _BINARY}


class TileLink(BaseModel):
    """A finished tile: half-open ranges of rows and columns in the grid; [0, 16] is 0 to 15.

    The rows of a map are the values of its vertical axis, the columns those of its horizontal axis.
    """

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
        200: {
            "description": "The result.",
            "content": _content(RESULT) | dict.fromkeys(RENDERED_TYPES.values(), _BINARY),
        },
        202: {"model": Job, "description": "The result was evicted, or is of another version: this job computes it."},
        304: {"description": "The client already has this result (If-None-Match)."},
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
    requested_form: ResultForm = None,
    table: Table = "",
    style: Style = PICTURE_STYLES[0],
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return the whole result, a table or a picture of it; for a failed job, the problem that it failed with."""
    return await result_response(request, context, job, requester, requested_form, if_none_match, table, style)


async def result_response(
    request: Request,
    context: Context,
    job: Job,
    requester: Requester,
    requested_form: str | None = None,
    if_none_match: Sequence[str] | None = None,
    table: str = "",
    style: PictureStyle = PICTURE_STYLES[0],
) -> Response:
    """Return a response with the result of a job, in the form that the request accepts."""
    form = negotiate(", ".join(request.headers.getlist("accept")), requested_form, RESULT_TYPES)
    if job.status == "failed" and job.problem is not None:
        return problem_response(job.problem)
    results = context.store.results
    finished = job.status == "successful"
    if finished and job.core_version != context.core_version:
        return await _recompute(request, context, job, requester)
    info = await run_sync(results.info, job.id, _READ_AT_ONCE, limiter=context.threads) if finished else None
    # The digest of an evicted result is kept with its job, so a client that has a copy of the result still gets 304.
    etag = info.etag if info is not None else await run_sync(results.etag, job.id, limiter=context.threads)
    is_styled = f".{form}" in PICTURE_FILES and style != PICTURE_STYLES[0]
    variant = style if is_styled else table if f".{form}" in TABLE_FILES else ""
    headers = cache_headers(etag or "", form, variant)
    if etag is not None and is_fresh(", ".join(if_none_match or ()), headers["ETag"]):
        return Response(status_code=304, headers=headers)
    if not finished:
        raise ProblemException("dismissed-job" if job.status in FINISHED else "unfinished-job")
    if info is None:
        return await _recompute(request, context, job, requester)
    headers["Content-Disposition"] = f'attachment; filename="{job.process}-{job.id[:12]}.{form}"'
    if request.method == "HEAD":
        return _head(info, form, headers)
    if form == "npz" and info.data is not None:
        return Response(info.data, media_type=NPZ_TYPE, headers=headers)
    representation = await context.representations.acquire(
        headers["ETag"], form, info.size, lambda: info.data or results.data(job.id, info.etag), variant
    )
    if representation is None:
        return await _recompute(request, context, job, requester)
    return ResultResponse(representation, context.representations, form, headers)


@router.get(
    "/v1/jobs/{job_id}/result/tiles",
    operation_id="list_tiles",
    summary="Finished tiles of a job",
    responses=problem_responses("unknown-job"),
)
@router.head("/v1/jobs/{job_id}/result/tiles", include_in_schema=False)
async def list_tiles(job: KnownJob, context: CurrentContext) -> TileIndex:
    """List the finished tiles.

    The list is empty for a job with one tile. Soon after all tiles were joined, they are removed, and the list is empty
    too.
    """
    finished = await run_sync(context.store.tiles.finished, job.id, limiter=context.threads)
    plan = await run_sync(context.store.jobs.plan_of, job.id, limiter=context.threads)
    if plan is None:
        raise ProblemException("unknown-job")
    path = f"{job_path(job.id)}/result/tiles"
    tiles = [TileLink(**plan.place(index), href=f"{path}/{index}") for index in finished]
    links = [Link(href=path, rel="self"), Link(href=job_path(job.id), rel="up")]
    return TileIndex(total=plan.tile_count, tiles=tiles, links=links)


@router.get(
    "/v1/jobs/{job_id}/result/tiles/{index}",
    operation_id="get_tile",
    summary="One finished tile",
    response_class=Response,
    responses={
        200: {"description": "The tile's part of the arrays.", "content": _content(TILE)},
        **problem_responses("unknown-job", "unfinished-tile", "not-acceptable", "outdated-job"),
    },
)
@router.head("/v1/jobs/{job_id}/result/tiles/{index}", include_in_schema=False, response_class=Response)
async def get_tile(
    job: KnownJob,
    context: CurrentContext,
    index: Annotated[str, Path(description="The tile's number.")],
    requested_form: TileForm = None,
    accept: Accept = None,
) -> Response:
    """Return a finished tile."""
    form = negotiate(", ".join(accept or ()), requested_form)
    if job.core_version != context.core_version:
        raise ProblemException("outdated-job")
    # the number of a tile has at most nine digits
    number = int(index) if index.isascii() and index.isdigit() and len(index) < 10 else -1
    npz = await run_sync(context.store.tiles.data, job.id, number, limiter=context.threads) if number >= 0 else None
    if npz is None:
        raise ProblemException("unfinished-tile")
    data = await run_in_threadpool(render, npz, form)
    return Response(data, media_type=MEDIA_TYPES[form], headers={"Vary": "Accept", "Cache-Control": "private"})


async def _recompute(request: Request, context: Context, job: Job, requester: Requester) -> Response:
    """Return 202 and the job that computes a result again; a HEAD request starts no job."""
    if request.method == "HEAD":
        return Response(status_code=202, media_type="application/json", headers={"Cache-Control": "no-store"})
    return job_response(await run_sync(submit_again, context, job, requester, limiter=context.threads), 202)


def _head(info: ResultInfo, form: str, headers: dict[str, str]) -> Response:
    """Return the headers of the response to a GET; the length of JSON is left out, as it is not known in advance."""
    if form == "npz":
        headers = {**headers, "Content-Length": str(info.size)}
    response = Response(status_code=200, headers=headers, media_type=RESULT_TYPES[form])
    if form != "npz":
        del response.headers["content-length"]
    return response
