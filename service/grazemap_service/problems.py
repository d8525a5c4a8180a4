"""Every error that the service can answer with, as problem details after RFC 9457.

One table has type, title and status of each kind of problem. A router raises `ProblemException`. The handlers here turn
this exception, the errors of the framework and those of the store into application/problem+json. A problem never
repeats data that the client sent.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import redis.exceptions
import structlog
from fastapi import FastAPI
from fastapi.exceptions import HTTPException, RequestValidationError
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match

from grazemap.constants import PROBLEM_PREFIX
from grazemap.wire import PROCESSES, Problem, ProblemError
from grazemap.wire.error_details import errors_of
from grazemap_worker.store import BacklogFull, QuotaExceeded, is_away, is_full, trouble

MEDIA_TYPE = "application/problem+json"
STORE_RETRY_SECONDS = 2


class Kind(NamedTuple):
    """One kind of problem."""

    title: str
    """Title of the problem."""
    status: int
    """HTTP status."""
    meaning: str
    """What is wrong, and what to do; the detail of a problem without one of its own."""


KINDS: dict[str, Kind] = {
    "malformed-json": Kind(
        "Malformed JSON", 400, "The body is not JSON in UTF-8, is nested too deeply, or has repeated or too many names."
    ),
    "host-not-allowed": Kind(
        "Host not allowed",
        400,
        "The Host header names none of the allowed hosts: use one, or add it to GRAZEMAP_ALLOWED_HOSTS.",
    ),
    "bad-request": Kind("Bad request", 400, "The request cannot be understood: /docs has requests to try."),
    "key-required": Kind("Key required", 401, "The header `Authorization: Bearer <key>` is missing or wrong."),
    "not-found": Kind("Not found", 404, "There is nothing at this address: /openapi.json has all that exist."),
    "unknown-process": Kind("Unknown process", 404, "There is no process of this name: GET /v1 lists them."),
    "unknown-job": Kind("Unknown job", 404, "There is no job with this id: post its request to compute it."),
    "unfinished-tile": Kind("Unfinished tile", 404, "The job has no finished tile of this number: follow its events."),
    "method-not-allowed": Kind("Method not allowed", 405, "The address does not allow this method; see Allow."),
    "not-acceptable": Kind(
        "Not acceptable", 406, "None of the requested representations is available: ask for JSON or npz."
    ),
    "unfinished-job": Kind("Unfinished job", 409, "The job has no result yet: follow its events, or try again later."),
    "dismissed-job": Kind("Dismissed job", 409, "The job was dismissed: post its request again to compute it."),
    "outdated-job": Kind("Outdated job", 409, "The job is of another version: post its request again."),
    "body-too-large": Kind(
        "Body too large", 413, "The body is over the byte limit: give ranges in place of long lists."
    ),
    "unsupported-media-type": Kind(
        "Unsupported media type", 415, "The body must be application/json, without a Content-Encoding."
    ),
    "invalid-request": Kind(
        "Invalid request", 422, "Values are missing, unknown or out of range; the errors name each of them."
    ),
    "too-much-work": Kind(
        "Too much work",
        422,
        "The job is estimated to cost more than the limit: ask for fewer points or periods; the errors name both.",
    ),
    "queue-full": Kind("Queue full", 429, "Too much work is waiting; try again after Retry-After seconds."),
    "internal-error": Kind("Internal error", 500, "The service failed; its log has the request id."),
    "store-unavailable": Kind("Store unavailable", 503, "Redis is unavailable; try again after Retry-After seconds."),
    "storage-full": Kind(
        "Storage full",
        507,
        "The disk or the memory of Redis is full: nothing new is stored until there is space, and results are served.",
    ),
}
_STATUS_KINDS = {404: "not-found", 405: "method-not-allowed"}


class ProblemException(HTTPException):
    """Raised to answer with a problem.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    detail : str
        A sentence for users, without anything that the client sent.
    errors : sequence of ProblemError
        What is wrong, and where.
    headers : mapping
        Headers of the answer.
    extensions : mapping
        Further members of the problem, such as estimate and limit.
    """

    def __init__(
        self,
        kind: str,
        detail: str = "",
        *,
        errors: Sequence[ProblemError] = (),
        headers: Mapping[str, str] | None = None,
        extensions: Mapping[str, Any] | None = None,
    ) -> None:
        self.problem = make_problem(kind, detail, errors)
        self.extensions = dict(extensions or {})
        super().__init__(self.problem.status, self.problem.detail, headers=dict(headers or {}))


def make_problem(kind: str, detail: str = "", errors: Sequence[ProblemError] = ()) -> Problem:
    """Return the problem of a kind; without `detail`, its detail is the meaning of the kind."""
    row = KINDS[kind]
    return Problem(
        type=PROBLEM_PREFIX + kind,
        title=row.title,
        status=row.status,
        detail=detail or row.meaning,
        errors=list(errors),
    )


def invalid(pointer: str, detail: str, allowed: str) -> ProblemException:
    """Return the exception that refuses a value."""
    return ProblemException("invalid-request", errors=[ProblemError(pointer=pointer, detail=detail, allowed=allowed)])


def problem_response(
    problem: Problem, *, headers: Mapping[str, str] | None = None, extensions: Mapping[str, Any] | None = None
) -> Response:
    """Return a response with a problem, which no cache may store."""
    content = {**problem.model_dump(mode="json"), **(extensions or {})}
    return Response(
        json.dumps(content, allow_nan=False).encode(),
        status_code=problem.status,
        media_type=MEDIA_TYPE,
        headers={"Cache-Control": "no-store", **(headers or {})},
    )


def response_of(exception: ProblemException) -> Response:
    """Return the response for a ProblemException."""
    return problem_response(exception.problem, headers=exception.headers, extensions=exception.extensions)


def install(app: FastAPI) -> None:
    """Register the handler of exceptions with the app."""
    for kind in (StarletteHTTPException, RequestValidationError, BacklogFull, redis.exceptions.RedisError):
        app.add_exception_handler(kind, answer_to)


async def answer_to(request: Request, exception: Exception) -> Response:
    """Return the response for an exception; an exception of another kind is raised again."""
    match exception:
        case ProblemException():
            return response_of(exception)
        case StarletteHTTPException():
            return _routed(request, exception)
        case RequestValidationError():
            errors = errors_of(exception.errors())
            return problem_response(make_problem("invalid-request", errors=errors))
        case BacklogFull():
            detail = "This key has its quota of unfinished tiles." if isinstance(exception, QuotaExceeded) else ""
            after = {"Retry-After": str(exception.retry_after)}
            return problem_response(make_problem("queue-full", detail), headers=after)
        case redis.exceptions.RedisError() if is_full(exception):
            structlog.get_logger("grazemap_service").error("Redis refuses writes", reason=str(exception))
            return problem_response(make_problem("storage-full"))
        case redis.exceptions.RedisError() if is_away(exception):
            if isinstance(exception, redis.exceptions.AuthenticationError):
                structlog.get_logger("grazemap_service").error(trouble(exception))
            away = {"Retry-After": str(STORE_RETRY_SECONDS)}
            return problem_response(make_problem("store-unavailable"), headers=away)
        case _:
            raise exception


def _routed(request: Request, exception: StarletteHTTPException) -> Response:
    """Return the response for an exception of the framework, such as that of an address that does not exist."""
    status = exception.status_code
    if status == 404 and re.fullmatch(r"/v1/[^/]+", request.url.path) and request.method == "POST":
        names = ", ".join(sorted(PROCESSES))
        return problem_response(make_problem("unknown-process", f"The processes are {names}."))
    if status == 405:
        # below a mount, such as that of static files, `_methods` sees no routes; the framework lists the methods itself
        allowed = ", ".join(_methods(request)) or (exception.headers or {}).get("Allow", "")
        return problem_response(make_problem("method-not-allowed"), headers={"Allow": allowed})
    kind = _STATUS_KINDS.get(status, "bad-request" if status < 500 else "internal-error")
    return problem_response(make_problem(kind).model_copy(update={"status": status}), headers=exception.headers)


def _methods(request: Request) -> list[str]:
    """Return all methods of an address; the framework lists those of a single route only."""
    candidates = ("GET", "HEAD", "POST", "DELETE")
    routes = request.app.router.routes
    return [
        method
        for method in candidates
        if any(route.matches({**request.scope, "method": method})[0] is Match.FULL for route in routes)
    ]
