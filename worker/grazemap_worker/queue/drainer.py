"""The worker: RQ's, which takes bells, holds a lease on its tiles, and never performs what is not a bell.

RQ itself notices a killed worker after minutes. Here the worker renews a lease in the store, every second while it
works. A bell is performed in the worker: small tiles are computed there, others in a process of their own.
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from time import monotonic, sleep
from typing import Any

import structlog
from redis.exceptions import RedisError
from rq import Queue, Worker
from rq.exceptions import StopRequested
from rq.job import Job
from rq.serializers import JSONSerializer

from grazemap_worker.queue import bells, rq_keys
from grazemap_worker.queue.refusal import Entry, refusal
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import Store, WorkerInfo, is_full

# RQ waits for work this long less 15 s at a time, and renews its heartbeat, and the lease with it, in between.
WORKER_TTL = 16
_BEAT_SECONDS = 1.0


class Drainer(Worker):
    """A worker on the queue of its numerics.

    Parameters
    ----------
    store : Store
        Its connection is RQ's too.
    info : WorkerInfo
        Its name, under which it holds its tiles, and what it can compute.
    drain : callable
        Claims and computes tiles until there are no more.
    beat : callable
        Called at least every few seconds while it waits, for those who watch it.
    stopping : callable
        Returns whether it should end as soon as it waits.
    """

    max_connection_wait_time = 2.0
    log_result_lifespan = False
    _beaten = 0.0

    def __init__(
        self,
        store: Store,
        info: WorkerInfo,
        drain: Callable[[], None],
        beat: Callable[[], None] = lambda: None,
        stopping: Callable[[], bool] = lambda: False,
    ) -> None:
        self._store, self._info, self._drain, self._beat, self._stopping = store, info, drain, beat, stopping
        self._target = bells.queue(store.redis, info.fingerprint, small=info.small)
        super().__init__(
            [self._target],
            name=info.name,
            connection=store.redis,
            job_class=Entry,
            serializer=JSONSerializer,
            worker_ttl=WORKER_TTL,
            default_result_ttl=0,
            log_job_description=False,
        )

    def heartbeat(self, timeout: int | None = None, pipeline: Any = None) -> None:
        """Renew RQ's heartbeat and the lease, at most once a second."""
        self._beat()
        if self._stopping():
            raise StopRequested
        if monotonic() - self._beaten < _BEAT_SECONDS:
            return
        self._beaten = monotonic()
        try:
            self._store.workers.renew(self._info, LEASE_SECONDS)
            super().heartbeat(timeout, pipeline)
        except RedisError as error:
            if not is_full(error):
                raise

    def dequeue_job_and_maintain_ttl(
        self, timeout: int | None, max_idle_time: int | None = None
    ) -> tuple[Job, Queue] | None:
        """Take a bell; drop what is none and cannot even be read. Wait where Redis is full."""
        while True:
            try:
                return super().dequeue_job_and_maintain_ttl(timeout, max_idle_time)
            except RedisError as error:
                if not is_full(error):
                    raise
                sleep(_BEAT_SECONDS)
                self.heartbeat()
            except (UnicodeDecodeError, ValueError, TypeError, LookupError):
                self._refuse("unreadable")
                # taken by this worker or by another one, which does not miss it
                self.connection.delete(rq_keys.taken_key(self._target))

    def execute_job(self, job: Job, queue: Queue) -> None:
        """Claim and compute tiles; drop any entry that is not a bell without performing it."""
        reason = refusal(job)
        bells.drop(self.connection, self._target, job.id)
        if reason is not None:
            self._refuse(reason)
            return
        try:
            self._drain()
        except RedisError as error:
            structlog.get_logger("grazemap_worker").warning("tiles left to others", error=type(error).__name__)
            raise

    def _refuse(self, reason: str) -> None:
        structlog.get_logger("grazemap_worker").warning("entry of the queue refused", reason=reason)
        self._store.count("poisoned:entries")

    def subscribe(self) -> None:
        """Do nothing: no commands are sent to workers, so they need no connection for them."""

    def unsubscribe(self) -> None:
        """Do nothing."""

    def run_maintenance_tasks(self) -> None:
        """Do nothing: the supervisor cleans up.

        RQ's own cleanup would call the failure callbacks of any entry in its registries.
        """

    @property
    def should_run_maintenance_tasks(self) -> bool:
        """Whether RQ's own cleanup is due; never."""
        return False

    def request_stop(self, signum: int, frame: Any) -> None:
        """Stop at once; what is claimed is given back."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        super().request_stop(signum, frame)  # type: ignore[no-untyped-call]

    def teardown(self) -> None:
        """Give back the claims and end the lease."""
        try:
            super().teardown()  # type: ignore[no-untyped-call]
        finally:
            self._store.workers.remove(self.name, return_claims=True)
