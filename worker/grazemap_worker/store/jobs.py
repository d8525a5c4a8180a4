"""The records of jobs, from submission to end, and the events of jobs.

>>> record = store.jobs.get(job.id)
>>> record.request["horizontal"]["vary"], record.progress.done, record.progress.total
('omega', 0, 1)

`submit.lua` decides whether a job is started, and for which workers; what the values of a submission mean stands at the
head of that script.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from typing import Any

import structlog
from redis.exceptions import RedisError

from grazemap.wire import FINISHED, Estimate, Job, Problem, Status, canonical_id
from grazemap_worker.planning import LANE_WEIGHTS, SHORT_SECONDS, TILE_SECONDS, Plan
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import (
    EXAMINED_AT_ONCE,
    FINGERPRINT_REMEMBERED,
    LISTED_REQUEST_BYTES,
    MAX_LARGE_RECORDS,
    MAX_RECORD_BYTES,
    MAX_SMALL_RECORDS,
    PREFIX,
    SPENT_FACTOR,
    SUBSCRIPTION_SECONDS,
    TILES_KEPT_AFTER_FAILURE,
    job_key,
)
from grazemap_worker.store.problems import OUTDATED_PROBLEM, costly_problem
from grazemap_worker.store.records import (
    ANONYMOUS,
    BacklogFull,
    JobEvent,
    QuotaExceeded,
    Requester,
    Submission,
    WorkerQueue,
)
from grazemap_worker.store.workers import Workers

# The answer of the script that ends a job when other requesters are subscribed to the job.
GOES_ON = 2


class Jobs:
    """The records of jobs, and the events that clients follow."""

    def __init__(self, scripts: Scripts, workers: Workers) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._workers = workers

    def submit(
        self,
        submissions: Sequence[Submission],
        core_version: str,
        max_pending_tiles: int,
        requester: Requester = ANONYMOUS,
        max_seconds: float | None = None,
    ) -> list[tuple[Job, WorkerQueue | None] | BacklogFull | RedisError]:
        """Start the jobs of requests, unless they exist already; all commands are sent to Redis together.

        A job ends when its processor time exceeds both `max_seconds` and `SPENT_FACTOR` times its estimate.

        Returns
        -------
        list
            For each request a pair (job, queue), or an error if nothing was stored. The id of the job is the hash of
            process, core version and canonical request.

            - (job, queue): the job is new, or was started again after it had failed, had been dismissed, or had lost
              its result. The workers of this queue are to be woken.
            - (job, None): the job is waiting or running, or has its result.
            - `BacklogFull`: the unfinished tiles of all jobs would be more than `max_pending_tiles`, or the bytes of
              all requests more than `MAX_RECORD_BYTES`.
            - `QuotaExceeded`: the unfinished tiles of this requester would be more than its limit.
            - The `RedisError` of the script.
        """
        # an "asker" of the scripts is a requester, its "interest" the seconds of its subscription to a job
        share = requester.weight * 2.0 ** (requester.priority - ANONYMOUS.priority)
        common = {
            "core_version": core_version,
            "asker": requester.name,
            "priority": requester.priority,
            "most_tiles": max_pending_tiles,
            "asker_tiles": requester.max_tiles,
            "most_small": MAX_SMALL_RECORDS,
            "most_large": MAX_LARGE_RECORDS,
            "most_bytes": MAX_RECORD_BYTES,
            "interest": SUBSCRIPTION_SECONDS,
            "group": requester.group,
        }
        calls = []
        for process, request, plan, kernels in submissions:
            values, estimate = request.canonical(), plan.estimate
            text = json.dumps(values, separators=(",", ":")).encode()
            arguments = {
                "id": canonical_id(process, values, core_version),
                "process": process,
                "estimate": estimate.model_dump_json(),
                "tiles": plan.tile_count,
                "after": plan.after,
                "lane": plan.lane,
                "long_tiles": plan.tile_seconds > SHORT_SECONDS,
                "kernels": kernels,
                "weights": {lane: share * factor for lane, factor in LANE_WEIGHTS.items()},
                "cost": plan.tile_seconds,
                "most_seconds": max_seconds and max(max_seconds, SPENT_FACTOR * estimate.seconds),
            }
            calls.append(((text, plan.model_dump_json(exclude={"estimate"}).encode()), common | arguments))
        workers = cache(lambda: max(1, len(self._workers.live())))  # read once, and only after a refusal
        outcomes: list[tuple[Job, WorkerQueue | None] | BacklogFull | RedisError] = []
        answers = self._scripts.run_each("submit", calls)
        for submission, (_, arguments), answer in zip(submissions, calls, answers, strict=True):
            if isinstance(answer, RedisError):
                outcomes.append(answer)
            elif answer[0] in (b"full", b"quota"):
                max_tiles = (requester.max_tiles or 0) if answer[0] == b"quota" else max_pending_tiles
                wait = math.ceil((answer[1] + submission.plan.tile_count - max_tiles) * TILE_SECONDS / workers())
                error = QuotaExceeded if answer[0] == b"quota" else BacklogFull
                outcomes.append(error(retry_after=min(120, max(1, wait))))
            elif (job := self._job_from_answer(str(arguments["id"]), answer[1])) is None:
                # its record could not be read, and was removed
                outcomes += self.submit([submission], core_version, max_pending_tiles, requester, max_seconds)
            elif answer[0] == b"started":
                record = answer[1][0]  # name, value, name, value, ...
                fingerprint = dict(zip(record[::2], record[1::2], strict=True))[b"fingerprint"]
                outcomes.append((job, WorkerQueue(fingerprint.decode(), arguments["lane"] == "small")))
            else:
                outcomes.append((job, None))
        return outcomes

    def get(self, job_id: str, requester: str = "", *, with_request: bool = True) -> Job | None:
        """Return a job, or None if there is none with this id; renew the requester's subscription to it."""
        max_bytes = None if with_request else 0  # of the request
        answer = self._scripts.run("look", id=job_id, asker=requester, interest=SUBSCRIPTION_SECONDS, longest=max_bytes)
        return None if answer is None else self._job_from_answer(job_id, answer)

    def _job_from_answer(self, job_id: str, answer: Sequence[Any]) -> Job | None:
        """Return a job with the reason why it waits, from the answer of a script; None if its record cannot be read."""
        record, workers, unfinished, starting, compiling = answer
        job = self._read(job_id, record)
        if job is None or job.status in FINISHED:
            return job
        waiting_for: str | None = None
        if not workers:
            waiting_for = f"a worker; none is ready{f': {starting.decode()}' if starting else ''}"
        elif job.status == "accepted" and compiling:
            waiting_for = compiling.decode()
        elif job.status == "accepted" and unfinished > 1:
            count = unfinished - 1
            waiting_for = f"a free worker; {count} other {'job is' if count == 1 else 'jobs are'} unfinished"
        return job.model_copy(update={"waiting_for": waiting_for})

    def status(self, job_id: str) -> Status | None:
        """Return the status of a job, without reading its record; None if there is no such job."""
        value = self._redis.hget(job_key(job_id), "status")
        return value.decode() if value else None

    def page(
        self,
        status: Status | None = None,
        process: str | None = None,
        limit: int = 50,
        cursor: str | None = None,
        group: str | None = None,
        small: bool | None = None,
    ) -> tuple[list[Job], str | None]:
        """Return a page of jobs, newest first, and the cursor of the next page, which is None after the last page.

        Jobs that are submitted between two calls do not change the following pages. Requests over
        `LISTED_REQUEST_BYTES` are left out (None). Small jobs have one tile that takes milliseconds. A script looks at
        `EXAMINED_AT_ONCE` jobs at most, so that it does not delay other commands when few of many jobs are selected.
        """
        selection = {
            "index": f"{PREFIX}status:{status}" if status else f"{PREFIX}jobs",
            "process": process or "",
            "group": group or "",
            "class_": "" if small is None else "small" if small else "large",
            "longest": LISTED_REQUEST_BYTES,
            "examined": EXAMINED_AT_ONCE,
        }
        page: list[Any] = []
        before: str | None = f"({cursor}" if cursor else "+inf"
        while before and len(page) <= limit:
            listed, last = self._scripts.run("page", before=before, most=limit + 1 - len(page), **selection)
            page += listed
            before = last and f"({last.decode()}"
        jobs = [self._read(job_id.decode(), record) for job_id, _, record in page[:limit]]
        following = page[limit - 1][1].decode() if len(page) > limit else None
        return [job for job in jobs if job is not None], following

    def dismiss(self, job_id: str, requester: str = ANONYMOUS.name, *, everyone: bool = False) -> bool:
        """Remove a requester's subscription to an unfinished job; end the job when no subscription is left.

        With `everyone`, the job ends in any case. Its tiles are removed when it ends. A finished job is not changed.
        Returns whether the job goes on for other requesters.
        """
        return int(self._scripts.run("end", id=job_id, asker=requester, everyone=everyone)) == GOES_ON

    def fail(self, job_id: str, problem: Problem) -> bool:
        """End an unfinished job with a problem, and keep its finished tiles. Returns whether this call ended it."""
        text = problem.model_dump_json()
        return bool(self._scripts.run("end", id=job_id, problem=text, kept=TILES_KEPT_AFTER_FAILURE))

    def end_costly(self, job_id: str) -> None:
        """End a job whose processor time exceeds its limit, as the caller has found.

        The stored time lacks that of the unfinished tile, so at least the limit is reported.
        """
        names = ("estimate", "cpu_seconds", "most_seconds")
        estimate, spent, limit = self._redis.hmget(job_key(job_id), *names)
        if limit is not None:
            seconds = Estimate.model_validate_json(estimate).seconds
            self.fail(job_id, costly_problem(seconds, max(float(spent or 0.0), float(limit)), float(limit)))

    def progress(self, job_id: str, done: int, total: int) -> bool:
        """Store the progress of a job that counts steps. Returns whether the job is still unfinished.

        The stored progress never decreases, and is complete only when the result is stored.
        """
        return bool(self._scripts.run("progress", id=job_id, done=done, total=total))

    def events(self, job_id: str, after: str = "0", limit: int = 500) -> list[JobEvent]:
        """Return the events after an id, oldest first, without waiting for further ones."""
        entries = self._redis.xrange(job_key(job_id, "events"), min=f"({after}", count=limit)
        return [JobEvent(key.decode(), fields[b"name"].decode(), fields[b"data"].decode()) for key, fields in entries]

    def some_unfinished(self, cursor: int, count: int) -> tuple[int, list[str]]:
        """Return the next cursor and roughly `count` ids of unfinished jobs; all passes begin and end at cursor 0."""
        following, entries = self._redis.hscan(f"{PREFIX}unfinished", cursor, count=count)
        return int(following), [job_id.decode() for job_id in entries]

    def bind(self, fingerprint: str, core_version: str, job_ids: Collection[str]) -> list[str]:
        """Bind jobs of a core version to a fingerprint; return the ids of those that were bound.

        A job is bound if it has no fingerprint, or a fingerprint that no worker has had for `FINGERPRINT_REMEMBERED`
        seconds. A job of another core version that no worker has had for this time fails.
        """
        bound, outdated = self._scripts.run(
            "bind",
            fingerprint=fingerprint,
            core_version=core_version,
            remembered=FINGERPRINT_REMEMBERED,
            ids=list(job_ids),
        )
        for job_id in outdated:
            self.fail(job_id.decode(), OUTDATED_PROBLEM)
        return [job_id.decode() for job_id in bound]

    def _read(self, job_id: str, record: Sequence[bytes]) -> Job | None:
        """Return the job of a record. Forget a record that cannot be read, so that its request can be posted again."""
        try:
            return _read_job(job_id, dict(zip(record[::2], record[1::2], strict=True)))
        except (ValueError, LookupError, TypeError, OverflowError):
            self.forget_unreadable(job_id)
            return None

    def forget_unreadable(self, job_id: str) -> None:
        """Forget a job whose record cannot be read, and log the exception that is being handled."""
        structlog.get_logger("grazemap_worker").exception("job with an unreadable record forgotten", job_id=job_id)
        self._scripts.run("forget", id=job_id)

    def plan_of(self, job_id: str) -> Plan | None:
        """Return the plan of a job, or None if there is no such job."""
        plan, estimate = self._redis.hmget(job_key(job_id), "plan", "estimate")
        return plan_from_record(plan.decode(), estimate.decode()) if plan else None


def plan_from_record(plan: str, estimate: str) -> Plan:
    """Return the plan of a job from the fields `plan` and `estimate` of its record, both JSON."""
    return Plan.model_validate_json(plan).model_copy(update={"estimate": Estimate.model_validate_json(estimate)})


def _read_job(job_id: str, record: Mapping[bytes, bytes]) -> Job:
    """Return the job of a record, without links, which the service adds."""
    fields: dict[str, Any] = {name.decode(): value.decode() for name, value in record.items()}
    steps = "steps_" if fields["unit"] == "steps" else ""
    return Job.model_validate(
        {
            **fields,
            "id": job_id,
            "request": json.loads(fields["request"]) if "request" in fields else None,
            "progress": {
                "done": fields.get(f"{steps}done", 0),
                "total": fields.get(f"{steps}total", 1),
                "unit": fields["unit"],
                "eta_seconds": fields.get("eta"),
            },
            "estimate": json.loads(fields["estimate"]),
            "groups": [name for name in fields.get("groups", "").split("|") if name],
            **{name: _timestamp(fields.get(name)) for name in ("created", "started", "finished")},
            "problem": json.loads(fields["problem"]) if "problem" in fields else None,
        }
    )


def _timestamp(seconds: str | None) -> str | None:
    """Return seconds since the epoch as ISO 8601 in UTC."""
    if seconds is None:
        return None
    return datetime.fromtimestamp(float(seconds), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
