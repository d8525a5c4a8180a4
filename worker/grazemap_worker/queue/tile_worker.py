"""The worker, a subclass of RQ's: it takes wake-ups, and claims and computes tiles under a lease.

RQ itself notices a killed worker after minutes. Therefore this worker renews a lease in the store, about once a second
while it waits; while it computes, `tasks` renews the lease. A worker for small tiles computes the tiles itself, any
other worker in a compute process. RQ's work-horse is not used. While the worker computes for more than a moment, its
entry is an execution in RQ's registry, described by the job whose tiles it computes, for `rq info` and dashboards. What
a killed worker leaves of that expires.
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from contextlib import suppress
from time import monotonic, sleep
from typing import Any

import structlog
from redis.exceptions import RedisError
from rq import Queue, Worker
from rq.exceptions import StopRequested
from rq.executions import Execution
from rq.job import Job
from rq.serializers import JSONSerializer
from rq.worker import WorkerStatus

from grazemap_worker.queue import wake_ups
from grazemap_worker.queue.refusal import Entry, refusal
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import Store, WaitingJob, WorkerInfo, is_full

# RQ waits for work for WORKER_TTL - 15 seconds at a time. In between it renews its heartbeat, and the lease with it.
WORKER_TTL = 16
_BEAT_SECONDS = 1.0
# A worker that has computed for so long is shown in RQ's tools: showing every small question would delay each of them.
_SHOWN_AFTER_SECONDS = 0.2
# While it computes, what RQ shows of it is renewed at these intervals; it expires after 60 seconds more.
_SHOWN_SECONDS = 15


class StopWorker(StopRequested):
    """The worker is to stop: it was asked to while it computes."""


class TileWorker(Worker):
    """A worker on the queue of its fingerprint.

    Parameters
    ----------
    store : Store
        RQ uses its connection too.
    info : WorkerInfo
        The name under which the worker holds tiles, and what it can compute.
    compute_tiles : callable
        Claims and computes tiles until there are no more.
    beat : callable
        Called at least every few seconds while the worker waits; it tells the supervisor that the worker is alive.
    stopping : callable
        Returns whether the worker should end as soon as it waits.
    """

    max_connection_wait_time = 2.0
    log_result_lifespan = False
    _last_heartbeat = 0.0
    _last_shown = 0.0
    _entry: Job | None = None
    _execution: Execution | None = None

    def __init__(
        self,
        store: Store,
        info: WorkerInfo,
        compute_tiles: Callable[[], None],
        beat: Callable[[], None] = lambda: None,
        stopping: Callable[[], bool] = lambda: False,
    ) -> None:
        self._store, self._info = store, info
        self._compute_tiles, self._beat, self._stopping = compute_tiles, beat, stopping
        self._target = wake_ups.queue(store.redis, info.fingerprint, small=info.small)
        super().__init__(
            [self._target],
            name=info.name,
            connection=store.redis,
            job_class=Entry,
            serializer=JSONSerializer,
            worker_ttl=WORKER_TTL,
            job_monitoring_interval=_SHOWN_SECONDS,
            default_result_ttl=0,
            log_job_description=False,
        )

    def heartbeat(self, timeout: int | None = None, pipeline: Any = None) -> None:
        """Renew RQ's heartbeat and the lease, at most once a second."""
        self._beat()
        if self._stopping() or self._stop_requested:
            raise StopRequested
        if monotonic() - self._last_heartbeat < _BEAT_SECONDS:
            return
        self._last_heartbeat = monotonic()
        try:
            self._store.workers.renew(self._info, LEASE_SECONDS)
            super().heartbeat(timeout, pipeline)
        except RedisError as error:
            if not is_full(error):
                raise

    def dequeue_job_and_maintain_ttl(
        self, timeout: int | None, max_idle_time: int | None = None
    ) -> tuple[Job, Queue] | None:
        """Take an entry; drop one that cannot be read. While Redis is full, wait and try again."""
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
                # entries that this worker or another one has taken; another worker does not need its entry any more
                self.connection.delete(self._target.intermediate_queue_key)

    def execute_job(self, job: Job, queue: Queue) -> None:
        """Claim and compute tiles; drop an entry that is not a wake-up. RQ would call the function of the entry."""
        reason = refusal(job)
        if reason is not None:
            wake_ups.remove_taken(self.connection, self._target, job.id)
            self._refuse(reason)
            return
        self._begin(job)
        try:
            self._compute_tiles()
        except RedisError as error:
            structlog.get_logger("grazemap_worker").warning("tiles left to others", error=type(error).__name__)
            raise
        finally:
            self._end(job)

    def _begin(self, job: Job) -> None:
        """Take the entry out of the queue, and count it. `stay_shown` shows it as executed if that takes a while."""
        self._entry, self._execution, self._last_shown = job, None, monotonic()
        try:
            with self.connection.pipeline(transaction=False) as pipeline:
                pipeline.lrem(self._target.intermediate_queue_key, 1, job.id)
                pipeline.delete(job.key)
                self.set_state(WorkerStatus.BUSY, pipeline)  # a request to stop interrupts no tile then
                self.increment_successful_job_count(pipeline)
                pipeline.execute()
        except RedisError as error:
            if not is_full(error):
                raise

    def _end(self, job: Job) -> None:
        """Remove what was shown of the entry."""
        execution = self._execution
        self._entry = self._execution = None
        if execution is not None:
            with suppress(RedisError), self.connection.pipeline(transaction=False) as pipeline:
                pipeline.delete(job.key)
                self.cleanup_execution(job, pipeline, execution)
                pipeline.execute()

    def show(self, waiting: WaitingJob) -> None:
        """Show that this worker computes tiles of a job, as soon as its entry is shown."""
        job, description = self._entry, " ".join(waiting)
        if job is not None and job.description != description:
            job.description = description
            if self._execution is not None:
                with suppress(RedisError), self.connection.pipeline(transaction=False) as pipeline:
                    pipeline.hset(job.key, "description", description)
                    pipeline.expire(job.key, self.get_heartbeat_ttl(job))
                    pipeline.execute()

    def stay_shown(self) -> None:
        """Show this worker and its entry in RQ's tools while it computes; nothing in the first moment.

        Raises StopWorker if the worker is to stop.
        """
        if self._stop_requested:
            raise StopWorker
        job, execution = self._entry, self._execution
        wait = _SHOWN_AFTER_SECONDS if execution is None else _SHOWN_SECONDS
        if job is None or monotonic() - self._last_shown < wait:
            return
        self._last_shown = monotonic()
        ttl = self.get_heartbeat_ttl(job)
        with suppress(RedisError), self.connection.pipeline(transaction=False) as pipeline:
            if execution is None:
                job.save(pipeline=pipeline)
                job.prepare_for_execution(self.name, pipeline)
                pipeline.expire(job.key, ttl)
                pipeline.execute()
                self._execution = self.prepare_execution(job)
                return
            super().heartbeat(ttl, pipeline)
            execution.heartbeat(job.started_job_registry, ttl, pipeline)
            pipeline.expire(job.key, ttl)
            pipeline.execute()

    def _refuse(self, reason: str) -> None:
        structlog.get_logger("grazemap_worker").warning("entry of the queue refused", reason=reason)
        self._store.count("poisoned:entries")

    def subscribe(self) -> None:
        """Do nothing: workers get no commands, so they need no connection for commands."""

    def run_maintenance_tasks(self) -> None:
        """Do nothing: the supervisor cleans up.

        RQ's own cleanup would call the failure callbacks of any entry in its registries.
        """

    def request_stop(self, signum: int, frame: Any) -> None:
        """Stop: at once if the worker waits, else with its next sign of life. `teardown` gives back the claims."""
        try:
            super().request_stop(signum, frame)  # type: ignore[no-untyped-call]
        finally:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)

    def teardown(self) -> None:
        """Give back the claims and end the lease."""
        try:
            super().teardown()  # type: ignore[no-untyped-call]
        finally:
            self._store.workers.remove(self.name, return_claims=True)
