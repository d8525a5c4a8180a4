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
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import CurrentAsker, KnownJob
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import invalid

_BEGINNING = "0"
# at most 19 digits, which Redis always accepts
_EVENT_ID = re.compile(r"\d{1,19}(?:-\d{1,19})?", re.ASCII)
# Seconds between attempts while the store is unavailable.
_AWAY_SECONDS = 1.0
# Seconds without events after which the store is looked at: at what the job waits for, and for events that were missed.
_LOOK_SECONDS = 2.0

router = APIRouter(tags=["jobs"])


def resume_point(
    last_event_id: Annotated[
        str | None,
        Header(
            description="The id of the last event that arrived; the stream continues after it.",
            json_schema_extra={"pattern": "^([0-9]{1,19}(-[0-9]{1,19})?)?$"},
        ),
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
    job: KnownJob, context: CurrentContext, asker: CurrentAsker, after: Annotated[str, Depends(resume_point)]
) -> AsyncIterator[ServerSentEvent]:
    """Stream the events of a job to its end, from its beginning or after the last event that arrived."""
    store = context.store
    waiting_for = None
    with context.hub.listen(job.id) as listener:
        while True:
            try:
                # the status is read before the events, so that these include the event of an end that is seen here
                status = await run_sync(store.jobs.status, job.id, limiter=context.threads)
                stored = await run_sync(store.jobs.events, job.id, after, limiter=context.threads)
                said = await run_sync(_waiting_for, context, job.id, asker.name, limiter=context.threads)
            except redis.exceptions.RedisError:
                structlog.get_logger("grazemap_service").warning("events wait for the store", exc_info=True)
                await anyio.sleep(_AWAY_SECONDS)
                continue
            for event in stored:
                yield ServerSentEvent(event=event.name, id=event.id, data=event.data)
                after = event.id
                if event.name == "done":
                    return
            if status is None or status in FINISHED:
                # resumed after the last event, or the events were removed: the end is sent anyway
                yield ServerSentEvent(event="done", data={"status": status or "dismissed"})
                return
            if said != waiting_for:
                # without an id, as it is not stored: the stream is resumed after the last event that is
                yield ServerSentEvent(event="waiting", data={"waiting_for": said})
                waiting_for = said
            while (live := await listener.next(_LOOK_SECONDS)) is not None:
                if live.id and _order(live.id) <= _order(after):
                    continue
                yield ServerSentEvent(event=live.name, id=live.id or None, data=live.data)
                after = live.id or after
                if live.name == "done":
                    return


def _waiting_for(context: Context, job_id: str, asker: str) -> str | None:
    """Return what a job waits for (blocking); the interest of who follows it goes on."""
    job = context.store.jobs.get(job_id, asker, with_request=False)
    return None if job is None else job.waiting_for


def _order(event_id: str) -> tuple[int, int]:
    """Return by what the ids of events are ordered."""
    time, _, number = event_id.partition("-")
    return int(time), int(number or 0)
