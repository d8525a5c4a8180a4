"""Jobs of a service: submitting and listing them, fetching their results, and the handle of a job."""

from __future__ import annotations

import json
import re
from base64 import b64decode
from collections import Counter
from collections.abc import AsyncGenerator, Callable, Iterator, Mapping, Sequence
from contextlib import aclosing
from typing import Any, TypeVar, cast
from urllib.parse import parse_qs, urlsplit

import httpx2
from pydantic import ValidationError

from grazemap.client.async_connection import AsyncConnection
from grazemap.client.async_watch import AsyncFollower
from grazemap.client.events import Event
from grazemap.client.http import JOB_ID, failure_of, job_path, json_object, pause, problem_of
from grazemap.client.progress import Listener
from grazemap.client.request_warnings import warn_of
from grazemap.constants import (
    API_PREFIX,
    BATCH_SILENCE,
    BYTES_OF_BATCH,
    MOST_OF_BATCH,
    MOST_OF_LINE,
    PREFER_WAIT,
    RETRIED_STATUSES,
)
from grazemap.errors import (
    ConnectionFailed,
    GrazemapError,
    JobDismissed,
    JobError,
    JobFailed,
    ProtocolError,
    ServiceProblem,
    problem_exception,
    problem_text,
)
from grazemap.results import Result, decode_result, html
from grazemap.wire import (
    Forecast,
    Job,
    JobList,
    Note,
    Problem,
    ProcessRequest,
    Progress,
    Status,
    canonical,
    notes_on,
    unstated,
)

R = TypeVar("R", bound=Result)
_JSON = {"content-type": "application/json"}
_NPZ_TYPE = "application/x-npz"


class AsyncJobHandle:
    """A job of an `AsyncClient`, in its last known state; `refresh` and `wait` update it."""

    def __init__(self, connection: AsyncConnection, job: Job) -> None:
        self._connection = connection
        self._job = job

    @property
    def id(self) -> str:
        """The content-addressed id: equal requests have the same id."""
        return self._job.id

    @property
    def process(self) -> str:
        """Name of the process, for example "unfolding-maps"."""
        return self._job.process

    @property
    def request(self) -> dict[str, Any] | None:
        """The canonical request, with all defaults; None for a long request in a list of jobs, until `refresh`."""
        return self._job.request

    @property
    def status(self) -> Status:
        """Status as last seen: accepted, running, successful, failed or dismissed."""
        return self._job.status

    @property
    def progress(self) -> Progress:
        """Progress as last seen."""
        return self._job.progress

    @property
    def problem(self) -> Problem | None:
        """Why the job failed, if it did."""
        return self._job.problem

    @property
    def job(self) -> Job:
        """The whole job as last seen."""
        return self._job

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id[:12]} {self.process}: {self.status}>"

    def _repr_html_(self) -> str:
        job, progress = self._job, self._job.progress
        rows = {
            "process": job.process,
            "status": job.status,
            "progress": f"{progress.done} of {progress.total} {progress.unit}",
            "waiting for": job.waiting_for,
            "estimate": f"{job.estimate.seconds:.3g} s of one core",
            "core": job.core_version,
            "note": "; ".join(note.detail for note in job.notes),
            "problem": problem_text(job.problem) if job.problem else None,
        }
        return html.table(f"Job {job.id[:12]}", rows)

    async def refresh(self) -> AsyncJobHandle:
        """Update the handle from the service, and return it."""
        self._job = await look(self._connection, self.id)
        return self

    async def events(self, timeout: float | None = None) -> AsyncGenerator[Event]:
        """Yield the job's events from its start until it is finished. Raises WaitTimeout.

        For a finished job, the events that the service still stores are repeated, at least the last progress and done.
        When less than 45 s remain, the job is polled, and only progress, waiting and done are yielded.
        """
        follower = AsyncFollower(self._connection, job_path(self.id), timeout, replay=True)
        async with aclosing(follower.events()) as events:
            async for event in events:
                yield event
        self._job = follower.job or self._job

    async def wait(self, timeout: float | None = None, progress: bool = False) -> AsyncJobHandle:
        """Wait until the job is successful, and return the handle.

        Parameters
        ----------
        timeout : float, optional
            Seconds to wait; the job continues after a timeout.
        progress : bool
            Show the progress on a terminal or below a notebook's cell; elsewhere, on stderr, what the job waits
            for longer than 5 s.

        Raises
        ------
        JobFailed, JobDismissed, WaitTimeout
        """
        with Listener(self.process, progress) as listener:
            self._job = await AsyncFollower(self._connection, job_path(self.id), timeout).run(listener)
        _require_success(self._job)
        return self

    async def result(self) -> Result:
        """Fetch the result of a finished job.

        If the service no longer stores the result, it is computed again, and this call waits for it.

        Raises
        ------
        ResultNotReady
            The job is not finished.
        """
        return await fetch(self._connection, self.id)

    async def cancel(self) -> AsyncJobHandle:
        """Dismiss the job, unless it is finished, and return the handle."""
        self._job = Job.read((await self._connection.send("DELETE", job_path(self.id))).content)
        return self


async def submit(connection: AsyncConnection, request: ProcessRequest) -> Job:
    """Submit a request and return its job, a new one or that of an earlier equal request."""
    job = _job_of(await _post(connection, request))
    warn_of([*job.notes, *unstated(request)])
    return job


async def _post(connection: AsyncConnection, request: ProcessRequest, **headers: str) -> httpx2.Response:
    path = f"{API_PREFIX}/{request.operation.process}"
    return await connection.send("POST", path, headers=_JSON | headers, content=_body(request))


def _job_of(response: httpx2.Response) -> Job:
    job = Job.read(response.content)
    if not JOB_ID.fullmatch(job.id):
        raise ProtocolError("the service answered with an invalid job id")
    return job


async def forecast(connection: AsyncConnection, request: ProcessRequest) -> Forecast:
    """Return the expected cost of a request, which is not submitted."""
    path, body = f"{API_PREFIX}/{request.operation.process}/estimate", _body(request)
    found = Forecast.read((await connection.send("POST", path, headers=_JSON, content=body)).content)
    notes = [*found.notes, *unstated(request)]
    warn_of(notes)
    return found.model_copy(update={"notes": notes})


def _body(request: ProcessRequest) -> bytes:
    return json.dumps(canonical(request), separators=(",", ":"), allow_nan=False).encode()


async def look(connection: AsyncConnection, job_id: str) -> Job:
    """Return a job as it is now. Raises NotFound."""
    return Job.read((await connection.send("GET", job_path(job_id))).content)


async def list_jobs(connection: AsyncConnection, selected: Mapping[str, str | None], limit: int) -> list[Job]:
    """Return up to `limit` jobs, newest first, page by page, with these parameters of a list."""
    found: list[Job] = []
    asked = {name: text for name, text in selected.items() if text}
    cursor: str | None = None
    while len(found) < limit:
        params: dict[str, str | int] = {**asked, "limit": min(limit - len(found), 100)}
        if cursor:
            params["cursor"] = cursor
        page = JobList.read((await connection.send("GET", f"{API_PREFIX}/jobs", params=params)).content)
        found.extend(page.jobs)
        # Only the cursor is taken from the link; the address of the service remains the client's.
        next_links = [link.href for link in page.links if link.rel == "next"]
        cursor = parse_qs(urlsplit(next_links[0]).query).get("cursor", [""])[0] if next_links else None
        if not cursor or not page.jobs:
            break
    return found[:limit]


async def answer(connection: AsyncConnection, kind: type[R], request: ProcessRequest, progress: bool) -> R:
    """Submit a request, wait for its job, and return the result, of class `kind`. Raises JobFailed, JobDismissed."""
    with Listener(request.operation.process, progress) as listener:
        prefer = f"wait={PREFER_WAIT}, return=representation"
        response = await _post(connection, request, prefer=prefer, accept=f"{_NPZ_TYPE}, application/json;q=0.5")
        if response.headers.get("content-type") == _NPZ_TYPE:
            warn_of([*notes_on(request), *unstated(request)])
            result = decode_result(response.content)
            _keep(connection, response.headers.get("location", "").rpartition("/")[2], response)
        else:
            job = _job_of(response)
            warn_of([*job.notes, *unstated(request)])
            _require_success(await AsyncFollower(connection, job_path(job.id), job=job).run(listener))
            result = await fetch(connection, job.id, listener)
    if result.process != kind.process:
        raise ProtocolError("the service answered with the result of another process")
    return cast(R, result)


async def answers(
    connection: AsyncConnection, asked: Sequence[ProcessRequest], return_exceptions: bool = False
) -> AsyncGenerator[Result | GrazemapError]:
    """Submit requests together and yield their results in the order of the requests.

    Raises
    ------
    JobFailed, JobDismissed, ServiceProblem
        In place of a result, unless they are to be yielded.
    QueueFull, ServiceUnavailable, ConnectionFailed
        After the last attempt.
    """
    warn_of(_once([note for request in asked for note in (*notes_on(request), *unstated(request))]))
    before = 0
    for bodies in _batches(asked):
        lines: dict[int, dict[str, Any]] = {}
        given = attempt = 0
        while given < len(bodies):
            missing = [index for index in range(given, len(bodies)) if index not in lines]
            failure: ServiceProblem | ConnectionFailed = ConnectionFailed("the answer ended before its last result")
            try:
                async with aclosing(_lines(connection, [bodies[index] for index in missing])) as arriving:
                    async for line in arriving:
                        refused = _refused(line)
                        if refused is not None and refused.problem.status in RETRIED_STATUSES:
                            failure = refused
                        else:
                            lines[missing[_place(line, missing)]], attempt = line, 0
                        while given in lines:
                            outcome = await _outcome(connection, lines.pop(given), return_exceptions)
                            given += 1
                            yield outcome
            except ConnectionFailed as error:
                failure = error
            except ServiceProblem as error:
                if error.problem.status not in RETRIED_STATUSES:
                    raise _placed(error, [before + index for index in missing]) from None
                failure = error
            if given < len(bodies):
                if attempt >= connection.settings.retries:
                    raise failure
                await connection.sleep(pause(attempt))
                attempt += 1
        before += len(bodies)


def _once(notes: Sequence[Note]) -> list[Note]:
    """Return one note of each code, which says how many there are."""
    counts = Counter(note.code for note in notes)
    first = {note.code: note for note in reversed(notes)}
    return [
        note
        if counts[code] == 1
        else note.model_copy(update={"detail": f"{note.detail} ({counts[code]} requests have this note)"})
        for code, note in first.items()
    ]


def _placed(error: ServiceProblem, places: Sequence[int]) -> ServiceProblem:
    """Return the problem of a batch with the places of its requests among all."""
    errors = []
    for one in error.problem.errors:
        pointer = re.sub(r"^/requests/(\d+)", lambda found: f"/requests/{places[int(found[1])]}", one.pointer)
        errors.append(one.model_copy(update={"pointer": pointer}))
    return problem_exception(error.problem.model_copy(update={"errors": errors}))


def _batches(asked: Sequence[ProcessRequest]) -> Iterator[list[bytes]]:
    """Yield the requests as members of a batch, in parts that the service takes."""
    part: list[bytes] = []
    size = 0
    for request in asked:
        body = b'{"process":"%s","request":%s}' % (request.operation.process.encode(), _body(request))
        if part and (len(part) == MOST_OF_BATCH or size + len(body) > BYTES_OF_BATCH):
            yield part
            part, size = [], 0
        part.append(body)
        size += len(body)
    if part:
        yield part


async def _lines(connection: AsyncConnection, bodies: Sequence[bytes]) -> AsyncGenerator[dict[str, Any]]:
    """Yield the lines of the answer to a batch."""
    content, rest = b'{"requests":[%s]}' % b",".join(bodies), b""
    path = f"{API_PREFIX}/batches"
    try:
        async with connection.stream(path, _JSON, BATCH_SILENCE, params={"f": "npz"}, content=content) as response:
            if response.status_code >= 400:
                await response.aread()
                raise problem_of(response)
            async for piece in response.aiter_bytes():
                *whole, rest = (rest + piece).split(b"\n")
                if len(rest) > MOST_OF_LINE:
                    raise ProtocolError("a line of the answer is too long")
                for line in whole:
                    if line:
                        yield json_object(line, "a line of the answer")
    except httpx2.RequestError as error:
        raise failure_of(error) from None


def _place(line: dict[str, Any], missing: Sequence[int]) -> int:
    index = line.get("index")
    if not isinstance(index, int) or not 0 <= index < len(missing):
        raise ProtocolError("a line of the answer belongs to no request")
    return index


def _refused(line: dict[str, Any]) -> ServiceProblem | None:
    """Return why a request was not accepted; None if it has a job."""
    if "id" in line:
        return None
    try:
        return problem_exception(Problem.model_validate(line.get("problem")))
    except ValidationError:
        raise ProtocolError("a line of the answer has neither a job nor a problem") from None


async def _outcome(
    connection: AsyncConnection, line: dict[str, Any], return_exceptions: bool
) -> Result | GrazemapError:
    try:
        return await _result(connection, line)
    except (JobError, ServiceProblem) as error:
        if not return_exceptions:
            raise
        return error


async def _result(connection: AsyncConnection, line: dict[str, Any]) -> Result:
    """Return the result that a line has, or that its job has."""
    refused = _refused(line)
    if refused is not None:
        raise refused
    if isinstance(line.get("npz"), str):
        try:
            return decode_result(b64decode(line["npz"], validate=True))
        except ValueError as error:
            raise ProtocolError("a result of the answer cannot be read") from error
    return await fetch(connection, line["id"])


async def fetch(connection: AsyncConnection, job_id: str, listen: Callable[[Event], None] | None = None) -> Result:
    """Return a job's result; compute it again if it was evicted or is of another version.

    Raises
    ------
    ResultNotReady, JobFailed, JobDismissed
    """
    cache = connection.settings.cache
    cached = cache.read(job_id) if cache else None
    headers = {"if-none-match": cached[0]} if cached else {}
    while True:
        try:
            response = await connection.send("GET", job_path(job_id) + "/result", params={"f": "npz"}, headers=headers)
        except ServiceProblem:
            # A job that was not successful has no result, but a reason.
            _require_success(await look(connection, job_id))
            raise
        if response.status_code == 304 and cached:
            return decode_result(cached[1])
        if response.status_code == 202:
            job = Job.read(response.content)
            _require_success(await AsyncFollower(connection, job_path(job.id)).run(listen))
            if job.id != job_id:  # the result is of another version, and this job computes it again
                return await fetch(connection, job.id, listen)
            continue
        if response.status_code != 200:
            raise ProtocolError(f"unexpected HTTP status {response.status_code} for a result")
        result = decode_result(response.content)
        _keep(connection, job_id, response)
        return result


def _keep(connection: AsyncConnection, job_id: str, response: httpx2.Response) -> None:
    """Keep a result in the folder of the client, if it has one."""
    cache, etag = connection.settings.cache, response.headers.get("etag")
    if cache and etag and JOB_ID.fullmatch(job_id):
        cache.write(job_id, etag, response.content)


def _require_success(job: Job) -> None:
    """Raise JobFailed or JobDismissed unless a job was successful."""
    if job.status == "failed":
        reason = problem_text(job.problem) if job.problem else "no reason given"
        raise JobFailed(f"job {job.id} failed: {reason}", job)
    if job.status == "dismissed":
        raise JobDismissed(f"job {job.id} was dismissed", job)
