"""The exceptions for callers to handle, and the table from a problem's status to its exception.

GrazemapError
├── ServiceProblem              the service refused or failed, any other 4xx: .problem, .status, .request_id
│   ├── ParameterError          400, 413, 422, or before anything is sent (also a ValueError)
│   ├── AuthenticationError     401, 403: the key is missing, wrong, or not allowed to do this
│   ├── NotFound                404, 410
│   ├── ResultNotReady          409, if the job is unfinished
│   ├── QueueFull               429 after all retries: .retry_after
│   ├── ServiceUnavailable      502, 503, 504 after all retries: .retry_after
│   └── ServerError             any other 5xx
├── JobError                    .job, as last seen
│   ├── JobFailed               .problem says why
│   ├── JobDismissed            it was cancelled
│   └── WaitTimeout             unfinished after the time to wait; the job continues (also a TimeoutError)
├── ConnectionFailed            no answer after all retries (also a ConnectionError)
├── ProtocolError               an answer that no grazemap service sends
├── ResultFormatError           a file or an answer that is not a result (also a ValueError)
├── ComputationError            a computation without a service was lost with its processes, or these differ
│   └── CheckpointError         a folder is not that of the computation
├── StackError                  the local stack did not start; the message ends with the last lines of its log
└── MissingExtra                an optional part is not installed (also an ImportError)

All of them can be pickled, so that they can be returned from a process pool.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from grazemap.constants import PROBLEM_PREFIX

if TYPE_CHECKING:
    from grazemap.wire import Job, Problem

__all__ = [
    "AuthenticationError",
    "CheckpointError",
    "ComputationError",
    "ConnectionFailed",
    "GrazemapError",
    "JobDismissed",
    "JobError",
    "JobFailed",
    "MissingExtra",
    "NotFound",
    "ParameterError",
    "ProtocolError",
    "QueueFull",
    "RequestWarning",
    "ResultFormatError",
    "ResultNotReady",
    "ServerError",
    "ServiceProblem",
    "ServiceUnavailable",
    "StackError",
    "WaitTimeout",
    "problem_exception",
    "problem_text",
]


class GrazemapError(Exception):
    """Base of the exceptions of the package."""


class RequestWarning(UserWarning):
    """A request is allowed, but probably not what was meant. Its text and `code` are those of a note of the job."""

    def __init__(self, detail: str = "", code: str = "") -> None:
        super().__init__(detail)
        self.code = code


def problem_text(problem: Problem) -> str:
    """Return a problem as text: the title, the detail, and one line per error; no sentence is repeated."""
    lines = [problem.title if not problem.detail else f"{problem.title}: {problem.detail}"]
    for error in problem.errors:
        allowed = f" (allowed: {error.allowed})" if error.allowed else ""
        pointer = error.pointer or "/"
        text = f"at {pointer}" if error.detail == problem.detail else f"{pointer}: {error.detail}"
        lines.append(f"  {text}{allowed}")
    return "\n".join(lines)


class ServiceProblem(GrazemapError):
    """The service answered with a problem as in RFC 9457.

    Attributes
    ----------
    problem : Problem
        type, title, status, detail and the list of errors (pointer, detail, allowed).
    request_id : str or None
        The X-Request-Id of the answer, to be quoted in a report; None when nothing was sent.
    retry_after : float or None
        Seconds after which the request may be sent again.
    """

    def __init__(self, problem: Problem, request_id: str | None = None, retry_after: float | None = None) -> None:
        super().__init__(problem_text(problem))
        self.problem = problem
        self.request_id = request_id
        self.retry_after = retry_after

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.problem, self.request_id, self.retry_after), self.__dict__

    @property
    def status(self) -> int:
        """HTTP status of the problem."""
        return self.problem.status


class ParameterError(ServiceProblem, ValueError):
    """Arguments are not valid; `problem.errors` has the place of each error and what is allowed."""


class AuthenticationError(ServiceProblem):
    """The API key is missing, wrong, or not allowed to do this."""


class NotFound(ServiceProblem):
    """There is no such job, process or page."""


class ResultNotReady(ServiceProblem):
    """The job is unfinished: wait for it first."""


class QueueFull(ServiceProblem):
    """The queue of the service is full; nothing was queued."""


class ServiceUnavailable(ServiceProblem):
    """The service is not available at the moment."""


class ServerError(ServiceProblem):
    """The service failed; its log has the request id."""


class JobError(GrazemapError):
    """A job without a result. `job` is the job as last seen."""

    def __init__(self, message: str, job: Job) -> None:
        super().__init__(message)
        self.job = job

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.job), self.__dict__


class JobFailed(JobError):
    """The computation failed; `problem` says why."""

    @property
    def problem(self) -> Problem | None:
        """The job's problem."""
        return self.job.problem


class JobDismissed(JobError):
    """The job was cancelled."""


class WaitTimeout(JobError, TimeoutError):
    """The job was not finished within the time to wait; it continues."""


class ConnectionFailed(GrazemapError, ConnectionError):
    """No answer from the service."""


class ProtocolError(GrazemapError):
    """The answer is not from a grazemap service, or from a version that this client cannot read."""


class ResultFormatError(GrazemapError, ValueError):
    """The bytes are not a result."""


class ComputationError(GrazemapError):
    """The processes of a computation without a service ended, or they differ."""


class CheckpointError(ComputationError):
    """A folder is not that of the computation."""


class StackError(GrazemapError):
    """The local stack did not start."""


class MissingExtra(GrazemapError, ImportError):
    """An optional part of the package is not installed."""

    def __init__(self, purpose: str, extra: str) -> None:
        super().__init__(f'{purpose} needs an optional part: pip install "grazemap[{extra}]"')
        self.purpose = purpose
        self.extra = extra

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.purpose, self.extra), self.__dict__


_UNFINISHED_JOB = f"{PROBLEM_PREFIX}unfinished-job"
_EXCEPTIONS: dict[int, type[ServiceProblem]] = {
    400: ParameterError,
    401: AuthenticationError,
    403: AuthenticationError,
    404: NotFound,
    410: NotFound,
    413: ParameterError,
    422: ParameterError,
    429: QueueFull,
    502: ServiceUnavailable,
    503: ServiceUnavailable,
    504: ServiceUnavailable,
}


def problem_exception(
    problem: Problem, request_id: str | None = None, retry_after: float | None = None
) -> ServiceProblem:
    """Return the exception for a problem."""
    fallback = ServerError if problem.status >= 500 else ServiceProblem
    # a 409 for a dismissed job, or for one of another version, says that its request is to be posted again
    if problem.status == 409 and problem.type == _UNFINISHED_JOB:
        fallback = ResultNotReady
    return _EXCEPTIONS.get(problem.status, fallback)(problem, request_id, retry_after)
