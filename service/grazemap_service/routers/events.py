"""A job's events as server-sent events, resumable by Last-Event-ID; the stream ends after `done`."""

from __future__ import annotations

import re
from collections.abc import AsyncIterator
from typing import Annotated

import anyio
import redis.exceptions
import structlog
from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Header, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent

from grazemap.wire import FINISHED
from grazemap_service.context import CurrentContext
from grazemap_service.jobs import KnownJob
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import invalid

_BEGINNING = "0"
# at most 19 digits, which Redis always accepts
_EVENT_ID = re.compile(r"\d{1,19}(?:-\d{1,19})?", re.ASCII)
# Seconds between attempts while the store is unavailable.
_AWAY_SECONDS = 1.0
# Seconds between looks at what a job waits for.
_WAITING_EVERY = 1.0

router = APIRouter(tags=["jobs"])


def resume_point(
    last_event_id: Annotated[
        str | None, Header(description="The id of the last event that arrived; the stream continues after it.")
    ] = None,
) -> str:
    """Return the id after which the stream continues. Raises ProblemException if it is not an event's id."""
    if not last_event_id:
        return _BEGINNING
    if not _EVENT_ID.fullmatch(last_event_id):
        raise invalid("?last-event-id", "Not the id of an event", "an id of this stream")
    return last_event_id


@router.head("/v1/jobs/{job_id}/events", include_in_schema=False)
async def look_at_events(job: KnownJob, after: Annotated[str, Depends(resume_point)]) -> Response:
    """Return the headers of a stream, without starting it."""
    return Response(media_type="text/event-stream")


@router.get(
    "/v1/jobs/{job_id}/events",
    operation_id="get_events",
    summary="Events of a job",
    response_class=EventSourceResponse,
    responses={
        200: {"description": "Events `progress`, `waiting`, `tile` and `done`, their data JSON objects."},
        **problem_responses("unknown-job", "invalid-request"),
    },
)
async def get_events(
    job: KnownJob, context: CurrentContext, after: Annotated[str, Depends(resume_point)]
) -> AsyncIterator[ServerSentEvent]:
    """Stream the events of a job to its end, from its beginning or after the last event that arrived."""
    store, pause = context.store, context.settings.poll_seconds
    ending = False
    waiting_for, looked = None, 0.0
    while True:
        try:
            # the status is read before the events, so that these include the event of an end that is seen here
            status = await run_sync(store.jobs.status, job.id, limiter=context.threads)
            events = await run_sync(store.jobs.events, job.id, after, limiter=context.threads)
            said = waiting_for
            if not events and anyio.current_time() - looked >= _WAITING_EVERY:
                said = await run_sync(store.jobs.waiting_for, job.id, limiter=context.threads)
                looked = anyio.current_time()
        except redis.exceptions.RedisError:
            structlog.get_logger("grazemap_service").warning("events wait for the store", exc_info=True)
            await anyio.sleep(_AWAY_SECONDS)
            continue
        for event in events:
            yield ServerSentEvent(event=event.name, id=event.id, data=event.data)
            after = event.id
            if event.name == "done":
                return
        if events:
            continue
        if status is None or status in FINISHED:
            if ending:
                # resumed after the last event, or the events were removed: the end is sent anyway
                yield ServerSentEvent(event="done", data={"status": status or "dismissed"})
                return
            ending = True
            continue
        ending = False
        if said != waiting_for:
            # without an id, as it is not stored: the stream is resumed after the last event that is
            yield ServerSentEvent(event="waiting", data={"waiting_for": said})
            waiting_for = said
        await anyio.sleep(pause)
