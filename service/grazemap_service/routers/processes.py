"""POST to a process, or to its estimate: two routes for each process.

The texts of both routes are in the class attribute `operation` of the request model.

>>> answer = http.post("/v1/unfolding-maps", json={"omega": [0.28, 0.29], "clearance": [1.5, 1.6]})
>>> answer.status_code, answer.json()["status"]
(201, 'accepted')
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Annotated, Any, NamedTuple

from anyio.to_thread import run_sync
from fastapi import APIRouter, Body, Depends, Header, Request, Response
from redis.exceptions import RedisError

from grazemap.wire import FINISHED, PROCESSES, Forecast, Job, Note, ProcessRequest, Status, notes_on, unstated
from grazemap_service.context import Context, CurrentContext
from grazemap_service.jobs import PREFIX, CurrentRequester, job_path, job_response, stored_job, submit
from grazemap_service.limits import checked_plan
from grazemap_service.openapi import SUBMISSION_KINDS, problem_responses
from grazemap_service.request_body import JsonRoute
from grazemap_service.routers.results import result_response
from grazemap_worker.processes import kernels_of
from grazemap_worker.store import Requester
from grazemap_worker.store.records import JobEvent

# Seconds without events after which the status of a job is read.
_LOOK_SECONDS = 2.0
_REPRESENTATION = re.compile(r'(?:^|[,;\s])return\s*=\s*"?representation"?(?=$|[,;\s])', re.IGNORECASE)
_WAIT = re.compile(r'(?:^|[,;\s])wait\s*=\s*"?(\d{1,9})"?(?=$|[,;\s])', re.IGNORECASE)


class Preferences(NamedTuple):
    """What a client prefers (RFC 7240)."""

    wait: int | None
    """Seconds to wait for the end of the job."""
    representation: bool
    """Whether the response is to be the result of the job."""


def preferences(
    context: CurrentContext,
    request: Request,
    prefer: Annotated[
        str | None,
        Header(
            description="`wait=5`: the answer comes when the job has ended, or after 5 seconds; the server limits this "
            "time. `return=representation`: if the job was successful, the answer is its result (status 200), in "
            "the form that Accept selects.",
            openapi_examples={"wait for the end": {"value": "wait=5"}},
        ),
    ] = None,
) -> Preferences:
    """Return the preferences of the Prefer header; the time to wait is at most the limit of the server."""
    # `prefer` only describes the header in the OpenAPI document; the header may be repeated
    text = ", ".join(request.headers.getlist("prefer"))
    match = _WAIT.search(text)
    wait = min(int(match[1]), int(context.settings.max_wait_seconds)) if match else None
    return Preferences(wait, _REPRESENTATION.search(text) is not None)


async def _status_after_waiting(context: Context, job: Job, began: float, seconds: float) -> Status:
    """Wait until a job ends, at most `seconds`; return its last known status.

    `began` is a time before the submission of the job.
    """
    status: Status | None = job.status
    deadline = time.monotonic() + seconds
    with context.hub.listen(job.id) as listener:
        complete, ended = await context.hub.ended_since(job.id, began, seconds)
        if ended is not None:
            return ended
        while True:
            if not complete:
                # Events may have been missed, so the status is read. The whole record may have a megabyte.
                status = await run_sync(context.store.jobs.status, job.id, limiter=context.threads)
            left = deadline - time.monotonic()
            if status is None or status in FINISHED or left <= 0:
                return status or "dismissed"
            events: list[JobEvent | None] = [None]
            with suppress(TimeoutError):
                events = await listener.next(min(_LOOK_SECONDS, left))
            for event in events:
                if event is not None and event.name == "done":
                    final_status: Status = event.data["status"]
                    return final_status
            complete = None not in events


def _submit_endpoint(model: type[ProcessRequest]) -> Callable[..., Coroutine[Any, Any, Response]]:
    """Return the route of a process.

    FastAPI reads the annotations that are set below. Those in the signature are for readers and type checkers.
    """
    operation = model.operation

    async def post(
        request: Request, body: ProcessRequest, context: Context, requester: Requester, preferred: Preferences
    ) -> Response:
        began = time.monotonic()
        job, created = await run_sync(submit, context, operation.process, body, requester, limiter=context.threads)
        applied = [] if preferred.wait is None else [f"wait={preferred.wait}"]
        if preferred.wait is not None and job.status not in FINISHED:
            status = await _status_after_waiting(context, job, began, preferred.wait)
            if preferred.representation and status == "successful":
                job = job.model_copy(update={"status": status})
            else:
                stored = None
                # the last status is known where the record has been removed meanwhile, or Redis is away
                with suppress(RedisError):
                    stored = await run_sync(stored_job, context, job.id, requester.name, limiter=context.threads)
                job = stored or job.model_copy(update={"status": status})
        if preferred.representation and job.status == "successful":
            answer = await result_response(request, context, job, requester)
            if answer.status_code == 200:  # otherwise the answer is the job that computes an evicted result again
                applied.append("return=representation")
                answer.headers["Content-Location"] = f"{job_path(job.id)}/result"
            answer.headers["Location"] = job_path(job.id)
        else:
            job = await run_sync(_with_notes_on_what_is_left_out, job, body, limiter=context.threads)
            answer = job_response(job, 201 if created else 200)
        if applied:
            answer.headers["Preference-Applied"] = ", ".join(applied)
        return answer

    post.__annotations__ = {
        "body": _body(model),
        "context": CurrentContext,
        "request": Request,
        "requester": CurrentRequester,
        "preferred": Annotated[Preferences, Depends(preferences)],
        "return": Response,
    }
    post.__name__, post.__doc__ = operation.operation_id, operation.description
    return post


def _with_notes_on_what_is_left_out(job: Job, request: ProcessRequest) -> Job:
    """Return a job with the notes on its request as it was written, which the job itself has not (blocking)."""
    return job.model_copy(update={"notes": [*job.notes, *unstated(request)]})


def _estimate_endpoint(model: type[ProcessRequest]) -> Callable[..., Coroutine[Any, Any, Forecast]]:
    """Return the route of the estimate of a process."""
    operation = model.operation

    def estimate(context: Context, request: ProcessRequest) -> Forecast:
        plan = checked_plan(operation.process, request, context.settings)
        notes = [*notes_on(request), *unstated(request), *_compiling_notes(context, operation.process, request)]
        return Forecast(**plan.estimate.model_dump(), notes=notes)

    async def post(body: ProcessRequest, context: Context) -> Forecast:
        return await run_sync(estimate, context, body, limiter=context.threads)

    post.__annotations__ = {"body": _body(model), "context": CurrentContext, "return": Forecast}
    post.__doc__ = "Estimate the cost of a request and check it, without submitting it."
    return post


def _body(model: type[ProcessRequest]) -> Any:
    """Return the type of the body of a process, with its examples."""
    examples: Any = {name: {"value": value} for name, value in model.operation.examples.items()}
    return Annotated[model, Body(openapi_examples=examples)]


def _compiling_notes(context: Context, process: str, request: ProcessRequest) -> list[Note]:
    """Return a list with a note if kernels must be compiled before the job is computed, else an empty list (blocks)."""
    kernels, ready = kernels_of(process, request), context.store.workers.kernels(context.core_version)
    if ready is None or kernels in ready:
        return []
    seconds = context.store.workers.wait(kernels)
    if seconds < _LOADED_SECONDS:
        return []
    detail = f"kernels are compiled first, usually in about {seconds:.0f} s, which the estimate does not contain"
    return [Note(code="compiles-first", detail=detail)]


# A shorter wait is not worth a note: kernels that are compiled are loaded in this time.
_LOADED_SECONDS = 2.0
router = APIRouter(route_class=JsonRoute, tags=["processes"])
for _process, _model in PROCESSES.items():
    _model.build()  # FastAPI's validator of a model that is built later would warn at the first request
    router.add_api_route(
        f"{PREFIX}/{_process}",
        _submit_endpoint(_model),
        methods=["POST"],
        operation_id=_model.operation.operation_id,
        summary=_model.operation.summary,
        status_code=201,
        response_description="A new job.",
        responses={
            200: {
                "model": Job,
                "description": "The job that computes, or has computed, the same request. With `Prefer: "
                "return=representation`, if the job was successful: its result, as the address of the result answers. "
                "The schema here is the job's, so that generated clients need not tell the two apart.",
            },
            201: {"model": Job, "description": "A new job; Location is its address."},
            202: {
                "model": Job,
                "description": "With `Prefer: return=representation`, if the result was evicted: the job that computes "
                "it again.",
            },
            **problem_responses(*SUBMISSION_KINDS),
        },
    )
    router.add_api_route(
        f"{PREFIX}/{_process}/estimate",
        _estimate_endpoint(_model),
        methods=["POST"],
        operation_id=_model.operation.operation_id.replace("submit_", "estimate_"),
        summary=f"{_model.operation.summary}: estimate",
        response_description="The expected cost.",
        responses=problem_responses(*(kind for kind in SUBMISSION_KINDS if kind != "queue-full")),
    )
