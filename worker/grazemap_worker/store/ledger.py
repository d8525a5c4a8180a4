"""The tile ledger: which tiles are done, who holds which, what failed how often.

The ledger is the truth. Entries of RQ's queues are hints that a tile may be worth claiming; a second entry for the
same tile finds it claimed or done.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

from grazemap.wire import Estimate, parse_request
from grazemap_worker.store.jobs import JobStore
from grazemap_worker.store.keys import (
    ASSEMBLY,
    FINGERPRINT_REMEMBERED,
    MOST_EXCEPTIONS,
    MOST_LOST,
    MOST_RESULT_BYTES,
    PREFIX,
    TILES_KEPT_AFTER_FAILURE,
    job_key,
)
from grazemap_worker.store.plan import Plan
from grazemap_worker.store.problems import failure_problem, outdated_problem
from grazemap_worker.store.records import Claim, FailureKind, ResultTooLarge, Verdict

_JOBS_A_SCRIPT = 500
_TILES_A_STEP = 64
_LIMITS: dict[FailureKind, int] = {"exception": MOST_EXCEPTIONS, "lost": MOST_LOST, "timeout": 1}


class LedgerStore(JobStore):
    """What workers and the reconciler ask for."""

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
        process, request, core_version, plan, estimate = (value.decode() for value in answer)
        return Claim(
            job_id=identity,
            tile=tile,
            holder=holder,
            fingerprint=fingerprint,
            process=process,
            request=parse_request(process, json.loads(request)),
            core_version=core_version,
            plan=_plan(plan, estimate),
        )

    def release(self, identity: str, tile: int, holder: str) -> bool:
        """Give a tile back undone, without counting a failure. Returns whether it was held by `holder`."""
        return bool(self._scripts.run("release", identity, tile, holder))

    def commit_tile(self, identity: str, tile: int, data: bytes, fingerprint: str, cpu_seconds: float) -> int:
        """Store a finished tile, and the processor time of computing it; the first writer wins.

        Returns
        -------
        int
            Tiles that remain; 0: somebody has to claim the assembly. -1: the job no longer wants the tile
            (finished, gone, or bound to other numerics), nothing was stored.

        Raises
        ------
        ResultTooLarge
            Over `MOST_RESULT_BYTES`.
        """
        if len(data) > MOST_RESULT_BYTES:
            raise ResultTooLarge(len(data), MOST_RESULT_BYTES)
        plan = self._plan_of(identity)
        if plan is None:
            return -1
        row_start, row_stop, column_start, column_stop = plan.tile(tile)
        event = {"index": tile, "rows": [row_start, row_stop], "columns": [column_start, column_stop]}
        return int(self._scripts.run("commit_tile", identity, tile, data, fingerprint, json.dumps(event), cpu_seconds))

    def record_failure(
        self, identity: str, tile: int, kind: FailureKind, detail: str = "", holder: str = ""
    ) -> Verdict:
        """Count a failed try at a tile and free the tile; the job fails when it was one too many.

        Parameters
        ----------
        kind : {"exception", "lost", "timeout"}
            Counted apart: an exception comes back (3 tries), a worker that died may have been bad luck (10), what took
            too long would take too long again (1).
        detail : str
            For nobody but the log of the caller; the problem that clients see does not contain it.
        holder : str
            Who lost the tile. When somebody else holds it by now nothing is counted. Empty: whoever holds it.
        """
        plan = self._plan_of(identity)
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

    def some_unfinished(self, cursor: int, about: int) -> tuple[int, list[str]]:
        """Return the next cursor and about so many unfinished jobs; cursor 0 begins a tour of all, and ends it."""
        after, found = self._redis.hscan(f"{PREFIX}unfinished", cursor, count=about)
        return int(after), [identity.decode() for identity in found]

    def bind(self, fingerprint: str, core_version: str, identities: Sequence[str] | None = None) -> list[str]:
        """Bind to `fingerprint` the jobs of a core version that have no live numerics; return their ids.

        A job of another core version that no worker had for `FINGERPRINT_REMEMBERED` seconds fails. Left out, the
        jobs are all unfinished ones.
        """
        bound: list[str] = []
        for some in self._in_chunks(identities):
            found, outdated = self._scripts.run("bind", fingerprint, core_version, FINGERPRINT_REMEMBERED, *some)
            bound += [identity.decode() for identity in found]
            for identity in outdated:
                self.fail(identity.decode(), outdated_problem())
        return bound

    def pending(
        self, fingerprint: str, limit: int = 1 << 30, identities: Sequence[str] | None = None
    ) -> Iterator[tuple[str, int]]:
        """Yield (id, tile) of what is neither done nor held by a live worker, of the jobs bound to `fingerprint`.

        At most `limit` of each job. The tile is `ASSEMBLY` (-1) for a map whose tiles are all done. Left out, the
        jobs are all unfinished ones.
        """
        for some in self._in_chunks(identities):
            answers = self._scripts.run("pending", fingerprint, ASSEMBLY, limit, *some)
            for identity, tiles in zip(some, answers, strict=True):
                yield from ((identity, int(tile)) for tile in tiles)

    def _in_chunks(self, identities: Sequence[str] | None) -> Iterator[Sequence[str]]:
        """Yield so many at a time that a script over them is short."""
        everything = list(self.unfinished()) if identities is None else identities
        for start in range(0, len(everything), _JOBS_A_SCRIPT):
            yield everything[start : start + _JOBS_A_SCRIPT]

    def tile_index(self, identity: str) -> list[int]:
        """Return the numbers of the finished tiles, increasing; empty for jobs of one tile."""
        return sorted(int(tile) for tile in self._redis.hkeys(job_key(identity, "tiles")))

    def tile(self, identity: str, index: int) -> bytes | None:
        """Return the npz bytes of a finished tile, or None."""
        data: bytes | None = self._redis.hget(job_key(identity, "tiles"), str(index))
        return data

    def tiles(self, identity: str, indices: Iterable[int]) -> Iterator[bytes | None]:
        """Yield the npz bytes of finished tiles, or None, some of them read at a time."""
        numbers = iter(indices)
        while some := [str(index) for index in islice(numbers, _TILES_A_STEP)]:
            yield from self._redis.hmget(job_key(identity, "tiles"), some)

    def plan_of(self, identity: str) -> Plan | None:
        """Return how a job is cut into tiles, or None when there is no such job."""
        return self._plan_of(identity)

    def _plan_of(self, identity: str) -> Plan | None:
        plan, estimate = self._redis.hmget(job_key(identity), "plan", "estimate")
        return _plan(plan.decode(), estimate.decode()) if plan else None


def _plan(plan: str, estimate: str) -> Plan:
    return Plan.model_validate_json(plan).model_copy(update={"estimate": Estimate.model_validate_json(estimate)})
