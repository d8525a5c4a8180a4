"""Job records: submitting, reading, listing, binding, ending; their events."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from datetime import UTC, datetime

from grazemap.wire import FINISHED, Estimate, Job, Problem, ProcessRequest, Progress, Status, canonical, canonical_id
from grazemap_worker.planning import TILE_SECONDS, Plan
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import (
    ASSEMBLY,
    FINGERPRINT_REMEMBERED,
    LISTED_REQUEST_BYTES,
    MOST_RECORD_BYTES,
    MOST_RECORDS,
    PREFIX,
    TILES_KEPT_AFTER_FAILURE,
    job_key,
)
from grazemap_worker.store.problems import outdated_problem
from grazemap_worker.store.records import Event, QueueFull
from grazemap_worker.store.workers import Workers

_JOBS_A_SCRIPT = 500
_WAITING_SECONDS = 5
_UNFINISHED: tuple[Status, ...] = ("accepted", "running")
_EVENT_ID = re.compile(r"\d{1,19}(-\d{1,19})?", re.ASCII)


class Jobs:
    """The records of jobs, and the events that clients follow."""

    def __init__(self, scripts: Scripts, workers: Workers) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._workers = workers

    def submit(
        self, process: str, request: ProcessRequest, core_version: str, plan: Plan, max_pending_tiles: int
    ) -> tuple[Job, bool]:
        """Start the job of a request, unless it exists already.

        Returns
        -------
        job : Job
            Its id is the hash of process, core version and canonical request.
        created : bool
            Whether the caller has to queue the tiles: the job is new, or was started again after it had failed, was
            dismissed or had lost its result.

        Raises
        ------
        QueueFull
            The unfinished tiles of all jobs would be more than `max_pending_tiles`, or their requests more than
            `MOST_RECORD_BYTES`; nothing was stored.
        """
        values = canonical(request)
        identity = canonical_id(process, values, core_version)
        live = self._workers.live()
        fingerprint = _most_common(worker.fingerprint for worker in live if worker.core_version == core_version)
        answer = self._scripts.run(
            "submit",
            identity,
            process,
            json.dumps(values, separators=(",", ":")),
            core_version,
            plan.model_dump_json(exclude={"estimate"}),
            plan.estimate.model_dump_json(),
            plan.count,
            max_pending_tiles,
            fingerprint,
            MOST_RECORDS,
            MOST_RECORD_BYTES,
            plan.after,
        )
        if answer[0] == 2:
            excess = answer[1] + plan.count - max_pending_tiles
            wait = math.ceil(excess * TILE_SECONDS / max(1, len(live)))
            raise QueueFull(retry_after=min(120, max(1, wait)))
        job = self.get(identity)
        if job is None:
            # forgotten between the two steps: more than MOST_RECORDS are submitted at once
            raise QueueFull(retry_after=1)
        return job, answer[0] == 1

    def get(self, identity: str) -> Job | None:
        """Return a job, or None when there is none of this id."""
        fields = self._redis.hgetall(job_key(identity))
        if not fields:
            return None
        job = _read_job(identity, fields)
        if job.status in FINISHED:
            return job
        return job.model_copy(update={"waiting_for": self.waiting_for(identity)})

    def status(self, identity: str) -> Status | None:
        """Return the status of a job without reading the rest of it, or None when there is no such job."""
        value = self._redis.hget(job_key(identity), "status")
        return value.decode() if value else None

    def fingerprint_of(self, identity: str) -> str | None:
        """Return the fingerprint that a job is bound to; None if it is not bound yet, or does not exist."""
        value = self._redis.hget(job_key(identity), "fingerprint")
        return value.decode() or None if value else None

    def page(
        self,
        status: Status | None = None,
        process: str | None = None,
        limit: int = 50,
        cursor: str | None = None,
    ) -> tuple[list[Job], str | None]:
        """Return one page of jobs, newest first, and the cursor of the next page (None: this is the last one).

        Jobs that are submitted between two pages do not move the pages after them. Requests over
        `LISTED_REQUEST_BYTES` are left out (None).

        Raises
        ------
        ValueError
            The cursor is not valid.
        """
        if cursor is not None and not (cursor.isascii() and cursor.isdigit() and len(cursor) < 19):
            raise ValueError("not a cursor of a job list")
        index = f"{PREFIX}status:{status}" if status else f"{PREFIX}jobs"
        before = f"({cursor}" if cursor else "+inf"
        page = self._scripts.run("page", index, before, limit + 1, process or "", LISTED_REQUEST_BYTES)
        found = [
            _read_job(identity.decode(), dict(zip(fields[::2], fields[1::2], strict=True)))
            for identity, _, fields in page[:limit]
        ]
        return found, page[limit - 1][1].decode() if len(page) > limit else None

    def dismiss(self, identity: str) -> Job | None:
        """End an unfinished job and free its tiles; leave a finished one as it is. None: no such job."""
        self._scripts.run("dismiss", identity)
        return self.get(identity)

    def fail(self, identity: str, problem: Problem) -> bool:
        """End an unfinished job with a problem, keeping its finished tiles. Returns whether this call ended it."""
        text = problem.model_dump_json()
        return bool(self._scripts.run("fail", identity, text, TILES_KEPT_AFTER_FAILURE))

    def progress(self, identity: str, done: int, total: int, unit: str = "steps") -> bool:
        """Store the progress of a job whose steps are counted. Returns whether it is still wanted.

        The progress that clients see never decreases, and is complete only with the result.
        """
        return bool(self._scripts.run("progress", identity, done, total, unit, ASSEMBLY))

    def wanted(self, identity: str) -> bool:
        """Return whether a job is accepted or running."""
        return bool(self._redis.hexists(f"{PREFIX}unfinished", identity))

    def say_waiting(self, identity: str, text: str) -> None:
        """Store for a few seconds what a job that a worker holds waits for; empty: nothing."""
        key = job_key(identity, "waiting")
        if text:
            self._redis.set(key, text.encode(), ex=_WAITING_SECONDS)
        else:
            self._redis.delete(key)

    def waiting_for(self, identity: str) -> str | None:
        """Return what an unfinished job waits for; None for one that is computed, is finished, or does not exist."""
        said: bytes | None = self._redis.get(job_key(identity, "waiting"))
        status, sequence = self._redis.hmget(job_key(identity), "status", "seq")
        if status not in (b"accepted", b"running"):
            return None
        if said:
            return said.decode()
        if not self._workers.live():
            return f"a worker; none is ready{f': {starting}' if (starting := self._workers.starting()) else ''}"
        if status == b"running":
            return None
        before = sum(self._redis.zcount(f"{PREFIX}status:{name}", "-inf", f"({int(sequence)}") for name in _UNFINISHED)
        return f"a free worker, after {before} {'job' if before == 1 else 'jobs'} submitted before" if before else None

    def events(self, identity: str, after: str = "0", limit: int = 500) -> list[Event]:
        """Return the events after an id, oldest first; does not wait for any.

        Raises
        ------
        ValueError
            `after` is not an event's id.
        """
        if not _EVENT_ID.fullmatch(after):
            raise ValueError("not the id of an event")
        entries = self._redis.xrange(job_key(identity, "events"), min=f"({after}", count=limit)
        return [Event(key.decode(), fields[b"name"].decode(), json.loads(fields[b"data"])) for key, fields in entries]

    def unfinished(self) -> dict[str, int]:
        """Return the tiles that remain for each accepted or running job."""
        remaining = self._redis.hgetall(f"{PREFIX}unfinished")
        return {identity.decode(): int(count) for identity, count in remaining.items()}

    def some_unfinished(self, cursor: int, about: int) -> tuple[int, list[str]]:
        """Return the next cursor and roughly `about` unfinished jobs; cursor 0 begins and ends a pass over all."""
        after, found = self._redis.hscan(f"{PREFIX}unfinished", cursor, count=about)
        return int(after), [identity.decode() for identity in found]

    def bind(self, fingerprint: str, core_version: str, identities: Collection[str] | None = None) -> list[str]:
        """Bind to `fingerprint` the jobs of a core version whose numerics no live worker has; return their ids.

        A job of another core version that no worker had for `FINGERPRINT_REMEMBERED` seconds fails. Without
        `identities` all unfinished jobs are checked.
        """
        bound: list[str] = []
        for some in in_chunks(self.unfinished() if identities is None else identities):
            found, outdated = self._scripts.run("bind", fingerprint, core_version, FINGERPRINT_REMEMBERED, *some)
            bound += [identity.decode() for identity in found]
            for identity in outdated:
                self.fail(identity.decode(), outdated_problem())
        return bound

    def plan_of(self, identity: str) -> Plan | None:
        """Return how a job is cut into tiles, or None when there is no such job."""
        plan, estimate = self._redis.hmget(job_key(identity), "plan", "estimate")
        return read_plan(plan.decode(), estimate.decode()) if plan else None


def in_chunks(identities: Iterable[str]) -> Iterator[list[str]]:
    """Yield ids in chunks that are small enough for a short script."""
    everything = list(identities)
    for start in range(0, len(everything), _JOBS_A_SCRIPT):
        yield everything[start : start + _JOBS_A_SCRIPT]


def read_plan(plan: str, estimate: str) -> Plan:
    """Return a plan from the two fields of a record that hold it."""
    return Plan.model_validate_json(plan).model_copy(update={"estimate": Estimate.model_validate_json(estimate)})


def _read_job(job_id: str, record: Mapping[bytes, bytes]) -> Job:
    """Return the job that a record describes, without links, which the service adds."""
    fields = {name.decode(): value.decode() for name, value in record.items()}
    steps = fields["unit"] == "steps"
    eta, spent = fields.get("eta"), fields.get("cpu_seconds")
    problem = fields.get("problem")
    return Job.model_validate(
        {
            "id": job_id,
            "process": fields["process"],
            "request": json.loads(fields["request"]) if "request" in fields else None,
            "status": fields["status"],
            "progress": Progress(
                done=int(fields.get("steps_done" if steps else "done", 0)),
                total=int(fields.get("steps_total" if steps else "total", 1)),
                unit=fields["unit"],
                eta_seconds=float(eta) if eta is not None else None,
            ),
            "estimate": Estimate.model_validate_json(fields["estimate"]),
            "cpu_seconds": float(spent) if spent is not None else None,
            "core_version": fields["core_version"],
            **{name: _timestamp(fields.get(name)) for name in ("created", "started", "finished")},
            "problem": Problem.model_validate_json(problem) if problem else None,
        }
    )


def _timestamp(seconds: str | None) -> str | None:
    """Return seconds since the epoch as ISO 8601 in UTC."""
    if seconds is None:
        return None
    return datetime.fromtimestamp(float(seconds), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _most_common(fingerprints: Iterator[str]) -> str:
    counts = Counter(fingerprints)
    return min(counts, key=lambda name: (-counts[name], name), default="")
