"""From a validated request to a job: limits, store, queue, and the time that a client waits.

The store decides whether a job is new. A job that could not be enqueued is not lost: the workers' reconciler finds it
in the ledger.
"""

from __future__ import annotations

import re
import time
from typing import Annotated

import anyio
import redis.exceptions
from fastapi import Depends, Header, Request
from pydantic import ValidationError
from starlette.responses import Response

from grazemap.wire import FINISHED, Job, ProcessRequest, Status, parse_request
from grazemap_service.dependencies import Context, CurrentContext
from grazemap_service.limits import checked_plan
from grazemap_service.links import job_path, with_links
from grazemap_service.logs import bind_job, get_logger
from grazemap_service.problems import ProblemException
from grazemap_worker.queue import entries

_WAIT = re.compile(r'(?:^|[,;\s])wait\s*=\s*"?(\d{1,9})"?(?=$|[,;\s])', re.IGNORECASE)


class Submission:
    """A POST that asks for a request to be computed."""

    def __init__(
        self,
        context: CurrentContext,
        request: Request,
        prefer: Annotated[
            str | None,
            Header(description="`wait=5` lets the answer wait up to 5 seconds (30 at most) for the end."),
        ] = None,
    ) -> None:
        self.context = context
        # the parameter is for the OpenAPI document, where a list would be a form of its own; the header may be repeated
        self.wait = _waiting_time(", ".join(request.headers.getlist("prefer")), context.settings.max_wait_seconds)

    async def post(self, process: str, request: ProcessRequest) -> Response:
        """Return 201 and the new job, or 200 and the one that is there already.

        Raises
        ------
        ProblemException
            The request is over a limit.
        QueueFull
            Too many tiles wait.
        """
        job, created = await self.context.ask(submit, self.context, process, request)
        headers = {}
        if self.wait is not None:
            job = await self._finished(job, self.wait)
            headers["Preference-Applied"] = f"wait={self.wait}"
        return job_response(job, 201 if created else 200, headers)

    async def _finished(self, job: Job, seconds: float) -> Job:
        """Return the job as it is at its end, or when the time is over."""
        deadline = time.monotonic() + seconds
        status: Status | None = job.status
        while status is not None and status not in FINISHED and time.monotonic() < deadline:
            await anyio.sleep(self.context.settings.poll_seconds)
            # the status alone: a question may be a megabyte long
            status = await self.context.ask(self.context.store.jobs.status, job.id)
        if status == job.status:
            return job
        return await self.context.ask(self.context.store.jobs.get, job.id) or job


NewSubmission = Annotated[Submission, Depends()]


def submit(context: Context, process: str, request: ProcessRequest) -> tuple[Job, bool]:
    """Start the job of a request; return it, and whether this call started it (blocking)."""
    settings = context.settings
    planned = checked_plan(process, request, settings)
    job, created = context.store.jobs.submit(
        process, request, context.core_version, planned, settings.max_pending_tiles
    )
    bind_job(job.id)
    if created:
        get_logger().info("job accepted", process=process, tiles=planned.count)
        _enqueue(context, job, planned.count)
    return job, created


def submit_again(context: Context, job: Job) -> Job:
    """Start the computation of a finished job's result again; return the job that computes it (blocking).

    The result was evicted, or it is of another version of the core: then the job is another one.

    Raises
    ------
    ProblemException
        "outdated-job": this version does not take the request any more.
    """
    try:
        request = parse_request(job.process, job.request or {})
    except (KeyError, ValidationError):
        raise ProblemException("outdated-job") from None
    again, _ = submit(context, job.process, request)
    if again.id != job.id:
        get_logger().info("result of another version computed anew", core_version=job.core_version, outdated_job=job.id)
    return again


def _enqueue(context: Context, job: Job, tiles: int) -> None:
    try:
        fingerprint = context.store.jobs.fingerprint_of(job.id)
        if fingerprint is not None:
            entries.enqueue(context.store.redis, job.id, range(tiles), fingerprint)
    except redis.exceptions.RedisError:
        # the job is recorded and a reconciler will enqueue it: this is no failure to the client
        get_logger().warning("job not enqueued, left to the reconciler", exc_info=True)


def job_response(job: Job, status: int, headers: dict[str, str] | None = None) -> Response:
    """Return a job as an answer; 201, 202 and 200 after a POST say where it is."""
    return Response(
        with_links(job).model_dump_json(exclude_none=False).encode(),
        status_code=status,
        media_type="application/json",
        headers={"Location": job_path(job.id), "Cache-Control": "no-store", **(headers or {})},
    )


def _waiting_time(prefer: str, most: float) -> int | None:
    """Return the seconds that a Prefer header (RFC 7240) asks to wait, at most the limit."""
    match = _WAIT.search(prefer)
    return min(int(match[1]), int(most)) if match else None
