"""The ledger of tiles, and the results: what workers claim and commit.

The ledger has, for every tile, whether it is done, which worker holds it, and how often it failed. Only the ledger
decides: entries of RQ's queues are hints to claim a tile, and a second entry for a tile finds it claimed or done.

Results are whole npz files, content-addressed; over a byte budget the least recently used ones are removed. A result
is a function of its request, the core version and the numerics fingerprint, which are all in its key; one that is lost
is computed again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

from grazemap.wire import parse_request
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.jobs import Jobs, in_chunks, read_plan
from grazemap_worker.store.keys import (
    ASSEMBLY,
    MOST_EXCEPTIONS,
    MOST_LOST,
    MOST_RESULT_BYTES,
    TILES_KEPT_AFTER_FAILURE,
    TILES_KEPT_AFTER_SUCCESS,
    job_key,
)
from grazemap_worker.store.problems import failure_problem
from grazemap_worker.store.records import Claim, FailureKind, ResultInfo, ResultTooLarge, Verdict

_TILES_A_STEP = 64
_LIMITS: dict[FailureKind, int] = {"exception": MOST_EXCEPTIONS, "lost": MOST_LOST, "timeout": 1}


class Tiles:
    """Claims, finished tiles and failures."""

    def __init__(self, scripts: Scripts, jobs: Jobs) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._jobs = jobs

    def claim(
        self, identity: str, tile: int, holder: str, fingerprint: str, lease_seconds: float, core_version: str = ""
    ) -> Claim | None:
        """Take a tile, or the assembly of a map whose tiles are all done.

        Parameters
        ----------
        core_version : str
            The holder's; jobs of another one are left alone. Empty: any.

        Returns
        -------
        Claim or None
            None: the job is finished or gone, the tile is done, a live worker holds it, or the job is of another
            version or bound to other numerics. An unbound job is bound to `fingerprint`.
        """
        milliseconds = round(1000 * lease_seconds)
        answer = self._scripts.run("claim", identity, tile, holder, fingerprint, milliseconds, ASSEMBLY, core_version)
        if answer is None:
            return None
        process, text, core_version, plan, estimate = (value.decode() for value in answer)
        canonical = json.loads(text)
        request = parse_request(process, canonical)
        return Claim(
            identity, tile, holder, fingerprint, process, canonical, request, core_version, read_plan(plan, estimate)
        )

    def commit(self, identity: str, tile: int, data: bytes, fingerprint: str, cpu_seconds: float) -> int:
        """Store a finished tile, and the processor time of computing it; the first commit wins.

        Returns
        -------
        int
            Tiles that remain; 0: the assembly is to be claimed. -1: the job no longer wants the tile
            (finished, gone, or bound to other numerics), nothing was stored.

        Raises
        ------
        ResultTooLarge
            Over `MOST_RESULT_BYTES`.
        """
        _check_size(data)
        plan = self._jobs.plan_of(identity)
        if plan is None:
            return -1
        event = json.dumps(plan.place(tile))
        return int(self._scripts.run("commit_tile", identity, tile, data, fingerprint, event, cpu_seconds))

    def record_failure(self, identity: str, tile: int, kind: FailureKind, holder: str = "") -> Verdict:
        """Count a failed attempt at a tile and free the tile; the job fails when there are too many.

        Parameters
        ----------
        kind : {"exception", "lost", "timeout"}
            Counted separately: 3 exceptions, 10 lost workers and 1 timeout end the job.
        holder : str
            The worker whose attempt failed. Nothing is counted if another one now holds the tile. Empty: any holder.
        """
        plan = self._jobs.plan_of(identity)
        if plan is None:
            return "failed"
        problem = failure_problem(kind, tile, plan).model_dump_json()
        again = self._scripts.run(
            "record_failure", identity, tile, kind, _LIMITS[kind], holder, problem, TILES_KEPT_AFTER_FAILURE
        )
        return "retry" if again else "failed"

    def lost_claims(self) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of every claim whose holder's lease has run out."""
        return self._claims("")

    def claims_of(self, holder: str) -> list[tuple[str, int, str]]:
        """Return (id, tile, holder) of everything that a holder has claimed and not finished."""
        return self._claims(holder)

    def _claims(self, holder: str) -> list[tuple[str, int, str]]:
        answer = self._scripts.run("claims", holder)
        triples = zip(answer[::3], answer[1::3], answer[2::3], strict=True)
        return [(identity.decode(), int(tile), holder.decode()) for identity, tile, holder in triples]

    def pending(
        self, fingerprint: str, limit: int = 1 << 30, identities: Sequence[str] | None = None
    ) -> Iterator[tuple[str, int]]:
        """Yield (id, tile) of the tiles neither done nor held by a live worker, of jobs bound to `fingerprint`.

        At most `limit` of each job. The tile is `ASSEMBLY` (-1) for a map whose tiles are all done. Without
        `identities` all unfinished jobs are checked.
        """
        for some in in_chunks(self._jobs.unfinished() if identities is None else identities):
            answers = self._scripts.run("pending", fingerprint, ASSEMBLY, limit, *some)
            for identity, tiles in zip(some, answers, strict=True):
                yield from ((identity, int(tile)) for tile in tiles)

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

    def commit(self, identity: str, data: bytes, fingerprint: str, cpu_seconds: float) -> bool:
        """Store the whole result and end the job; the first commit wins. `cpu_seconds` are added to those of the tiles.

        The least recently used results, except this one, are dropped until all fit the byte budget.

        Returns
        -------
        bool
            Whether this call ended the job; False when it is finished, gone, or bound to other numerics.

        Raises
        ------
        ResultTooLarge
            Over `MOST_RESULT_BYTES`.
        """
        _check_size(data)
        etag = hashlib.sha256(data).hexdigest()
        kept = TILES_KEPT_AFTER_SUCCESS
        return bool(
            self._scripts.run("commit_result", identity, data, fingerprint, etag, self._budget, kept, cpu_seconds)
        )

    def data(self, identity: str) -> bytes | None:
        """Return the npz bytes of a job's result, or None when it has none (any more)."""
        data: bytes | None = self._scripts.run("result", identity)
        return data

    def info(self, identity: str) -> ResultInfo | None:
        """Return size and entity tag of a job's result without loading it, or None.

        The result becomes the most recently used one: a client that has it, or the service with a copy in its memory,
        does not ask for the bytes.
        """
        answer = self._scripts.run("result_info", identity)
        return ResultInfo(size=int(answer[0]), etag=answer[1].decode()) if answer else None

    def etag(self, identity: str) -> str | None:
        """Return the entity tag of a job's result, evicted or not, or None if the job has no result."""
        value = self._redis.hget(job_key(identity), "etag")
        return value.decode() if value else None


def _check_size(data: bytes) -> None:
    """Raise ResultTooLarge when a result, or a part of one, is over `MOST_RESULT_BYTES`."""
    if len(data) > MOST_RESULT_BYTES:
        raise ResultTooLarge(len(data), MOST_RESULT_BYTES)
