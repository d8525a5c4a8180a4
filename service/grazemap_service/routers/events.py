"""A job's events as server-sent events, resumable by Last-Event-ID; the stream ends after `done`."""

from __future__ import annotations

import json
import re
import time
from collections.abc import AsyncIterator, Iterable
from functools import partial
from typing import Annotated

import anyio
import redis.exceptions
import structlog
from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Header, Response
from fastapi.responses import StreamingResponse
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event

from grazemap.wire import FINISHED, Status
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import CurrentRequester, KnownJob
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import invalid
from grazemap_worker.store.records import JobEvent

_BEGINNING = "0"
# The header is empty, or the id of an event with at most 19 digits in each part, which Redis always accepts.
_LAST_EVENT_ID = "^([0-9]{1,19}(-[0-9]{1,19})?)?$"
# Seconds between attempts while the store is unavailable.
_AWAY_SECONDS = 1.0
# Seconds without events after which the job is read again: what it waits for may have changed, or events were missed.
_LOOK_SECONDS = 2.0

# Seconds without a message after which a comment is sent, so that proxies do not close the connection.
_PING_SECONDS = 15.0

router = APIRouter(tags=["jobs"])


class _Events(StreamingResponse):
    media_type = "text/event-stream"


def resume_point(
    last_event_id: Annotated[
        str | None,
        Header(
            description="The id of the last event that arrived; the stream continues after it.",
            json_schema_extra={"pattern": _LAST_EVENT_ID},
        ),
    ] = None,
) -> str:
    """Return the id after which the stream continues. Raises ProblemException if it is not an event's id."""
    if not last_event_id:
        return _BEGINNING
    if not re.fullmatch(_LAST_EVENT_ID, last_event_id):
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
    response_class=_Events,
    responses={
        200: {"description": "Events `progress`, `waiting`, `tile` and `done`, their data JSON objects."},
        **problem_responses("unknown-job", "invalid-request"),
    },
)
async def get_events(
    job: KnownJob, context: CurrentContext, requester: CurrentRequester, after: Annotated[str, Depends(resume_point)]
) -> _Events:
    """Stream the events of a job to its end, from its beginning or after the last event that arrived."""
    headers = {"Cache-Control": "no-cache", "X-Accel-Buffering": "no"}
    return _Events(_messages(context, job.id, requester.name, after), headers=headers)


async def _messages(context: Context, job_id: str, requester: str, after: str) -> AsyncIterator[bytes]:
    """Yield the messages of a stream; messages that are available at the same time are yielded together."""
    waiting_for = None
    sent = time.monotonic()
    with context.hub.listen(job_id) as listener:
        fresh = time.monotonic()
        while True:
            arguments = (job_id, requester, after)
            try:
                status, stored, reason = await context.hub.shared(
                    arguments, fresh, partial(run_sync, _look, context, *arguments, limiter=context.threads)
                )
            except redis.exceptions.RedisError:
                structlog.get_logger("grazemap_service").warning("events wait for the store")
                if time.monotonic() - sent > _PING_SECONDS:
                    yield KEEPALIVE_COMMENT
                    sent = time.monotonic()
                await anyio.sleep(_AWAY_SECONDS)
                continue
            if stored:
                yield _messages_of(stored)
                sent, after = time.monotonic(), stored[-1].id
                if stored[-1].name == "done":
                    return
                continue  # there may be more events
            if status is None or status in FINISHED:
                # the stream was resumed after the last event, or the events were removed: send the end anyway
                yield _message("done", json.dumps({"status": status or "dismissed"}))
                return
            if reason != waiting_for:
                # this event is not stored and has no id, so a stream is resumed after the last stored event
                yield _message("waiting", json.dumps({"waiting_for": reason}))
                sent, waiting_for = time.monotonic(), reason
            elif time.monotonic() - sent > _PING_SECONDS:
                yield KEEPALIVE_COMMENT
                sent = time.monotonic()
            while True:
                try:
                    events = await listener.next(_LOOK_SECONDS)
                except TimeoutError:
                    fresh = time.monotonic() - 0.5 * _LOOK_SECONDS
                    break
                # what follows a gap is read from the store, together with what the gap has
                received = events[: events.index(None)] if None in events else events
                news = [event for event in received if event is not None and _follows(event.id, after)]
                if news:
                    yield _messages_of(news)
                    sent = time.monotonic()
                    after = next((event.id for event in reversed(news) if event.id), after)
                if any(event.name == "done" for event in news):
                    return
                if None in events:
                    fresh = time.monotonic()
                    break


def _messages_of(events: Iterable[JobEvent]) -> bytes:
    return b"".join(_message(event.name, event.text, event.id) for event in events)


def _message(name: str, text: str, event_id: str = "") -> bytes:
    """Return an event as it is sent; `text` is JSON without line breaks."""
    return format_sse_event(event=name, data_str=text, id=event_id or None)


def _follows(event_id: str, after: str) -> bool:
    return not event_id or _order(event_id) > _order(after)


def _look(
    context: Context, job_id: str, requester: str, after: str
) -> tuple[Status | None, list[JobEvent], str | None]:
    """Return a job's status, its events after an id, and why it waits; renew the subscription (blocking)."""
    jobs = context.store.jobs
    # the job is read before the events, so that the events include `done` if the status is that of an ended job
    job = jobs.get(job_id, requester, with_request=False)
    stored = jobs.events(job_id, after)
    return (None, stored, None) if job is None else (job.status, stored, job.waiting_for)


def _order(event_id: str) -> tuple[int, int]:
    """Return the sort key of the id of an event."""
    time, _, number = event_id.partition("-")
    return int(time), int(number or 0)
