"""What both clients make of answers, and how they divide many requests: batches, their lines, and exceptions."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import httpx2
from pydantic import ValidationError

from grazemap.client.http import JOB_ID, UNKNOWN_JOB, Settings
from grazemap.constants import BYTES_OF_BATCH, MOST_OF_BATCH
from grazemap.errors import (
    JobDismissed,
    JobFailed,
    NotFound,
    ProtocolError,
    ServiceProblem,
    problem_exception,
    problem_text,
)
from grazemap.wire import Job, Note, Problem


def job_of(response: httpx2.Response) -> Job:
    """Return the job that a request was answered with. Raises ProtocolError for an id that is none."""
    job = Job.read(response.content)
    if not JOB_ID.fullmatch(job.id):
        raise ProtocolError("the service answered with an invalid job id")
    return job


def require_success(job: Job) -> None:
    """Raise JobFailed or JobDismissed unless a job was successful."""
    if job.status == "failed":
        reason = problem_text(job.problem) if job.problem else "no reason given"
        raise JobFailed(f"job {job.id} failed: {reason}", job)
    if job.status == "dismissed":
        raise JobDismissed(f"job {job.id} was dismissed", job)


def is_lost(error: NotFound) -> bool:
    """Return whether the service knows nothing of a job, as after its store was emptied."""
    return error.problem.type == UNKNOWN_JOB.type


def keep(settings: Settings, job_id: str, response: httpx2.Response) -> None:
    """Keep a result in the folder of the client, if it has one."""
    cache, etag = settings.cache, response.headers.get("etag")
    if cache and etag and JOB_ID.fullmatch(job_id):
        cache.write(job_id, etag, response.content)


def batches(members: Iterable[bytes]) -> Iterator[list[bytes]]:
    """Yield the members of a batch in parts that the service takes."""
    part: list[bytes] = []
    size = 0
    for member in members:
        if part and (len(part) == MOST_OF_BATCH or size + len(member) > BYTES_OF_BATCH):
            yield part
            part, size = [], 0
        part.append(member)
        size += len(member)
    if part:
        yield part


def place_of(line: dict[str, Any], missing: Sequence[int]) -> int:
    """Return the place of the request, of those that were sent, that a line belongs to. Raises ProtocolError."""
    index = line.get("index")
    if not isinstance(index, int) or not 0 <= index < len(missing):
        raise ProtocolError("a line of the answer belongs to no request")
    return index


def refusal_of(line: dict[str, Any]) -> ServiceProblem | None:
    """Return why a request was not accepted; None if it has a job."""
    if "id" in line:
        return None
    try:
        return problem_exception(Problem.model_validate(line.get("problem")))
    except ValidationError:
        raise ProtocolError("a line of the answer has neither a job nor a problem") from None


def placed(error: ServiceProblem, places: Sequence[int]) -> ServiceProblem:
    """Return the problem of a batch with the places of its requests among all."""
    errors = []
    for one in error.problem.errors:
        pointer = re.sub(r"^/requests/(\d+)", lambda found: f"/requests/{places[int(found[1])]}", one.pointer)
        errors.append(one.model_copy(update={"pointer": pointer}))
    return problem_exception(error.problem.model_copy(update={"errors": errors}))


def once(notes: Sequence[Note]) -> list[Note]:
    """Return one note of each code, which says how many there are."""
    counts = Counter(note.code for note in notes)
    first = {note.code: note for note in reversed(notes)}
    return [
        note
        if counts[code] == 1
        else note.model_copy(update={"detail": f"{note.detail} ({counts[code]} requests have this note)"})
        for code, note in first.items()
    ]
