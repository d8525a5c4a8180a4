"""The worker: RQ's, with a lease on its tiles and with work-horses that end when it ends.

RQ itself notices a killed worker after minutes and leaves its work-horse running. Here the worker renews a lease in the
store (every second while it works), the operating system kills the work-horse with it, and entries that are not tiles
of grazemap are never performed.
"""

from __future__ import annotations

import os
import signal
from datetime import UTC, datetime
from time import monotonic
from typing import Any

import structlog
from rq import Queue, Worker
from rq.executions import Execution
from rq.job import Job
from rq.serializers import JSONSerializer

from grazemap_worker import tasks
from grazemap_worker.compiling import compiled_here
from grazemap_worker.numerics import Numerics
from grazemap_worker.parent_death import die_with_parent
from grazemap_worker.queue import entries
from grazemap_worker.queue.refusal import Entry, refusal
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import Store, core_version
from grazemap_worker.store.records import FailureKind

# RQ renews its heartbeat, and the lease with it, after waiting for work this long less 15 s.
WORKER_TTL = 18


class LeasedWorker(Worker):
    """A worker on the queue of its numerics.

    Parameters
    ----------
    store : Store
        Its connection is RQ's too.
    numerics : Numerics
        What the tiles of this worker are computed with.
    name : str
        Unique; under this name it holds its tiles.
    """

    max_connection_wait_time = 2.0
    log_result_lifespan = False

    def __init__(self, store: Store, numerics: Numerics, name: str) -> None:
        self._store = store
        self._numerics = numerics
        super().__init__(
            [entries.queue(store.redis, numerics.fingerprint)],
            name=name,
            connection=store.redis,
            job_class=Entry,
            serializer=JSONSerializer,
            worker_ttl=WORKER_TTL,
            job_monitoring_interval=1,
            default_result_ttl=0,
            log_job_description=False,
        )
        tasks.enter(tasks.Context(store, name, numerics))

    def heartbeat(self, timeout: int | None = None, pipeline: Any = None) -> None:
        """Renew RQ's heartbeat and, in the worker itself, the lease."""
        super().heartbeat(timeout, pipeline)
        if not self.is_horse and not self._store.workers.renew(self.name, LEASE_SECONDS):
            self._store.workers.register(self.name, self._numerics.fingerprint, LEASE_SECONDS, core_version())
            self._store.workers.say_compiled(self._numerics.fingerprint, compiled_here())

    def maintain_heartbeats(self, job: Job, execution: Execution) -> None:
        """Stop the work-horse when its job is no longer wanted; RQ calls this every second while it runs.

        The stop command that a dismissal sends is faster; this does not depend on its arrival.
        """
        super().maintain_heartbeats(job, execution)
        if not self._store.jobs.wanted(str(job.args[0])):
            self.request_stop_execution(execution.id)

    def kill_horse(self, sig: signal.Signals = signal.SIGKILL) -> None:
        """Kill the work-horse if there is one.

        Otherwise, after a stop command at the end of a tile, RQ would kill process group 0, which is the worker's own.
        """
        if self.horse_pid:
            super().kill_horse(sig)

    def run_maintenance_tasks(self) -> None:
        """Do nothing: the supervisor cleans up.

        RQ's own cleanup would call the failure callbacks of any entry in its registries.
        """
        self.last_cleaned_at = datetime.now(UTC)  # type: ignore[assignment] # RQ's own type is that of its first value

    def execute_job(self, job: Job, queue: Queue) -> None:
        """Run a tile in a work-horse; drop any other entry without performing it.

        A claim that remains when the work-horse has ended counts as lost.
        """
        reason = refusal(job)
        if reason is not None:
            structlog.get_logger("grazemap_worker").warning("job refused", rq_job=job.id, reason=reason)
            entries.drop(self.connection, job.id, self._numerics.fingerprint)
            return
        began = monotonic()
        super().execute_job(job, queue)
        # compiled code does not handle signals: RQ kills such a work-horse some time after its limit
        kind: FailureKind = "timeout" if monotonic() - began > (job.timeout or entries.TILE_TIMEOUT) else "lost"
        for job_id, tile, holder in self._store.tiles.claims_of(self.name):
            self._store.tiles.record_failure(job_id, tile, kind, holder)

    def main_work_horse(self, job: Job, queue: Queue) -> None:
        """Run in the work-horse, which ends when the worker ends."""
        if self.pid is None:
            os._exit(1)
        die_with_parent(self.pid)
        super().main_work_horse(job, queue)

    def teardown(self) -> None:
        """Give back the claims and end the lease."""
        super().teardown()  # type: ignore[no-untyped-call]
        if not self.is_horse:
            self._store.workers.remove(self.name, return_claims=True)
