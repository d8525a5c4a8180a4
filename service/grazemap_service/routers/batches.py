"""POST of many requests at once: each has its own job, and one response has all results, in the order of completion."""

from __future__ import annotations

import asyncio
import json
import time
from base64 import b64encode
from collections.abc import AsyncIterator, Iterable, Sequence
from typing import Annotated, Any, Literal

import redis.exceptions
from anyio.to_thread import run_sync
from fastapi import APIRouter, Body, Query, Request
from fastapi.responses import StreamingResponse
from pydantic import Field, ValidationError

from grazemap.constants import MAX_BATCH_REQUESTS
from grazemap.npz import unpacked_size
from grazemap.wire import FINISHED, PROCESSES, Job, ProblemError, parse_request, unstated
from grazemap.wire.base import Request as RequestBody
from grazemap.wire.error_details import MAX_ERRORS, errors_of
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import PREFIX, CurrentRequester, job_path, planned, start
from grazemap_service.openapi import SUBMISSION_KINDS, problem_responses
from grazemap_service.problems import ProblemException, answer_to
from grazemap_service.representations import LARGE_BYTES, LINES_TYPE, TEXT_TYPE, render
from grazemap_service.request_body import JsonRoute
from grazemap_worker.store import Requester, ResultInfo, Submission

# Number of requests that are submitted, or results that are read, at a time.
_AT_A_TIME = 25
# Seconds without an ended job after which all jobs are read, and an empty line keeps the connection open.
_LOOK_SECONDS = 5.0
# Seconds after which all jobs are read in any case, which renews the subscriptions to them.
_RENEW_SECONDS = 60.0

_EXAMPLE = {
    "requests": [
        {
            "process": "grazing-curves",
            "request": {"axis": {"vary": "omega", "values": {"start": 0.27, "stop": 0.28, "points": 10}}},
        },
        {"process": "periodic-orbits", "request": {"omega": 0.27, "clearance": 1.55}},
    ]
}

router = APIRouter(route_class=JsonRoute, tags=["processes"])


class BatchItem(RequestBody):
    """A request of a batch."""

    process: Annotated[str, Field(json_schema_extra={"enum": sorted(PROCESSES)}, max_length=64)]
    """Name of a process."""
    request: dict[str, Any]
    """The body as the route of the process takes it."""


class Batch(RequestBody):
    """Requests that are submitted together."""

    requests: Annotated[list[BatchItem], Field(min_length=1, max_length=MAX_BATCH_REQUESTS)]


Batch.build()  # as the requests of processes


@router.post(
    f"{PREFIX}/batches",
    operation_id="submit_batch",
    summary="Many requests at once",
    response_class=StreamingResponse,
    responses={
        200: {
            "description": "A line of JSON for each request, as soon as it is decided, in any order. `index` is the "
            "place of the request, and `notes` say what it leaves out, if anything. A job has `id`, `status`, and "
            "`result` or `npz` (base64); a result of more than a megabyte has `href` in their place. A failed job, "
            "and a request that was not accepted, have `problem`. Empty lines mean nothing.",
            "content": {LINES_TYPE: {"schema": {"type": "string"}}, TEXT_TYPE: {"schema": {"type": "string"}}},
        },
        **problem_responses(*(kind for kind in SUBMISSION_KINDS if kind != "queue-full")),
    },
)
async def post_batch(
    batch: Annotated[Batch, Body(openapi_examples={"a curve and an orbit": {"value": _EXAMPLE}})],
    request: Request,
    context: CurrentContext,
    requester: CurrentRequester,
    form: Annotated[Literal["json", "npz"], Query(alias="f", description="The form of the results.")] = "json",
) -> StreamingResponse:
    """Submit up to 1000 requests and stream their results; each has its own job, as if it were posted alone.

    If one of them is not valid, none is submitted. The jobs continue when the connection ends: post the batch again.
    """
    submissions = await run_sync(_checked, context, batch)
    heads = await run_sync(_heads, submissions)
    lines = _answers(request, context, requester, submissions, heads, form)
    media_type = TEXT_TYPE if request.headers.get("accept", "").startswith(TEXT_TYPE) else LINES_TYPE
    return StreamingResponse(lines, media_type=media_type, headers={"Cache-Control": "no-store", "Vary": "Accept"})


def _checked(context: Context, batch: Batch) -> list[Submission]:
    """Return the requests with their plans. Raises ProblemException; its pointers lead into the batch."""
    submissions: list[Submission] = []
    errors: list[ProblemError] = []
    for index, item in enumerate(batch.requests):
        path = f"/requests/{index}"
        model = PROCESSES.get(item.process)
        if model is None:
            names = ", ".join(sorted(PROCESSES))
            errors.append(ProblemError(pointer=f"{path}/process", detail="There is no such process", allowed=names))
        else:
            try:
                submissions.append(planned(context, item.process, parse_request(item.process, item.request)))
            except ValidationError as error:
                details = [{**detail, "loc": ("body", *detail["loc"])} for detail in error.errors(include_url=False)]
                errors += _with_path(path, errors_of(details))
            except ProblemException as error:
                error.problem = error.problem.model_copy(update={"errors": _with_path(path, error.problem.errors)})
                raise
        if len(errors) >= MAX_ERRORS:
            break
    if errors:
        raise ProblemException("invalid-request", errors=errors[:MAX_ERRORS])
    return submissions


def _heads(submissions: Sequence[Submission]) -> list[bytes]:
    """Return the first JSON members of the line of each request: its place, and the notes on what it leaves out."""
    heads: list[dict[str, Any]] = []
    for index, submission in enumerate(submissions):
        notes = [note.model_dump() for note in unstated(submission.request)]
        heads.append({"index": index, "notes": notes} if notes else {"index": index})
    return [json.dumps(head, separators=(",", ":")).encode()[1:-1] for head in heads]


def _with_path(path: str, errors: Sequence[ProblemError]) -> list[ProblemError]:
    return [error.model_copy(update={"pointer": f"{path}/request{error.pointer}"}) for error in errors]


async def _answers(
    request: Request,
    context: Context,
    requester: Requester,
    submissions: Sequence[Submission],
    heads: Sequence[bytes],
    form: str,
) -> AsyncIterator[bytes]:
    """Yield the lines of the response, one for each request, which begin with its head."""
    waiting: dict[str, list[int]] = {}
    with context.hub.listen_to_ends() as ended:
        for first in range(0, len(submissions), _AT_A_TIME):
            part = range(first, min(first + _AT_A_TIME, len(submissions)))
            some = [submissions[index] for index in part]
            jobs = await run_sync(_submit, context, requester, some, limiter=context.threads)
            decided: dict[str, None] = {}
            for index, job in zip(part, jobs, strict=True):
                if isinstance(job, Exception):
                    problem = bytes((await answer_to(request, job)).body)
                    yield b'{%s,"problem":%s}\n' % (heads[index], problem)
                else:
                    waiting.setdefault(job.id, []).append(index)
                    if job.status in FINISHED:
                        decided[job.id] = None
            while not ended.empty():
                decided[ended.get_nowait() or ""] = None
            async for lines in _lines(context, requester, decided, waiting, heads, form):
                yield lines
        looked = time.monotonic()
        while waiting:
            news: list[str | None] = []
            try:
                news.append(await asyncio.wait_for(ended.get(), _LOOK_SECONDS))
            except TimeoutError:
                news.append(None)
                yield b"\n"
            while not ended.empty():
                news.append(ended.get_nowait())
            if None in news or time.monotonic() - looked > _RENEW_SECONDS:
                looked, news = time.monotonic(), [*waiting]
            async for lines in _lines(context, requester, [job_id for job_id in news if job_id], waiting, heads, form):
                yield lines


def _submit(context: Context, requester: Requester, submissions: Sequence[Submission]) -> list[Job | Exception]:
    """Return for each request its job, or the error if it was not accepted (blocking)."""
    try:
        outcomes = start(context, submissions, requester)
    except redis.exceptions.RedisError as error:
        return [error] * len(submissions)
    return [outcome if isinstance(outcome, Exception) else outcome[0] for outcome in outcomes]


async def _lines(
    context: Context,
    requester: Requester,
    decided: Iterable[str],
    waiting: dict[str, list[int]],
    heads: Sequence[bytes],
    form: str,
) -> AsyncIterator[bytes]:
    """Yield the lines of ended jobs, several at a time, and remove these jobs from `waiting`."""
    ids = [job_id for job_id in dict.fromkeys(decided) if job_id in waiting]
    for first in range(0, len(ids), _AT_A_TIME):
        part = ids[first : first + _AT_A_TIME]
        try:
            answers = await run_sync(_read, context, requester, part, form, limiter=context.threads)
        except redis.exceptions.RedisError:  # these jobs are read again later
            continue
        lines: list[bytes] = []
        for job_id, answer in zip(part, answers, strict=True):
            if answer is not None:
                lines += (b"{%s,%s}\n" % (heads[index], answer) for index in waiting.pop(job_id))
            if sum(map(len, lines)) > LARGE_BYTES:
                yield b"".join(lines)
                lines = []
        if lines:
            yield b"".join(lines)


def _read(context: Context, requester: Requester, ids: Sequence[str], form: str) -> list[bytes | None]:
    """Return the JSON members of the line of each job; None for a job that has not ended (blocking)."""
    infos = context.store.results.each_info(ids, LARGE_BYTES)
    return [_members(context, requester, job_id, info, form) for job_id, info in zip(ids, infos, strict=True)]


def _inline(info: ResultInfo | None, form: str) -> bytes | None:
    """Return the npz of a result that is sent in its line; None where the line says where it is."""
    if info is None or info.data is None or (form == "json" and unpacked_size(info.data) > LARGE_BYTES):
        return None
    return info.data


def _members(context: Context, requester: Requester, job_id: str, info: ResultInfo | None, form: str) -> bytes | None:
    job = None
    inline = _inline(info, form)
    if inline is None:
        job = context.store.jobs.get(job_id, requester.name, with_request=False)
        if job is None:
            return b'"id":"%s","status":"dismissed"' % job_id.encode()
        if job.status not in FINISHED:
            return None
        if info is None and job.status == "successful":  # the job has just ended, or its result was evicted
            (info,) = context.store.results.each_info([job_id], LARGE_BYTES)
            inline = _inline(info, form)
    if inline is not None:
        result = b'"npz":"%s"' % b64encode(inline) if form == "npz" else b'"result":' + render(inline, "json")
        return b'"id":"%s","status":"successful",%s' % (job_id.encode(), result)
    assert job is not None
    head: dict[str, Any] = {"id": job.id, "status": job.status}
    if job.status == "successful":
        head["href"] = f"{job_path(job_id)}/result{'?f=npz' if form == 'npz' else ''}"
    elif job.problem is not None:
        head["problem"] = job.problem.model_dump(mode="json")
    return json.dumps(head).encode()[1:-1]
