"""The ledger of tiles, and the results: what workers claim and commit.

The ledger holds for every tile whether it is finished, which worker has claimed it, and how often it has failed. Only
the ledger decides which worker computes a tile. An entry in RQ's queues merely wakes a worker, and a superfluous one
does no harm.

Results are whole npz files. A result depends on its request, the core version and the fingerprint of the numerics only.
Its key is made of the id of its job, which is a hash of process, core version and request, and of the fingerprint. When
all results and tiles together exceed a byte budget, tiles of finished jobs and the least recently used results are
removed; a removed result is computed again on request.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any, cast

from redis.exceptions import RedisError

from grazemap.wire import parse_request
from grazemap_worker.planning.limits import MAX_RESULT_BYTES
from grazemap_worker.planning.plan import Lane
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.jobs import Jobs, plan_from_record
from grazemap_worker.store.keys import (
    ALONE_SECONDS,
    MAX_EXCEPTIONS,
    MAX_LOST,
    PREFIX,
    TILES_KEPT_AFTER_FAILURE,
    TILES_KEPT_AFTER_SUCCESS,
    job_key,
)
from grazemap_worker.store.problems import failure_problem
from grazemap_worker.store.records import Claim, FailureKind, Finished, ResultInfo, Verdict, WaitingJob, WorkerInfo

# Maximum number of finished tiles that are read in one step, and of jobs whose tiles are removed in one step.
_ITEMS_A_STEP = 64
_LIMITS: dict[FailureKind, int] = {
    "exception": MAX_EXCEPTIONS,
    "lost": MAX_LOST,
    "hung": MAX_EXCEPTIONS,
    "timeout": 1,
    "memory": 1,
}
# The lanes of workers for small tiles (True), and of the other workers (False).
LANES: dict[bool, list[Lane]] = {True: ["small"], False: ["short", "long"]}
# Maximum number of small tiles that a worker claims at once, and maximum of the sum of their estimates in seconds.
MAX_SMALL_CLAIMS = 16
SMALL_CLAIM_SECONDS = 0.1
# Maximum bytes of the requests of tiles that are claimed at once.
_CLAIMED_BYTES = 1 << 20


class Tiles:
    """The ledger of tiles: claims, finished tiles and failures."""

    def __init__(self, scripts: Scripts, jobs: Jobs) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._jobs = jobs

    def claim_next(self, worker: WorkerInfo, lease_seconds: float) -> tuple[list[Claim], WaitingJob | None]:
        """Claim tiles for a worker: several small ones, or one tile of another lane, fairly among the flows of jobs.

        A flow is the queue of the jobs of one requester in one lane, with the same kernels and priority. After a small
        tile of a requester took far too long, the small tiles of this requester are claimed one by one. If there are
        several workers, one of them is kept free of long tiles.

        Returns the claims, and a job that has more tiles to claim, if there is one.
        """
        return self._claim_some(worker, lease_seconds, LANES[worker.small])

    def claim_beside(
        self, worker: WorkerInfo, lease_seconds: float, paused_job: str, min_wait_seconds: float
    ) -> Claim | None:
        """Claim a tile of a short job that has waited for `min_wait_seconds`, while a tile of `paused_job` is paused.

        A long job is paused for a short job of any requester, a short job only for a short job of another requester.
        """
        claims, _ = self._claim_some(worker, lease_seconds, ["short"], stopped=paused_job, waited=min_wait_seconds)
        return next(iter(claims), None)

    def _claim_some(
        self, worker: WorkerInfo, lease_seconds: float, lanes: list[Lane], **more: Any
    ) -> tuple[list[Claim], WaitingJob | None]:
        answer = self._scripts.run(
            "claim",
            holder=worker.name,
            fingerprint=worker.fingerprint,
            lease=round(1000 * lease_seconds),
            lanes=lanes,
            kernels=sorted(worker.kernels),
            most=MAX_SMALL_CLAIMS if worker.small else 1,
            seconds=SMALL_CLAIM_SECONDS,
            most_bytes=_CLAIMED_BYTES,
            **more,
        )
        claims = [self._parsed_claim(worker.name, worker.fingerprint, fields) for fields in answer[1:]]
        waiting = WaitingJob(*(field.decode() for field in answer[0])) if answer[0] else None
        return [claim for claim in claims if claim is not None], waiting

    def claim(self, job_id: str, tile: int, holder: str, fingerprint: str, lease_seconds: float) -> Claim | None:
        """Claim a tile of an unfinished job, or its assembly: tile `ASSEMBLY`, the step that joins the finished tiles.

        Returns None if the job is over, does not exist or is bound to another fingerprint, if the tile is finished, or
        if a live worker holds it. A job that is bound to no fingerprint is bound to `fingerprint`.
        """
        answer = self._scripts.run(
            "claim",
            holder=holder,
            fingerprint=fingerprint,
            lease=round(1000 * lease_seconds),
            job=job_id,
            tile=str(tile),
        )
        return self._parsed_claim(holder, fingerprint, answer[1]) if len(answer) > 1 else None

    def _parsed_claim(self, holder: str, fingerprint: str, fields: Sequence[bytes]) -> Claim | None:
        """Return the claim from the answer of a script. Forget a job whose record cannot be read, and return None."""
        job_id, tile = (field.decode() for field in fields[:2])
        try:
            process, text, core_version, plan, estimate, lane, seconds_left = (value.decode() for value in fields[2:])
            canonical = json.loads(text)
            request, read = parse_request(process, canonical), plan_from_record(plan, estimate)
        except (ValueError, LookupError, TypeError, AttributeError):
            self._jobs.forget_unreadable(job_id)
            return None
        claimed = job_id, int(tile), holder, fingerprint
        return Claim(*claimed, process, canonical, request, core_version, read, cast("Lane", lane), float(seconds_left))

    def record_failure(self, job_id: str, tile: int, kind: FailureKind, holder: str = "", detail: str = "") -> Verdict:
        """Count a failed attempt at a tile and free the tile; after too many failures the job fails.

        Parameters
        ----------
        kind : str
            Each kind is counted separately. The job fails after as many failures of one kind as `_LIMITS` allows.
        holder : str
            The worker whose attempt failed. Nothing is counted if another worker holds the tile now. Empty: any worker.
        detail : str
            A phrase about the limit that was exceeded, for the problem of a job that fails; empty if there is none.
        """
        plan = self._jobs.plan_of(job_id)
        if plan is None:
            return "failed"
        may_retry = self._scripts.run(
            "record_failure",
            id=job_id,
            tile=tile,
            kind=kind,
            most=_LIMITS[kind],
            holder=holder,
            problem=failure_problem(kind, tile, plan, detail).model_dump_json(),
            kept=TILES_KEPT_AFTER_FAILURE,
        )
        return "retry" if may_retry else "failed"

    def give_back(self, job_id: str, tile: int, holder: str) -> None:
        """Free a tile that its holder cannot finish now, without counting a failure."""
        self._scripts.run("record_failure", id=job_id, tile=tile, most=0, holder=holder)  # 0: nothing is counted

    def move_to_next_lane(self, job_id: str, tile: int, holder: str, seconds: float) -> None:
        """Free a tile that took longer than its lane allows, and move its job to the next lane.

        The flow of the job (see `claim_next`) is charged with `seconds`, the processor time. After a small tile, the
        next small tiles of its requester are claimed one by one.
        """
        self._scripts.run("overran", id=job_id, tile=tile, holder=holder, seconds=seconds, alone=ALONE_SECONDS)

    def claims_of(self, holder: str = "") -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of every tile that a holder has claimed and not finished.

        Without `holder`, they are those of all holders whose leases have run out.
        """
        answer = self._scripts.run("claims", holder=holder)
        triples = zip(answer[::3], answer[1::3], answer[2::3], strict=True)
        return [(job_id.decode(), int(tile), holder.decode()) for job_id, tile, holder in triples]

    def waiting(self, fingerprint: str) -> dict[tuple[str, str], str]:
        """Return a flow (see `claim_next`) for each pair (lane, kernels) of waiting tiles.

        The tiles are those that workers with a fingerprint can claim.
        """
        flows = self._redis.zrange(f"{PREFIX}flows:{fingerprint}", 0, -1)
        waiting = {}
        for flow in (name.decode("utf-8", "replace") for name in flows):
            # "lane|kernels|priority|requester"; ":tiles" follows the lane of jobs with long tiles
            lane, *rest = flow.split("|")
            if rest:  # otherwise another program wrote it
                waiting[lane.partition(":")[0], rest[0]] = flow
        return waiting

    def next_of_flow(self, fingerprint: str, flow: str) -> WaitingJob:
        """Return the job of a flow whose tiles are claimed next; its fields are empty if there is none any more."""
        job_id = b"".join(self._redis.zrange(f"{PREFIX}flow:{fingerprint}:{flow}", 0, 0)).decode("utf-8", "replace")
        process = self._redis.hget(job_key(job_id), "process") or b""
        return WaitingJob(process.decode("utf-8", "replace"), job_id)

    def sweep(self) -> None:
        """Remove the tiles of finished jobs that have been kept long enough."""
        self._scripts.run("sweep", most=_ITEMS_A_STEP)

    def finished(self, job_id: str) -> list[int]:
        """Return the indices of the finished tiles in increasing order; an empty list for a job of one tile."""
        return sorted(int(index) for index in self._redis.hkeys(job_key(job_id, "tiles")))

    def data(self, job_id: str, index: int) -> bytes | None:
        """Return the npz bytes of a finished tile, or None."""
        data: bytes | None = self._redis.hget(job_key(job_id, "tiles"), str(index))
        return data

    def many(self, job_id: str, indices: Iterable[int]) -> Iterator[bytes | None]:
        """Yield the npz bytes of tiles, or None for one that is not finished; a few are read at a time."""
        remaining = iter(indices)
        while part := [str(index) for index in islice(remaining, _ITEMS_A_STEP)]:
            yield from self._redis.hmget(job_key(job_id, "tiles"), part)


class Results:
    """The npz files of finished jobs; `budget` is the maximum bytes of all results and tiles together."""

    def __init__(self, scripts: Scripts, budget: int) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._budget = budget

    def commit(self, finished: Sequence[Finished]) -> list[int]:
        """Store finished tiles and results, all with the same fingerprint; the first commit of a tile or result wins.

        A result ends its job. To make room within the byte budget, tiles of finished jobs are dropped, and then the
        least recently used results: those of small jobs if such results take more than a quarter of the budget or there
        are no others, else those of other jobs.

        Returns
        -------
        list of int
            For each item of `finished`, the number of tiles that remain of its job, or a negative number. 0: the
            assembly is to be claimed, or the job is finished. -1: nothing was stored, because the job is finished, does
            not exist, or is bound to another fingerprint. -2: nothing was stored, because the item does not fit into
            the budget; the caller ends the job with `Jobs.fail`. -3: the tile was stored, and the job has taken more
            than its limit of processor time; the caller ends the job with `Jobs.end_costly`.
        """
        items = []
        for work in finished:
            claim = work.claim
            item = {
                "id": claim.job_id,
                "tile": claim.tile,
                "seconds": work.seconds,
                "whole": work.whole,
                "size": len(work.data),
            }
            if work.whole:
                item["etag"] = hashlib.sha256(work.data).hexdigest()
                item["lasting"] = work.lasting
            else:
                item["event"] = json.dumps(claim.plan.place(claim.tile))
            items.append(item)
        answer = self._scripts.run(
            "commit",
            # in one piece: redis-py sends two messages for every large argument
            b"".join(work.data for work in finished),
            fingerprint=finished[0].claim.fingerprint,
            budget=self._budget,
            kept=TILES_KEPT_AFTER_SUCCESS,
            items=items,
        )
        return [int(number) for number in answer]

    def data(self, job_id: str, etag: str | None = None) -> bytes | None:
        """Return the npz bytes of a job's result, or None if there is none (any more) or its digest is not `etag`."""
        info = self.info(job_id, MAX_RESULT_BYTES)
        return None if info is None or (etag is not None and info.etag != etag) else info.data

    def info(self, job_id: str, max_bytes: int = -1) -> ResultInfo | None:
        """Return size and digest of a job's result, with the npz if it has at most `max_bytes`; None: no result.

        This counts as a use of the result: clients and services with a copy ask only for the digest, and a result that
        is used in this way must not be evicted.
        """
        return _info(self._scripts.run("result", id=job_id, most=max_bytes))

    def each_info(self, job_ids: Sequence[str], max_bytes: int) -> list[ResultInfo | None]:
        """Return `info` of each of several jobs; all commands are sent to Redis together."""
        calls = [((), {"id": job_id, "most": max_bytes}) for job_id in job_ids]
        return [_info(answer) for answer in self._scripts.run_each("result", calls)]

    def etag(self, job_id: str) -> str | None:
        """Return the digest of a job's result, also of an evicted one; None if the job has never had a result.

        ETags are made of the digest.
        """
        value = self._redis.hget(job_key(job_id), "etag")
        return value.decode() if value else None


def _info(answer: Any) -> ResultInfo | None:
    if isinstance(answer, RedisError):
        raise answer
    if not answer:
        return None
    return ResultInfo(int(answer[0]), answer[1].decode(), answer[2] if len(answer) > 2 else None)
