"""Jobs for routes: reads the job that a path names, starts the job of a request, and makes a job an answer.

>>> job, is_new = submit(context, "unfolding-maps", request, requester)
>>> job.status, is_new  # the same request, posted before, has the same job
('accepted', False)

The store decides whether a job is new.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

import redis.exceptions
import structlog
from anyio.to_thread import run_sync
from fastapi import Depends, Header, Path
from pydantic import ValidationError
from starlette.responses import Response

from grazemap.wire import FINISHED, Job, Link, Note, ProcessRequest, notes_on, parse_request
from grazemap_service.context import Context, CurrentContext, CurrentKey
from grazemap_service.limits import checked_plan
from grazemap_service.problems import ProblemException, invalid
from grazemap_service.representations import MEDIA_TYPES
from grazemap_worker.processes import kernels_of
from grazemap_worker.queue import wake_ups
from grazemap_worker.store import ANONYMOUS, BacklogFull, Requester, Submission, WaitingJob, WorkerQueue

PREFIX = "/v1"
# The relation of OGC API - Processes for a job's results.
RESULTS_RELATION = "http://www.opengis.net/def/rel/ogc/1.0/results"
NAME = "^[A-Za-z0-9._-]+$"
_JOB_ID = re.compile(r"[0-9a-f]{64}")
# The notes on requests, by the ids of their jobs.
_NOTES: dict[str, list[Note]] = {}
_MAX_NOTES = 10_000
_log = structlog.get_logger("grazemap_service")


async def current_requester(
    key: CurrentKey,
    client: Annotated[
        str | None,
        Header(
            alias="Grazemap-Client",
            max_length=64,
            pattern=NAME,
            description="Who asks, where there are no keys: each has its share of the workers.",
        ),
    ] = None,
    group: Annotated[
        str | None,
        Header(
            alias="Grazemap-Group",
            max_length=64,
            pattern=NAME,
            description="A name for a group of jobs, which lists of jobs can select. No part of a job's id.",
        ),
    ] = None,
    priority: Annotated[
        str | None,
        Header(
            json_schema_extra={"pattern": "^([0-9]|(u=|i).*)$"},
            description="0 to 9, 5 when left out: each step doubles the share of a new job. No part of its id. What "
            "browsers send (RFC 9218) is ignored.",
        ),
    ] = None,
) -> Requester:
    """Return the requester, with priority and group. Raises ProblemException if the priority is not valid."""
    if priority is None or priority.lstrip().startswith(("u=", "i")):
        level = ANONYMOUS.priority
    elif re.fullmatch("[0-9]", priority):
        level = int(priority)
    else:
        raise invalid("?priority", "Not a priority", "0 to 9")
    if key is not None:
        return Requester(f"key:{key.name}", level, key.weight, key.quota, group or "")
    return Requester(name=f"client:{client}" if client else ANONYMOUS.name, priority=level, group=group or "")


CurrentRequester = Annotated[Requester, Depends(current_requester)]


async def known_job(
    job_id: Annotated[str, Path(description="The job's id: 64 hexadecimal digits.")],
    context: CurrentContext,
    requester: CurrentRequester,
) -> Job:
    """Return the job that the path names. Raises ProblemException "unknown-job"."""
    job = None
    if _JOB_ID.fullmatch(job_id):
        job = await run_sync(stored_job, context, job_id, requester.name, limiter=context.threads)
    if job is None:
        raise ProblemException("unknown-job")
    structlog.contextvars.bind_contextvars(job_id=job.id)
    return job


def stored_job(context: Context, job_id: str, requester: str = "") -> Job | None:
    """Return a job with the notes on its request, or None if there is none with this id (blocking)."""
    job = context.store.jobs.get(job_id, requester)
    return None if job is None else _with_notes(job)


def _with_notes(job: Job, request: ProcessRequest | None = None) -> Job:
    """Return the job with the notes on its request (blocking: with many masses, making them takes up to 50 ms)."""
    notes = _NOTES.get(job.id)
    if notes is None:
        try:
            notes = notes_on(request or parse_request(job.process, job.request or {}))
        except (KeyError, ValidationError):  # an older version accepted the request
            notes = []
        if len(_NOTES) >= _MAX_NOTES:
            _NOTES.clear()
        _NOTES[job.id] = notes
    return job.model_copy(update={"notes": notes})


KnownJob = Annotated[Job, Depends(known_job)]


def submit(context: Context, process: str, request: ProcessRequest, requester: Requester) -> tuple[Job, bool]:
    """Start the job of a request; return the job, and whether this call started it (blocking).

    Raises
    ------
    ProblemException
        The request exceeds a limit.
    BacklogFull
        There are too many unfinished tiles.
    """
    outcome = start(context, [planned(context, process, request)], requester)[0]
    if isinstance(outcome, Exception):
        raise outcome
    job, is_new = outcome
    structlog.contextvars.bind_contextvars(job_id=job.id)
    return _with_notes(job, request), is_new


def planned(context: Context, process: str, request: ProcessRequest) -> Submission:
    """Return a request with its plan and the name of the kernels (compiled code) it needs. Raises ProblemException."""
    plan = checked_plan(process, request, context.settings)
    return Submission(process, request, plan, kernels_of(process, request))


def start(
    context: Context, submissions: Sequence[Submission], requester: Requester
) -> list[tuple[Job, bool] | BacklogFull | redis.exceptions.RedisError]:
    """Start the jobs of requests (blocking).

    Returns for each request its job, without notes, and whether the job was started, or the error of `submit`.
    """
    settings = context.settings
    outcomes = context.store.jobs.submit(
        submissions, context.core_version, settings.max_pending_tiles, requester, settings.max_seconds
    )
    started: list[tuple[Job, bool] | BacklogFull | redis.exceptions.RedisError] = []
    queues: dict[WorkerQueue, WaitingJob] = {}
    for submission, outcome in zip(submissions, outcomes, strict=True):
        if isinstance(outcome, Exception):
            started.append(outcome)
            continue
        job, queue = outcome
        started.append((job, queue is not None))
        if queue is not None:
            # one wake-up for each queue is enough: the worker claims tiles of any job, and wakes the next worker
            queues[queue] = WaitingJob(submission.process, job.id)
            _log.info("job accepted", job_id=job.id, process=submission.process, tiles=submission.plan.tile_count)
    for queue, waiting in queues.items():
        _wake_worker(context, queue, waiting)
    return started


def submit_again(context: Context, job: Job, requester: Requester) -> Job:
    """Submit the request of a finished job again; return the job that computes it (blocking).

    The result of the finished job was evicted, or is of another version of the core. In the second case another job
    computes the request.

    Raises
    ------
    ProblemException
        "outdated-job": this version does not accept the request any more.
    """
    try:
        request = parse_request(job.process, job.request or {})
    except (KeyError, ValidationError):
        raise ProblemException("outdated-job") from None
    again, _ = submit(context, job.process, request, requester)
    if again.id != job.id:
        _log.info("result of another version computed anew", core_version=job.core_version, outdated_job=job.id)
    return again


def _wake_worker(context: Context, queue: WorkerQueue, job: WaitingJob) -> None:
    """Wake a worker of a queue for a job (blocking).

    If no worker is alive, or Redis is unavailable, a reconciler does so later.
    """
    if queue.fingerprint:
        try:
            wake_ups.wake_worker(context.store.redis, queue.fingerprint, job, small=queue.small)
        except redis.exceptions.RedisError:
            _log.warning("no worker woken, left to the reconciler", exc_info=True)


def job_path(job_id: str) -> str:
    """Return the path of a job."""
    return f"{PREFIX}/jobs/{job_id}"


def with_links(job: Job) -> Job:
    """Return the job with the links that are valid in its present state."""
    path = job_path(job.id)
    links = [
        Link(href=path, rel="self"),
        Link(href=f"{path}/events", rel="monitor", type="text/event-stream"),
        Link(href=f"{path}/result/tiles", rel="tiles"),
    ]
    if job.status == "successful":
        links += [
            Link(href=f"{path}/result?f={form}", rel=RESULTS_RELATION, type=media_type)
            for form, media_type in MEDIA_TYPES.items()
        ]
    if job.status not in FINISHED:
        links.append(Link(href=path, rel="cancel"))
    return job.model_copy(update={"links": links})


def job_response(job: Job, status: int) -> Response:
    """Return a job as an answer, with its address as Location."""
    return Response(
        with_links(job).model_dump_json(exclude_none=False).encode(),
        status_code=status,
        media_type="application/json",
        headers={"Location": job_path(job.id), "Cache-Control": "no-store"},
    )
