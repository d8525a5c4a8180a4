"""The ledger of tiles, and the results: what workers claim and commit.

The ledger has, for every tile, whether it is done, which worker holds it, and how often it failed. Only the ledger
decides: an entry of RQ's queues says that there is something to claim, and a second one finds nothing.

Results are whole npz files, content-addressed; over a byte budget the least recently used ones are removed. A result
is a function of its request, the core version and the numerics fingerprint, which are all in its key; one that is lost
is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any, cast

from redis.exceptions import RedisError

from grazemap.wire import parse_request
from grazemap_worker.planning.limits import MOST_RESULT_BYTES
from grazemap_worker.planning.plan import Lane
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.jobs import Jobs, read_plan
from grazemap_worker.store.keys import (
    ALONE_SECONDS,
    MOST_EXCEPTIONS,
    MOST_LOST,
    PREFIX,
    TILES_KEPT_AFTER_FAILURE,
    TILES_KEPT_AFTER_SUCCESS,
    job_key,
)
from grazemap_worker.store.problems import failure_problem
from grazemap_worker.store.records import Claim, FailureKind, Finished, ResultInfo, Verdict, WorkerInfo

_TILES_A_STEP = 64
_LIMITS: dict[FailureKind, int] = {
    "exception": MOST_EXCEPTIONS,
    "lost": MOST_LOST,
    "hung": MOST_EXCEPTIONS,
    "timeout": 1,
    "memory": 1,
}
# The lanes of workers for small tiles, and of the others.
LANES: dict[bool, list[Lane]] = {True: ["small"], False: ["short", "long"]}
# Tiles of small jobs that a worker claims at once, and the seconds of which they may be estimated together.
MOST_SMALL_CLAIMS = 16
SMALL_CLAIM_SECONDS = 0.1
_CLAIMED_BYTES = 1 << 20


class Tiles:
    """Claims, finished tiles and failures."""

    def __init__(self, scripts: Scripts, jobs: Jobs) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._jobs = jobs

    def claim_next(self, worker: WorkerInfo, lease_seconds: float) -> tuple[list[Claim], bool]:
        """Claim tiles for a worker: a number of small ones, or one other. All flows of jobs get their share.

        The small ones of an asker for whom one took far too long are claimed one by one. Tiles that are long by
        themselves leave one worker free.

        Returns
        -------
        claims : list of Claim
        more : bool
            Whether there are others to claim.
        """
        return self._claim_some(worker, lease_seconds, LANES[worker.small], {})

    def claim_beside(self, worker: WorkerInfo, lease_seconds: float, stopped: str, waited: float) -> Claim | None:
        """Claim a tile of a short job that has waited for some seconds, for a worker that stops a tile meanwhile.

        `stopped` is the job of that tile. A long one is stopped for everybody, a short one only for other askers.
        """
        claims, _ = self._claim_some(worker, lease_seconds, ["short"], {"stopped": stopped, "waited": waited})
        return next(iter(claims), None)

    def _claim_some(
        self, worker: WorkerInfo, lease_seconds: float, lanes: list[Lane], more: dict[str, Any]
    ) -> tuple[list[Claim], bool]:
        answer = self._scripts.run(
            "claim",
            holder=worker.name,
            fingerprint=worker.fingerprint,
            lease=round(1000 * lease_seconds),
            lanes=lanes,
            kernels=sorted(worker.kernels),
            most=MOST_SMALL_CLAIMS if worker.small else 1,
            seconds=SMALL_CLAIM_SECONDS,
            most_bytes=_CLAIMED_BYTES,
            **more,
        )
        claims = [self._claim(worker.name, worker.fingerprint, fields) for fields in answer[1:]]
        return [claim for claim in claims if claim is not None], bool(answer[0])

    def claim(self, identity: str, tile: int, holder: str, fingerprint: str, lease_seconds: float) -> Claim | None:
        """Claim one tile of an unfinished job, or the assembly of a map whose tiles are all done.

        Returns None if the job is over or gone, or bound to other numerics, if the tile is done, or if a live worker
        holds it. A job that is bound to none is bound to `fingerprint`.
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
        """Return the claim that a script made; a job whose record cannot be read is forgotten."""
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
        """Count a failed attempt at a tile and free the tile; the job fails when there are too many.

        Parameters
        ----------
        kind : str
            Counted separately: 3 exceptions, 10 lost workers and 3 that hung end the job; so does 1 that took too
            long or too much memory.
        holder : str
            The worker whose attempt failed. Nothing is counted if another one now holds the tile. Empty: any holder.
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
        """Free a tile that its holder cannot finish now; nothing is counted."""
        self._scripts.run("record_failure", id=identity, tile=tile, most=0, holder=holder)

    def overran(self, identity: str, tile: int, holder: str, seconds: float) -> None:
        """Free a tile that took longer than its lane allows: the job goes on in the next lane.

        Its asker is charged with the seconds of processor time, and his next small tiles are claimed one by one.
        """
        arguments = {"id": identity, "tile": tile, "holder": holder, "seconds": seconds}
        self._scripts.run("overran", **arguments, alone=ALONE_SECONDS)

    def lost_claims(self) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of every claim whose holder's lease has run out."""
        return self._claims("")

    def claims_of(self, holder: str) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of everything that a holder has claimed and not finished."""
        return self._claims(holder)

    def _claims(self, holder: str) -> list[tuple[str, int, str]]:
        answer = self._scripts.run("claims", holder=holder)
        triples = zip(answer[::3], answer[1::3], answer[2::3], strict=True)
        return [(identity.decode(), int(tile), holder.decode()) for identity, tile, holder in triples]

    def waiting(self, fingerprint: str) -> set[tuple[str, str]]:
        """Return (lane, kernels) of the tiles that wait to be claimed by workers with a fingerprint."""
        flows = self._redis.zrange(f"{PREFIX}flows:{fingerprint}", 0, -1)
        found = (flow.decode("utf-8", "replace").split("|") for flow in flows)
        return {(parts[0].partition(":")[0], parts[1]) for parts in found}

    def sweep(self) -> None:
        """Remove the tiles of finished jobs that have been kept long enough."""
        self._scripts.run("sweep", most=_TILES_A_STEP)

    def finished(self, identity: str) -> list[int]:
        """Return the numbers of the finished tiles, increasing; empty for jobs of one tile."""
        return sorted(int(tile) for tile in self._redis.hkeys(job_key(identity, "tiles")))

    def data(self, identity: str, index: int) -> bytes | None:
        """Return the npz bytes of a finished tile, or None."""
        data: bytes | None = self._redis.hget(job_key(identity, "tiles"), str(index))
        return data

    def many(self, identity: str, indices: Iterable[int]) -> Iterator[bytes | None]:
        """Yield the npz bytes of finished tiles, or None where one is missing; a few are read at a time."""
        numbers = iter(indices)
        while some := [str(index) for index in islice(numbers, _TILES_A_STEP)]:
            yield from self._redis.hmget(job_key(identity, "tiles"), some)


class Results:
    """The results of finished jobs; `budget` is in bytes, of all results together."""

    def __init__(self, scripts: Scripts, budget: int) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._budget = budget

    def commit(self, finished: Sequence[Finished]) -> list[int]:
        """Store tiles and results of claims with one fingerprint; the first commit of each wins.

        A result ends its job. Tiles of jobs that are over, and the least recently used results, are dropped until all
        fit the byte budget; small results first when they take more than a quarter of it.

        Returns
        -------
        list of int
            For each, the tiles of its job that remain; 0: the assembly is to be claimed, or the job is finished. -1:
            the job no longer wants it (finished, gone, or bound to other numerics), nothing was stored. -2: it does
            not fit into the budget, nothing was stored. -3: the tile was stored, and the job has taken more than its
            limit of processor time.
        """
        items = []
        for one in finished:
            claim = one.claim
            item = {
                "id": claim.job_id,
                "tile": claim.tile,
                "seconds": one.seconds,
                "whole": one.whole,
                "size": len(one.data),
            }
            if one.whole:
                item["etag"] = hashlib.sha256(one.data).hexdigest()
                item["lasting"] = one.lasting
            else:
                item["event"] = json.dumps(claim.plan.place(claim.tile))
            items.append(item)
        answer = self._scripts.run(
            "commit",
            # in one piece: redis-py sends two messages for every large argument
            b"".join(one.data for one in finished),
            fingerprint=finished[0].claim.fingerprint,
            budget=self._budget,
            kept=TILES_KEPT_AFTER_SUCCESS,
            items=items,
        )
        return [int(number) for number in answer]

    def data(self, identity: str) -> bytes | None:
        """Return the npz bytes of a job's result, or None when it has none (any more)."""
        answer = self._scripts.run("result", id=identity, most=MOST_RESULT_BYTES)
        return answer[2] if answer else None

    def info(self, identity: str, most: int = -1) -> ResultInfo | None:
        """Return size and entity tag of a job's result, and its bytes if it has at most `most`; None without one.

        The result becomes the most recently used one: a client that has it, or the service with a copy in its memory,
        does not ask for the bytes.
        """
        return _info(self._scripts.run("result", id=identity, most=most))

    def each_info(self, identities: Sequence[str], most: int) -> list[ResultInfo | None]:
        """Return the same for each of several jobs, which are asked for together."""
        calls = [((), {"id": identity, "most": most}) for identity in identities]
        return [_info(answer) for answer in self._scripts.run_each("result", calls)]

    def etag(self, identity: str) -> str | None:
        """Return the entity tag of a job's result, evicted or not, or None if the job has no result."""
        value = self._redis.hget(job_key(identity), "etag")
        return value.decode() if value else None


def _info(answer: Any) -> ResultInfo | None:
    if isinstance(answer, RedisError):
        raise answer
    if not answer:
        return None
    return ResultInfo(int(answer[0]), answer[1].decode(), answer[2] if len(answer) > 2 else None)
