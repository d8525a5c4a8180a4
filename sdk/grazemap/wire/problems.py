"""Every kind of problem, after RFC 9457: of the service's answers, of failed jobs, and of what the client refuses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from grazemap.constants import PROBLEM_PREFIX
from grazemap.errors import ParameterError
from grazemap.wire.job import Problem, ProblemError


class ProblemKind(NamedTuple):
    """One kind of problem."""

    status: int
    """HTTP status."""
    meaning: str = ""
    """What is wrong, and what to do: the detail of a problem without its own. Empty where every problem has its own."""


KINDS: dict[str, ProblemKind] = {
    "malformed-json": ProblemKind(
        400, "The body is not JSON in UTF-8, is nested too deeply, or has repeated or too many names."
    ),
    "host-not-allowed": ProblemKind(
        400, "The Host header names none of the allowed hosts: use one, or add it to GRAZEMAP_ALLOWED_HOSTS."
    ),
    "bad-request": ProblemKind(400, "The request cannot be understood: /docs has requests to try."),
    "key-required": ProblemKind(401, "The header `Authorization: Bearer <key>` is missing or wrong."),
    "not-found": ProblemKind(404, "There is nothing at this address: /openapi.json has all that exist."),
    "unknown-process": ProblemKind(404, "There is no process of this name: GET /v1 lists them."),
    "unknown-job": ProblemKind(404, "There is no job with this id: post its request to compute it."),
    "unfinished-tile": ProblemKind(404, "The job has no finished tile of this number: follow its events."),
    "method-not-allowed": ProblemKind(405, "The address does not allow this method; see Allow."),
    "not-acceptable": ProblemKind(406, "None of the requested representations is available: ask for JSON or npz."),
    "unfinished-job": ProblemKind(409, "The job has no result yet: follow its events, or try again later."),
    "dismissed-job": ProblemKind(409, "The job was dismissed: post its request again to compute it."),
    "outdated-job": ProblemKind(409, "The job is of another version: post its request again."),
    "body-too-large": ProblemKind(413, "The body is over the byte limit: give ranges in place of long lists."),
    "unsupported-media-type": ProblemKind(415, "The body must be application/json, without a Content-Encoding."),
    "invalid-request": ProblemKind(422, "Values are missing, unknown or out of range; the errors name each of them."),
    "too-much-work": ProblemKind(
        422, "The job is estimated to cost more than the limit: ask for fewer points or periods; the errors name both."
    ),
    "queue-full": ProblemKind(429, "Too much work is waiting; try again after Retry-After seconds."),
    "internal-error": ProblemKind(500, "The service failed; its log has the request id."),
    "store-unavailable": ProblemKind(503, "Redis is unavailable; try again after Retry-After seconds."),
    "storage-full": ProblemKind(
        507,
        "The disk or the memory of Redis is full: nothing new is stored until there is space, and results are served.",
    ),
    # of failed jobs alone
    "computation-refused": ProblemKind(422),
    "core-outdated": ProblemKind(409, "The workers were updated before the job was done: post its request again."),
    "computation-failed": ProblemKind(500),
    "computation-too-long": ProblemKind(500),
    "computation-hung": ProblemKind(500),
    "too-much-memory": ProblemKind(500),
    "too-much-time": ProblemKind(500),
    "worker-lost": ProblemKind(500),
}


def make_problem(kind: str, detail: str = "", errors: Sequence[ProblemError] = ()) -> Problem:
    """Return the problem of a kind; without `detail`, it has the meaning of the kind."""
    status, meaning = KINDS[kind]
    title = kind.replace("-", " ").capitalize().replace("json", "JSON")
    return Problem(
        type=PROBLEM_PREFIX + kind, title=title, status=status, detail=detail or meaning, errors=list(errors)
    )


def parameter_error(errors: Sequence[ProblemError]) -> ParameterError:
    """Return the exception for errors in a request that was not sent."""
    return ParameterError(make_problem("invalid-request", errors=errors))


def refusal(pointer: str, detail: str, allowed: str) -> ParameterError:
    """Return the exception for one error in a request that was not sent."""
    return parameter_error([ProblemError(pointer=pointer, detail=detail, allowed=allowed)])
