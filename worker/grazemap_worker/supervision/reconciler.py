"""Makes the queues agree with the ledger: the ledger decides, queues hold hints.

One supervisor per fingerprint does this every second. It takes over the jobs of an earlier layout of the store, counts
the tiles of ended workers as lost, binds jobs that were submitted while no worker was there, and queues every tile that
is neither done nor held nor queued.
"""

from __future__ import annotations

import time
from collections import Counter, defaultdict

import structlog

from grazemap_worker.numerics import Numerics
from grazemap_worker.queue import entries, leftovers
from grazemap_worker.store import Store, core_version

INTERVAL_SECONDS = 1.0
# Approximate number of jobs of a round, and the time after which it queues no more: a long backlog takes several
# rounds, so that no round delays Redis or a signal.
JOBS_A_ROUND = 1000
ROUND_SECONDS = 0.5
_LEAD_SECONDS = 4.0


class Reconciler:
    """The reconciler of one supervisor; `name` distinguishes it from the others."""

    def __init__(self, store: Store, numerics: Numerics, name: str) -> None:
        self._store = store
        self._fingerprint = numerics.fingerprint
        self._name = name
        self._cursor = 0

    def reconcile(self) -> int:
        """Do one round; return how many tiles were queued. Raises redis.exceptions.RedisError."""
        store, log = self._store, structlog.get_logger("grazemap_worker")
        if not store.workers.lead(f"reconciler:{self._fingerprint}", self._name, _LEAD_SECONDS):
            return 0
        self._adopt()
        queued = 0
        deadline = time.monotonic() + ROUND_SECONDS
        for job_id, tile, holder in store.tiles.lost_claims():
            verdict = store.tiles.record_failure(job_id, tile, "lost", holder)
            log.warning("tile lost its worker", job_id=job_id, tile=tile, holder=holder, verdict=verdict)
            if verdict == "retry" and store.jobs.fingerprint_of(job_id) == self._fingerprint:
                queued += entries.enqueue(store.redis, job_id, [tile], self._fingerprint)
        self._cursor, jobs = store.jobs.some_unfinished(self._cursor, JOBS_A_ROUND)
        store.jobs.bind(self._fingerprint, core_version(), jobs)
        leftovers.sweep(store.redis, self._fingerprint)

        waiting = entries.queued(store.redis, self._fingerprint)
        missing: dict[str, list[int]] = defaultdict(list)
        for job_id, tile in store.tiles.pending(self._fingerprint, 2 * entries.QUEUED_AHEAD, jobs):
            if (job_id, tile) not in waiting:
                missing[job_id].append(tile)
        per_job = Counter(job_id for job_id, _ in waiting)
        for job_id, tiles in missing.items():
            free = max(0, entries.QUEUED_AHEAD - per_job[job_id])
            queued += entries.enqueue(store.redis, job_id, tiles[:free], self._fingerprint)
            if time.monotonic() > deadline:
                break
        if queued:
            # DEBUG: also a tile that a worker has taken and not yet claimed, and the next piece of a long map
            log.debug("tiles queued again", tiles=queued, jobs=len(missing))
        return queued

    def _adopt(self) -> None:
        """Take over the jobs that an earlier version of grazemap stored, once none of its workers is alive."""
        for prefix in self._store.older_layouts.abandoned():
            leftovers.forget_queues(self._store.redis, prefix)
            jobs, unfinished = self._store.older_layouts.adopt(prefix)
            structlog.get_logger("grazemap_worker").warning(
                "jobs of an earlier version taken over; their results are computed anew when they are asked for",
                jobs=jobs,
                unfinished=unfinished,
            )
