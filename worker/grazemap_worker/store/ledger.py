"""The ledger of tiles, and the results: what workers claim and commit.

The ledger holds for every tile whether it is finished, which worker has claimed it, and how often it has failed. Only
the ledger decides which worker computes a tile. An entry in RQ's queues merely wakes a worker, and a superfluous one
does no harm.

Results are whole npz files. A result depends on its request, the core version and the fingerprint of the numerics only,
and its key is made of these. When all results together exceed a byte budget, the least recently used ones are removed;
a removed result is computed again on request.
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
from grazemap_worker.store.jobs import Jobs, read_plan
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

# Finished tiles that are read, or jobs whose tiles are removed, in one step.
_TILES_A_STEP = 64
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
    """Claims, finished tiles and failures."""

    def __init__(self, scripts: Scripts, jobs: Jobs) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._jobs = jobs

    def claim_next(self, worker: WorkerInfo, lease_seconds: float) -> tuple[list[Claim], WaitingJob | None]:
        """Claim tiles for a worker: several small ones, or one tile of another lane, fairly among the flows of jobs.

        After a small tile of a requester took far too long, the small tiles of this requester are claimed one by one.
        Long tiles leave one worker free.

        Returns
        -------
        claims : list of Claim
        waiting : WaitingJob or None
            A job that has more tiles to claim.
        """
        return self._claim_some(worker, lease_seconds, LANES[worker.small], {})

    def claim_beside(self, worker: WorkerInfo, lease_seconds: float, stopped: str, waited: float) -> Claim | None:
        """Claim a tile of a short job that has waited for `waited` seconds while a tile of job `stopped` is stopped.

        A tile of a long job is stopped for the short jobs of all requesters, a tile of a short job only for those of
        other requesters.
        """
        claims, _ = self._claim_some(worker, lease_seconds, ["short"], {"stopped": stopped, "waited": waited})
        return next(iter(claims), None)

    def _claim_some(
        self, worker: WorkerInfo, lease_seconds: float, lanes: list[Lane], more: dict[str, Any]
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
        claims = [self._claim(worker.name, worker.fingerprint, fields) for fields in answer[1:]]
        waiting = WaitingJob(*(field.decode() for field in answer[0])) if answer[0] else None
        return [claim for claim in claims if claim is not None], waiting

    def claim(self, identity: str, tile: int, holder: str, fingerprint: str, lease_seconds: float) -> Claim | None:
        """Claim one tile of an unfinished job, or the assembly of a map whose tiles are all finished.

        Returns None if the job is over, does not exist or is bound to another fingerprint, if the tile is finished, or
        if a live worker holds it. A job that is bound to no fingerprint is bound to `fingerprint`.
        """
        answer = self._scripts.run(
            "claim",
            holder=holder,
            fingerprint=fingerprint,
            lease=round(1000 * lease_seconds),
            job=identity,
            tile=str(tile),
        )
        return self._claim(holder, fingerprint, answer[1]) if len(answer) > 1 else None

    def _claim(self, holder: str, fingerprint: str, fields: Sequence[bytes]) -> Claim | None:
        """Return the claim from the answer of a script. Forget a job whose record cannot be read, and return None."""
        identity, tile, _ = (field.decode() for field in fields[:3])
        try:
            process, text, core_version, plan, estimate, lane, left = (value.decode() for value in fields[3:])
            canonical = json.loads(text)
            request, planned = parse_request(process, canonical), read_plan(plan, estimate)
        except (ValueError, LookupError, TypeError, AttributeError):
            self._jobs.forget_unreadable(identity)
            return None
        place = identity, int(tile), holder, fingerprint
        return Claim(*place, process, canonical, request, core_version, planned, cast("Lane", lane), float(left))

    def record_failure(
        self, identity: str, tile: int, kind: FailureKind, holder: str = "", detail: str = ""
    ) -> Verdict:
        """Count a failed attempt at a tile and free the tile; after too many failures the job fails.

        Parameters
        ----------
        kind : str
            Each kind is counted separately. The job fails after 3 exceptions, 10 lost workers, 3 attempts that hung,
            or 1 attempt that took too long or too much memory.
        holder : str
            The worker whose attempt failed. Nothing is counted if another worker holds the tile now. Empty: any worker.
        detail : str
            The limit that was exceeded.
        """
        plan = self._jobs.plan_of(identity)
        if plan is None:
            return "failed"
        again = self._scripts.run(
            "record_failure",
            id=identity,
            tile=tile,
            kind=kind,
            most=_LIMITS[kind],
            holder=holder,
            problem=failure_problem(kind, tile, plan, detail).model_dump_json(),
            kept=TILES_KEPT_AFTER_FAILURE,
        )
        return "retry" if again else "failed"

    def give_back(self, identity: str, tile: int, holder: str) -> None:
        """Free a tile that its holder cannot finish now, without counting a failure."""
        self._scripts.run("record_failure", id=identity, tile=tile, most=0, holder=holder)

    def overran(self, identity: str, tile: int, holder: str, seconds: float) -> None:
        """Free a tile that took longer than its lane allows, and move its job to the next lane.

        The flow of its requester is charged with `seconds`, the processor time. After a small tile, the next small
        tiles of this requester are claimed one by one.
        """
        arguments = {"id": identity, "tile": tile, "holder": holder, "seconds": seconds}
        self._scripts.run("overran", **arguments, alone=ALONE_SECONDS)

    def lost_claims(self) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of every claim whose holder's lease has run out."""
        return self._claims("")

    def claims_of(self, holder: str) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of every tile that a holder has claimed and not finished."""
        return self._claims(holder)

    def _claims(self, holder: str) -> list[tuple[str, int, str]]:
        answer = self._scripts.run("claims", holder=holder)
        triples = zip(answer[::3], answer[1::3], answer[2::3], strict=True)
        return [(identity.decode(), int(tile), holder.decode()) for identity, tile, holder in triples]

    def waiting(self, fingerprint: str) -> dict[tuple[str, str], str]:
        """Return a flow for each pair (lane, kernels) of waiting tiles that workers with a fingerprint can claim."""
        flows = self._redis.zrange(f"{PREFIX}flows:{fingerprint}", 0, -1)
        waiting = {}
        for flow in (name.decode("utf-8", "replace") for name in flows):
            place, kernels, *_ = flow.split("|")
            waiting[place.partition(":")[0], kernels] = flow
        return waiting

    def next_of_flow(self, fingerprint: str, flow: str) -> WaitingJob:
        """Return the job of a flow whose tiles are claimed next; its fields are empty if there is none any more."""
        identity = b"".join(self._redis.zrange(f"{PREFIX}flow:{fingerprint}:{flow}", 0, 0)).decode("utf-8", "replace")
        process = self._redis.hget(f"{PREFIX}job:{identity}", "process") or b""
        return WaitingJob(process.decode("utf-8", "replace"), identity)

    def sweep(self) -> None:
        """Remove the tiles of finished jobs that have been kept long enough."""
        self._scripts.run("sweep", most=_TILES_A_STEP)

    def finished(self, identity: str) -> list[int]:
        """Return the numbers of the finished tiles in increasing order; an empty list for a job of one tile."""
        return sorted(int(tile) for tile in self._redis.hkeys(job_key(identity, "tiles")))

    def data(self, identity: str, index: int) -> bytes | None:
        """Return the npz bytes of a finished tile, or None."""
        data: bytes | None = self._redis.hget(job_key(identity, "tiles"), str(index))
        return data

    def many(self, identity: str, indices: Iterable[int]) -> Iterator[bytes | None]:
        """Yield the npz bytes of tiles, or None for one that is not finished; a few are read at a time."""
        numbers = iter(indices)
        while part := [str(index) for index in islice(numbers, _TILES_A_STEP)]:
            yield from self._redis.hmget(job_key(identity, "tiles"), part)


class Results:
    """The results of finished jobs; `budget` is the maximum bytes of all results and tiles together."""

    def __init__(self, scripts: Scripts, budget: int) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._budget = budget

    def commit(self, finished: Sequence[Finished]) -> list[int]:
        """Store finished tiles and results, all with the same fingerprint; the first commit of a tile or result wins.

        A result ends its job. To make room within the byte budget, tiles of finished jobs are dropped, and then the
        least recently used results; small results first while they take more than a quarter of the budget.

        Returns
        -------
        list of int
            For each item of `finished`, the number of tiles that remain of its job, or a negative number. 0: the
            assembly is to be claimed, or the job is finished. -1: nothing was stored, because the job is finished, does
            not exist, or is bound to another fingerprint. -2: nothing was stored, because the item does not fit into
            the budget. -3: the tile was stored, and the job has taken more than its limit of processor time.
        """
        items = []
        for result in finished:
            claim = result.claim
            item = {
                "id": claim.job_id,
                "tile": claim.tile,
                "seconds": result.seconds,
                "whole": result.whole,
                "size": len(result.data),
            }
            if result.whole:
                item["etag"] = hashlib.sha256(result.data).hexdigest()
                item["lasting"] = result.lasting
            else:
                item["event"] = json.dumps(claim.plan.place(claim.tile))
            items.append(item)
        answer = self._scripts.run(
            "commit",
            # in one piece: redis-py sends two messages for every large argument
            b"".join(result.data for result in finished),
            fingerprint=finished[0].claim.fingerprint,
            budget=self._budget,
            kept=TILES_KEPT_AFTER_SUCCESS,
            items=items,
        )
        return [int(number) for number in answer]

    def data(self, identity: str) -> bytes | None:
        """Return the npz bytes of a job's result, or None if there is no result (any more)."""
        answer = self._scripts.run("result", id=identity, most=MAX_RESULT_BYTES)
        return answer[2] if answer else None

    def info(self, identity: str, max_bytes: int = -1) -> ResultInfo | None:
        """Return size and entity tag of a job's result, with the npz if it has at most `max_bytes`; None: no result.

        The result becomes the most recently used one, because a client or a service that has a copy of it does not
        fetch the npz again.
        """
        return _info(self._scripts.run("result", id=identity, most=max_bytes))

    def each_info(self, identities: Sequence[str], max_bytes: int) -> list[ResultInfo | None]:
        """Return `info` of each of several jobs; all requests are sent to Redis together."""
        calls = [((), {"id": identity, "most": max_bytes}) for identity in identities]
        return [_info(answer) for answer in self._scripts.run_each("result", calls)]

    def etag(self, identity: str) -> str | None:
        """Return the entity tag of a job's result, also of an evicted one; None if the job has never had a result."""
        value = self._redis.hget(job_key(identity), "etag")
        return value.decode() if value else None


def _info(answer: Any) -> ResultInfo | None:
    if isinstance(answer, RedisError):
        raise answer
    if not answer:
        return None
    return ResultInfo(int(answer[0]), answer[1].decode(), answer[2] if len(answer) > 2 else None)
