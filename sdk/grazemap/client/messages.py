"""The jobs, notes, lines and exceptions in the answers of a service, and the division of many requests into batches."""

from __future__ import annotations

import re
import sys
import warnings
from asyncio import CancelledError
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx2
from pydantic import ValidationError

from grazemap.client.http import JOB_ID, UNKNOWN_JOB
from grazemap.constants import MAX_BATCH_BYTES, MAX_BATCH_REQUESTS
from grazemap.errors import (
    JobDismissed,
    JobFailed,
    NotFound,
    ProtocolError,
    RequestWarning,
    ServiceProblem,
    problem_exception,
    problem_text,
)
from grazemap.results import Result, decode_result
from grazemap.version import __version__
from grazemap.wire import Job, Note, Problem, ProcessRequest, canonical_id, notes_on, unstated
from grazemap.wire.notes import OTHER_MOTIONS

# Codes of notes without a warning. Maps below the grazing curve are common: the motions with impacts are there. A job
# that waits for the compilation of kernels only takes longer. The result says what a forcing period is.
_QUIET = frozenset({"below-grazing-curve", "compiles-first", "forcing-period"})
_PACKAGE = str(Path(__file__).parents[1])


def job_of(response: httpx2.Response, request: ProcessRequest) -> Job:
    """Return the job in the answer to a request, and issue its notes. Raises ProtocolError for an invalid id."""
    job = Job.read(response.content)
    if not JOB_ID.fullmatch(job.id):
        raise ProtocolError("the service answered with an invalid job id")
    warn_about([*job.notes, *unstated(request)])
    return job


def require_success(job: Job) -> None:
    """Raise JobFailed or JobDismissed unless a job was successful."""
    if job.status == "failed":
        reason = problem_text(job.problem) if job.problem else "no reason given"
        raise JobFailed(f"job {job.id} failed: {reason}", job)
    if job.status == "dismissed":
        raise JobDismissed(f"job {job.id} was dismissed", job)


@contextmanager
def saying_what_goes_on(job_id: str | None = None) -> Iterator[None]:
    """Within this block an interrupt gets a note on the job, or else on the jobs of a batch, unless it has one."""
    try:
        yield
    except (KeyboardInterrupt, CancelledError) as interrupt:
        if not getattr(interrupt, "__notes__", None):
            kept = "goes on while its service runs."
            single = f'The job {kept} job = client.job("{job_id}") is its handle, and job.cancel() ends it.'
            many = f"Each job {kept} client.jobs() lists the handles, and the cancel() of a handle ends its job."
            interrupt.add_note(many if job_id is None else single)
        raise


def result_of(request: ProcessRequest, outcome: bytes | Problem) -> Result:
    """Return the result of a request that was computed without a service, from its npz. Raises JobFailed."""
    if isinstance(outcome, Problem):
        process, canonical = request.operation.process, request.canonical()
        job_id = canonical_id(process, canonical, __version__)
        require_success(Job(id=job_id, process=process, request=canonical, status="failed", problem=outcome))
    assert isinstance(outcome, bytes)
    result = decode_result(outcome)
    announce(result)
    return result


def announce(result: Result) -> None:
    """Issue the note of a result that other motions were seen at its point, which its request has not.

    Many maps have such points: their note stands in `notes`, and their summary has the numbers.
    """
    warn_about([note for note in result.notes if note.code == OTHER_MOTIONS])


def is_lost(error: NotFound) -> bool:
    """Return whether the service does not know a job, for example because its store was emptied."""
    return error.problem.type == UNKNOWN_JOB.type


def batches(members: Iterable[bytes]) -> Iterator[list[bytes]]:
    """Yield the members in batches that are not too large for the service."""
    part: list[bytes] = []
    size = 0
    for member in members:
        if part and (len(part) == MAX_BATCH_REQUESTS or size + len(member) > MAX_BATCH_BYTES):
            yield part
            part, size = [], 0
        part.append(member)
        size += len(member)
    if part:
        yield part


def request_index(line: dict[str, Any], missing: Sequence[int]) -> int:
    """Return the position, among the requests that were sent, of the request of a line. Raises ProtocolError."""
    index = line.get("index")
    if not isinstance(index, int) or not 0 <= index < len(missing):
        raise ProtocolError("a line of the answer belongs to no request")
    return index


def refusal_of(line: dict[str, Any]) -> ServiceProblem | None:
    """Return the exception for a line whose request was not accepted; None if the request has a job."""
    if "id" in line:
        return None
    try:
        return problem_exception(Problem.model_validate(line.get("problem")))
    except ValidationError:
        raise ProtocolError("a line of the answer has neither a job nor a problem") from None


def renumbered_problem(error: ServiceProblem, places: Sequence[int]) -> ServiceProblem:
    """Return the problem of a batch with pointers that number its requests by their places among all requests."""
    errors = []
    for entry in error.problem.errors:
        pointer = re.sub(r"^/requests/(\d+)", lambda match: f"/requests/{places[int(match[1])]}", entry.pointer)
        errors.append(entry.model_copy(update={"pointer": pointer}))
    problem = error.problem.model_copy(update={"errors": errors})
    return problem_exception(problem, error.request_id, error.retry_after)


def notes_on_all(requests: Sequence[ProcessRequest]) -> list[Note]:
    """Return the notes on many requests, one of each code; its text says how many requests have the note."""
    notes = [note for request in requests for note in (*notes_on(request), *unstated(request))]
    counts = Counter(note.code for note in notes)
    first = {note.code: note for note in reversed(notes)}
    return [
        note
        if counts[code] == 1
        else note.model_copy(update={"detail": f"{note.detail} ({counts[code]} requests have this note)"})
        for code, note in first.items()
    ]


def warn_about(notes: Sequence[Note]) -> None:
    """Issue a RequestWarning for each note that is not quiet, at the line that called this package."""
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_PACKAGE):
        frame, level = frame.f_back, level + 1
    for note in notes:
        if note.code in _QUIET:
            continue
        warnings.warn(RequestWarning(note.detail, note.code), stacklevel=level)
