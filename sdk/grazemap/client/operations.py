"""What the client does with jobs, as generators of effects: submit, look, cancel, list, fetch the result.

Following a job until it is finished is in `following.py`, one request with its retries in `exchange.py`.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from grazemap.client.cache import ResultCache
from grazemap.client.io_effects import Flow, Reply, Send
from grazemap.client.retry import exchange, read_model, read_object
from grazemap.client.watch import follow
from grazemap.constants import API_PREFIX
from grazemap.errors import JobDismissed, JobFailed, NotFound, ProtocolError, ServiceProblem, problem_text
from grazemap.results import Result, decode_result
from grazemap.wire import Job, JobList, Problem, ProcessRequest, canonical

# The service's own words for the same problem.
_UNKNOWN_JOB = Problem(
    type="urn:grazemap:problem:unknown-job",
    title="Unknown job",
    status=404,
    detail="There is no job with this id.",
)
# Job ids become parts of addresses and of file names in the cache.
_JOB_ID = re.compile(r"[0-9A-Za-z_-]{1,128}")


@dataclass(frozen=True)
class Settings:
    """What all flows of one client share."""

    retries: int
    cache: ResultCache | None


def job_path(job_id: str) -> str:
    """Return a job's address below the base URL. Raises NotFound for what cannot be a job id."""
    if not isinstance(job_id, str) or not _JOB_ID.fullmatch(job_id):
        raise NotFound(_UNKNOWN_JOB)
    return f"{API_PREFIX}/jobs/{job_id}"


def submit(settings: Settings, process: str, request: ProcessRequest, prefer_wait: int = 0) -> Flow[Job]:
    """Ask a question; the job may be one that was there before."""
    headers = {"content-type": "application/json"}
    if prefer_wait:
        headers["prefer"] = f"wait={prefer_wait}"
    body = json.dumps(canonical(request), separators=(",", ":"), allow_nan=False).encode()
    reply: Reply = yield from exchange(
        Send("POST", f"{API_PREFIX}/{process}", headers=headers, body=body), settings.retries
    )
    job = read_model(Job, reply)
    if not _JOB_ID.fullmatch(job.id):
        raise ProtocolError("the service answered with an impossible job id")
    return job


def look(settings: Settings, job_id: str) -> Flow[Job]:
    """Return the job as it is now."""
    return read_model(Job, (yield from exchange(Send("GET", job_path(job_id)), settings.retries)))


def cancel(settings: Settings, job_id: str) -> Flow[Job]:
    """Dismiss a job; a finished one is left as it is."""
    return read_model(Job, (yield from exchange(Send("DELETE", job_path(job_id)), settings.retries)))


def list_jobs(settings: Settings, status: str | None, process: str | None, limit: int) -> Flow[list[Job]]:
    """Return up to `limit` jobs, newest first, page by page."""
    found: list[Job] = []
    asked = {name: text for name, text in (("status", status), ("process", process)) if text}
    cursor: str | None = None
    while len(found) < limit:
        params: dict[str, str | int] = {**asked, "limit": min(limit - len(found), 100)}
        if cursor:
            params["cursor"] = cursor
        page = read_model(
            JobList, (yield from exchange(Send("GET", f"{API_PREFIX}/jobs", params=params), settings.retries))
        )
        found.extend(page.jobs)
        # Only the cursor is taken from the link: the address stays the one the client was given.
        next_links = [link.href for link in page.links if link.rel == "next"]
        cursor = parse_qs(urlsplit(next_links[0]).query).get("cursor", [""])[0] if next_links else None
        if not cursor or not page.jobs:
            break
    return found[:limit]


def describe(settings: Settings) -> Flow[dict[str, object]]:
    """Return what the service says about itself: versions, processes, limits."""
    return read_object((yield from exchange(Send("GET", API_PREFIX), settings.retries)))


def fetch(settings: Settings, job_id: str) -> Flow[Result]:
    """Return a job's result; one that the service has evicted, or of another version, is computed and waited for.

    Raises
    ------
    ResultNotReady, JobFailed, JobDismissed
    """
    path = job_path(job_id) + "/result"
    cached = settings.cache.read(job_id) if settings.cache else None
    headers = {"if-none-match": cached.etag} if cached else {}
    while True:
        try:
            reply: Reply = yield from exchange(Send("GET", path, {"f": "npz"}, headers), settings.retries)
        except ServiceProblem:
            # A job that ended otherwise has no result; the job itself says best why.
            require_success((yield from look(settings, job_id)))
            raise
        if reply.status == 304 and cached:
            return decode_result(cached.data)
        if reply.status == 202:
            # another job when the result is of another version: that one computes it anew
            job = read_model(Job, reply)
            path = job_path(job.id) + "/result"
            headers = {} if job.id != job_id else headers
            yield from follow_to_success(settings, job.id)
            continue
        if reply.status != 200:
            raise ProtocolError(f"unexpected HTTP status {reply.status} for a result")
        result = decode_result(reply.content)
        etag = reply.headers.get("etag")
        if settings.cache and etag:
            settings.cache.write(job_id, etag, reply.content)
        return result


def watch(settings: Settings, job_id: str, timeout: float | None = None, replay: bool = False) -> Flow[Job]:
    """Hand on a job's events until it is finished, however it ends; `replay` as in `follow`. Raises WaitTimeout."""
    return (yield from follow(job_path(job_id), settings.retries, timeout, replay=replay))


def follow_to_success(
    settings: Settings, job_id: str, timeout: float | None = None, job: Job | None = None
) -> Flow[Job]:
    """Follow a job to its end, handing on its events. Raises JobFailed, JobDismissed, WaitTimeout."""
    return require_success((yield from follow(job_path(job_id), settings.retries, timeout, job)))


def require_success(job: Job) -> Job:
    """Return a successful job. Raises JobFailed, JobDismissed."""
    if job.status == "failed":
        reason = problem_text(job.problem) if job.problem else "no reason given"
        raise JobFailed(f"job {job.id} failed: {reason}", job)
    if job.status == "dismissed":
        raise JobDismissed(f"job {job.id} was dismissed", job)
    return job


def answer(settings: Settings, process: str, request: ProcessRequest, prefer_wait: int) -> Flow[Result]:
    """Ask, follow and fetch: the whole way from a question to its result."""
    job = yield from submit(settings, process, request, prefer_wait)
    yield from follow_to_success(settings, job.id, job=job)
    return (yield from fetch(settings, job.id))
