"""The reconciler: mends what ended workers and lost wake-ups leave, so that no tile waits although a worker is free.

Every supervisor calls its reconciler every second. Of the supervisors with the same fingerprint one has the lead, and
its reconciler does the work: it counts the tiles of ended workers as lost, binds jobs that were submitted while no
worker was alive, and sends wake-ups while tiles wait.
"""

from __future__ import annotations

import structlog

from grazemap_worker.numerics import Numerics
from grazemap_worker.queue import clean_up, wake_ups
from grazemap_worker.store import Store, core_version

INTERVAL_SECONDS = 1.0
# Approximate number of unfinished jobs that a round looks at, to bind them. A long backlog takes several rounds, so
# that no round delays Redis or the handling of a signal.
JOBS_A_ROUND = 500
# Seconds after a round until another supervisor may take the lead.
_LEAD_SECONDS = 4.0


class Reconciler:
    """The reconciler of one supervisor; `name` distinguishes it from reconcilers of other supervisors."""

    def __init__(self, store: Store, numerics: Numerics, name: str) -> None:
        self._store = store
        self._fingerprint = numerics.fingerprint
        self._name = name
        self._cursor = 0
        self._queue_clean_up = clean_up.QueueCleanUp(numerics.fingerprint)

    def reconcile(self) -> set[str]:
        """Run one round, or none without the lead; return the kernels that waiting tiles need. Raises RedisError."""
        store, log = self._store, structlog.get_logger("grazemap_worker")
        if not store.workers.lead(f"reconciler:{self._fingerprint}", self._name, _LEAD_SECONDS):
            return {kernels for _, kernels in store.tiles.waiting(self._fingerprint)}
        for job_id, tile, holder in store.tiles.claims_of():
            verdict = store.tiles.record_failure(job_id, tile, "lost", holder)
            log.warning("tile lost its worker", job_id=job_id, tile=tile, holder=holder, verdict=verdict)
        self._cursor, jobs = store.jobs.some_unfinished(self._cursor, JOBS_A_ROUND)
        store.jobs.bind(self._fingerprint, core_version(), jobs)
        store.tiles.sweep()
        store.set_budget()
        self._queue_clean_up.sweep(store.redis)
        waiting = store.tiles.waiting(self._fingerprint)
        # one flow for each of the two queues: the worker that wakes up claims tiles of any flow
        for small, flow in {lane == "small": flow for (lane, _), flow in waiting.items()}.items():
            job = store.tiles.next_of_flow(self._fingerprint, flow)
            wake_ups.wake_worker(store.redis, self._fingerprint, job, small=small)
        return {kernels for _, kernels in waiting}
