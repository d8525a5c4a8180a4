"""Jobs of a service: submitting and listing them, fetching their results, and the handle of a job."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import aclosing
from typing import Any, TypeVar, cast
from urllib.parse import parse_qs, urlsplit

import httpx2

from grazemap.client import messages
from grazemap.client.connection import AsyncConnection, final
from grazemap.client.events import Event
from grazemap.client.http import failure_of, job_path, json_object, pause, problem_of
from grazemap.client.progress import ProgressListener
from grazemap.client.watch import Follower
from grazemap.constants import (
    API_PREFIX,
    BATCH_SILENCE,
    MAX_LINE_BYTES,
    MAX_RETRY_AFTER,
    PREFER_WAIT,
    RETRIED_STATUSES,
)
from grazemap.errors import (
    ConnectionFailed,
    GrazemapError,
    JobError,
    NotFound,
    ProtocolError,
    ServiceProblem,
    problem_text,
)
from grazemap.results import Result, decode_result, html
from grazemap.wire import (
    Forecast,
    Job,
    JobList,
    Problem,
    ProcessRequest,
    Progress,
    Status,
    notes_on,
    unstated,
)
from grazemap.wire.notes import GOES_ON

R = TypeVar("R", bound=Result)
_JSON = {"content-type": "application/json"}
_NPZ_TYPE = "application/x-npz"


class AsyncJobHandle:
    """A job of a client (`AsyncClient`), in its last known state; `refresh` and `wait` update it."""

    def __init__(self, connection: AsyncConnection, job: Job, request: ProcessRequest | None = None) -> None:
        self._connection = connection
        self._job = job
        self._request = request  # to submit it again if the service loses the job; None: not from this client

    @property
    def id(self) -> str:
        """The content-addressed id: equal requests to the same version of the core have the same id."""
        return self._job.id

    @property
    def process(self) -> str:
        """Name of the process, for example "unfolding-maps"."""
        return self._job.process

    @property
    def request(self) -> dict[str, Any] | None:
        """The canonical request, with all defaults; None if a list of jobs left it out as too long: call `refresh`."""
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
        self._job = await fetch_job(self._connection, self.id)
        return self

    async def events(self, timeout: float | None = None) -> AsyncGenerator[Event]:
        """Yield the job's events from its start until it is finished. Raises WaitTimeout.

        For a finished job, the events that the service still stores are repeated, at least the last progress and done.
        When less than 45 s remain, the job is polled, and only progress, waiting and done are yielded.
        """
        follower = Follower(self._connection, job_path(self.id), timeout, self._job, replay=True, stale=True)
        try:
            async with aclosing(follower.events()) as events:
                async for event in events:
                    yield event
        finally:
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

        If the service has lost the job, and this client had submitted it, the request is submitted once more.

        Raises
        ------
        JobFailed, JobDismissed, WaitTimeout
        """
        now = self._connection.now
        deadline = None if timeout is None else now() + timeout
        with messages.saying_what_goes_on(self.id), ProgressListener(self.process, progress) as listener:
            try:
                await self._follow(timeout, listener)
            except NotFound as error:
                await self._submit_again(error)
                await self._follow(None if deadline is None else max(0.0, deadline - now()), listener)
        messages.require_success(self._job)
        return self

    async def _follow(
        self, timeout: float | None = None, listen: Callable[[Event], None] | None = None, stale: bool = True
    ) -> None:
        """Follow the job to its end; the handle has what was last seen of it, also where that fails."""
        follower = Follower(self._connection, job_path(self.id), timeout, self._job, stale=stale)
        try:
            await follower.run(listen)
        finally:
            self._job = follower.job or self._job

    async def result(self) -> Result:
        """Fetch the result of a finished job.

        If the service no longer stores the result, the result is computed again, and this call waits for it. The same
        holds if the service has lost the job, provided that this client had submitted it.

        Raises
        ------
        ResultNotReady
            The job is not finished.
        """
        try:
            return await self._fetch_result()
        except NotFound as error:
            await self._submit_again(error)
        await self._follow(stale=False)
        messages.require_success(self._job)
        return await self._fetch_result()

    async def _fetch_result(self) -> Result:
        try:
            return await fetch_result(self._connection, self.id)
        except JobError as error:
            if error.job.id == self.id:
                self._job = error.job
            raise

    async def _submit_again(self, error: NotFound) -> None:
        """Submit the request again if the service has lost the job; otherwise raise the error."""
        if self._request is None or not messages.is_lost(error):
            raise error
        self._job = await submit(self._connection, self._request)

    async def cancel(self) -> AsyncJobHandle:
        """Dismiss the job, unless it is finished, and return the handle.

        A job that others asked for too goes on; a warning says so.
        """
        self._job = Job.read((await self._connection.send("DELETE", job_path(self.id))).content)
        messages.warn_about([note for note in self._job.notes if note.code == GOES_ON])
        return self


async def submit(connection: AsyncConnection, request: ProcessRequest) -> Job:
    """Submit a request and return its job: a new job, or the job of an earlier equal request."""
    return messages.job_of(await _post(connection, request), request)


async def _post(
    connection: AsyncConnection, request: ProcessRequest, below: str = "", **headers: str
) -> httpx2.Response:
    path = f"{API_PREFIX}/{request.operation.process}{below}"
    return await connection.send("POST", path, headers=_JSON | headers, content=_body(request))


async def forecast(connection: AsyncConnection, request: ProcessRequest) -> Forecast:
    """Return the expected cost of a request, which is not submitted."""
    estimate = Forecast.read((await _post(connection, request, "/estimate")).content)
    notes = [*estimate.notes, *unstated(request)]
    messages.warn_about(notes)
    return estimate.model_copy(update={"notes": notes})


def _body(request: ProcessRequest) -> bytes:
    return json.dumps(request.canonical(), separators=(",", ":"), allow_nan=False).encode()


def _batch_member(request: ProcessRequest) -> bytes:
    return b'{"process":"%s","request":%s}' % (request.operation.process.encode(), _body(request))


async def fetch_job(connection: AsyncConnection, job_id: str) -> Job:
    """Return a job as it is now. Raises NotFound."""
    return Job.read((await connection.send("GET", job_path(job_id))).content)


async def list_jobs(connection: AsyncConnection, selected: Mapping[str, str | None], limit: int) -> list[Job]:
    """Return up to `limit` jobs, newest first, with the query parameters `selected`. They are read page by page."""
    jobs: list[Job] = []
    filters = {name: text for name, text in selected.items() if text}
    cursor: str | None = None
    while len(jobs) < limit:
        params: dict[str, str | int] = {**filters, "limit": min(limit - len(jobs), 100)}
        if cursor:
            params["cursor"] = cursor
        page = JobList.read((await connection.send("GET", f"{API_PREFIX}/jobs", params=params)).content)
        jobs.extend(page.jobs)
        # Only the cursor is taken from the link; the address of the service remains the client's.
        next_links = [link.href for link in page.links if link.rel == "next"]
        cursor = parse_qs(urlsplit(next_links[0]).query).get("cursor", [""])[0] if next_links else None
        if not cursor or not page.jobs:
            break
    return jobs[:limit]


async def compute(connection: AsyncConnection, kind: type[R], request: ProcessRequest, progress: bool) -> R:
    """Submit a request, wait for its job, and return the result, of class `kind`. Raises JobFailed, JobDismissed."""
    with ProgressListener(request.operation.process, progress) as listener:
        try:
            result = await _compute(connection, request, listener)
        except NotFound as error:
            if not messages.is_lost(error):
                raise
            result = await _compute(connection, request, listener)
    if result.process != kind.process:
        raise ProtocolError("the service answered with the result of another process")
    return cast(R, result)


async def _compute(
    connection: AsyncConnection, request: ProcessRequest, listen: Callable[[Event], None] | None = None
) -> Result:
    """Submit a request, wait for its job, and return the result; with a cache, that of the cache if it has it."""
    wait = PREFER_WAIT if connection.settings.timeout > 2 * PREFER_WAIT else 0
    prefer = f"wait={wait}" if connection.settings.cache else f"wait={wait}, return=representation"
    response = await _post(connection, request, prefer=prefer, accept=f"{_NPZ_TYPE}, application/json;q=0.5")
    if response.headers.get("content-type") == _NPZ_TYPE:
        messages.warn_about([*notes_on(request), *unstated(request)])
        return await _read(connection, response.content)
    job = messages.job_of(response, request)
    with messages.saying_what_goes_on(job.id):
        messages.require_success(await Follower(connection, job_path(job.id), job=job).run(listen))
        return await fetch_result(connection, job.id, listen)


async def _read(connection: AsyncConnection, data: bytes) -> Result:
    """Return the result in npz, and issue its notes."""
    result = await connection.work(decode_result, data, connection.settings.base_url)
    messages.announce(result)
    return result


async def compute_many(
    connection: AsyncConnection, requests: Sequence[ProcessRequest], return_exceptions: bool = False
) -> AsyncGenerator[Result | GrazemapError]:
    """Submit requests together and yield their results in the order of the requests.

    Raises
    ------
    JobFailed, JobDismissed, ServiceProblem
        In place of a result, unless exceptions are yielded.
    QueueFull, ServiceUnavailable, ConnectionFailed
        After the last attempt.
    """
    offset = 0
    for bodies in messages.batches(map(_batch_member, requests)):
        # the notes on a request of many masses take as long as computing some requests
        notes = await connection.work(messages.notes_on_all, requests[offset : offset + len(bodies)])
        messages.warn_about(notes)
        lines: dict[int, dict[str, Any]] = {}
        yielded = attempt = 0
        while yielded < len(bodies):
            missing = [index for index in range(yielded, len(bodies)) if index not in lines]
            failure: ServiceProblem | ConnectionFailed = ConnectionFailed("the answer ended before its last result")
            try:
                with messages.saying_what_goes_on():
                    async with aclosing(_lines(connection, [bodies[index] for index in missing])) as arriving:
                        async for line in arriving:
                            refused = messages.refusal_of(line)
                            if refused is not None and refused.problem.status in RETRIED_STATUSES:
                                failure = refused
                            else:
                                lines[missing[messages.request_index(line, missing)]], attempt = line, 0
                            while yielded in lines:
                                request = requests[offset + yielded]
                                outcome = await _outcome(connection, request, lines.pop(yielded), return_exceptions)
                                yielded += 1
                                yield outcome
            except ConnectionFailed as error:
                failure = error
            except ServiceProblem as error:
                if error.problem.status not in RETRIED_STATUSES:
                    raise messages.renumbered_problem(error, [offset + index for index in missing]) from None
                failure = error
            if yielded < len(bodies):
                if attempt >= connection.settings.retries:
                    raise failure
                asked = (failure.retry_after if isinstance(failure, ServiceProblem) else None) or 0.0
                if asked > MAX_RETRY_AFTER:
                    raise failure
                await connection.sleep(pause(attempt) + asked)
                attempt += 1
        offset += len(bodies)


async def _lines(connection: AsyncConnection, bodies: Sequence[bytes]) -> AsyncGenerator[dict[str, Any]]:
    """Yield the lines of the answer to a batch."""
    content, rest = b'{"requests":[%s]}' % b",".join(bodies), b""
    path = f"{API_PREFIX}/batches"
    try:
        async with connection.stream(path, _JSON, BATCH_SILENCE, params={"f": "npz"}, content=content) as response:
            if response.status_code >= 400:
                await response.aread()
                raise problem_of(response)
            final(response)
            async for piece in response.aiter_bytes():
                *whole, rest = (rest + piece).split(b"\n")
                if len(rest) > MAX_LINE_BYTES:
                    raise ProtocolError("a line of the answer is too long")
                for line in whole:
                    if line:
                        yield json_object(line, "a line of the answer")
    except httpx2.RequestError as error:
        raise failure_of(error) from None


async def _outcome(
    connection: AsyncConnection, request: ProcessRequest, line: dict[str, Any], return_exceptions: bool
) -> Result | GrazemapError:
    try:
        try:
            return await _result(connection, line)
        except NotFound as error:
            if not messages.is_lost(error):
                raise
            return await _compute(connection, request)
    except (JobError, ServiceProblem) as error:
        if not return_exceptions:
            raise
        return error


async def _result(connection: AsyncConnection, line: dict[str, Any]) -> Result:
    """Return the result in a line of the answer to a batch, or else the result of its job."""
    refused = messages.refusal_of(line)
    if refused is not None:
        raise refused
    if isinstance(line.get("npz"), str):
        try:
            return await _read(connection, b64decode(line["npz"], validate=True))
        except ValueError as error:
            raise ProtocolError("a result of the answer cannot be read") from error
    return await fetch_result(connection, line["id"])


async def fetch_result(
    connection: AsyncConnection, job_id: str, listen: Callable[[Event], None] | None = None
) -> Result:
    """Return the result of a job; wait for it to be computed again if it was evicted, or is of another version.

    Raises
    ------
    ResultNotReady, JobFailed, JobDismissed
    """
    cache = connection.settings.cache
    cached = await connection.work(cache.read, job_id) if cache else None
    headers = {"if-none-match": cached[0]} if cached else {}
    while True:
        try:
            response = await connection.send("GET", job_path(job_id) + "/result", params={"f": "npz"}, headers=headers)
        except ServiceProblem:
            # A job that was not successful has a reason, which is raised instead.
            messages.require_success(await fetch_job(connection, job_id))
            raise
        if response.status_code == 304 and cached:
            return await _read(connection, cached[1])
        if response.status_code == 202:
            job = Job.read(response.content)
            messages.require_success(await Follower(connection, job_path(job.id)).run(listen))
            if job.id != job_id:  # the result is of another version, and this new job computes it again
                return await fetch_result(connection, job.id, listen)
            continue
        if response.status_code != 200:
            raise ProtocolError(f"unexpected HTTP status {response.status_code} for a result")
        result = await _read(connection, response.content)
        if cache and (etag := response.headers.get("etag")):
            await connection.work(cache.write, job_id, etag, response.content)
        return result
