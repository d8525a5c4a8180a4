"""Every error that the service can answer with, as a problem of a kind in `grazemap.wire.problems`.

A router raises `ProblemException`. The handlers here turn this exception, the errors of the framework and those of the
store into application/problem+json. A problem never repeats data that the client sent.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import redis.exceptions
import structlog
from fastapi import FastAPI
from fastapi.exceptions import HTTPException, RequestValidationError
from starlette.exceptions import HTTPException as StarletteHTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match

from grazemap.wire import PROCESSES, Problem, ProblemError
from grazemap.wire.error_details import errors_of
from grazemap.wire.problems import make_problem
from grazemap_worker.store import BacklogFull, QuotaExceeded, is_away, is_full, trouble

MEDIA_TYPE = "application/problem+json"
STORE_RETRY_SECONDS = 2
_STATUS_KINDS = {404: "not-found", 405: "method-not-allowed"}


class ProblemException(HTTPException):
    """Raised to answer with a problem.

    Parameters
    ----------
    kind : str
        A name in `grazemap.wire.problems.KINDS`.
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
