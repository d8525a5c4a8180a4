"""Wake-ups: entries in RQ's queues, which say that there are tiles to claim.

>>> entry = queue(redis, fingerprint, small=False).jobs[0]  # sent with `wake_worker` when the job was started
>>> entry.func_name, entry.args == ["unfolding-maps", job.id]
('grazemap_worker.tasks.compute_waiting_tiles', True)

A worker that takes a wake-up claims tiles until the ledger has no more for it, of whichever job. The entry names a job
that waits, so that `rq info` and dashboards show work; the worker claims what is fair. A duplicate or a lost entry does
no harm: while tiles wait, the reconciler sends further wake-ups. Each fingerprint has two queues, one of them for small
jobs.
"""

from __future__ import annotations

import secrets

from redis import Redis
from rq import Queue
from rq.serializers import JSONSerializer

from grazemap_worker.queue import rq_keys
from grazemap_worker.store.keys import queue_name
from grazemap_worker.store.records import WaitingJob

# The function that a wake-up names: what the worker then does. RQ does not import it.
MARKER = "grazemap_worker.tasks.compute_waiting_tiles"
# Wake-ups that wait in a queue at a time. A worker that leaves tiles to others sends the next one itself.
MAX_WAITING = 2
SMALL_SUFFIX = ":small"


def queue(redis: Redis, fingerprint: str, *, small: bool) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return named_queue(redis, queue_name(fingerprint) + (SMALL_SUFFIX if small else ""))


def named_queue(redis: Redis, name: str) -> Queue:
    """Return the queue of a name."""
    return Queue(name, connection=redis, serializer=JSONSerializer)


def wake_worker(redis: Redis, fingerprint: str, job: WaitingJob, *, small: bool) -> None:
    """Send a wake-up for a job to the workers with this fingerprint, unless enough wake-ups wait in the queue."""
    target = queue(redis, fingerprint, small=small)
    if redis.llen(rq_keys.waiting_key(target)) < MAX_WAITING:
        wake_up = Queue.prepare_data(
            MARKER,
            args=tuple(job),
            job_id=f"{job.id}-{secrets.token_hex(4)}",
            description=description(job),
            timeout=-1,
            result_ttl=0,
        )
        target.enqueue_many([wake_up])


def description(job: WaitingJob) -> str:
    """Return what RQ's tools show of an entry."""
    return f"{job.process} {job.id}"


def drop(redis: Redis, target: Queue, entry: str | bytes) -> None:
    """Remove an entry that a worker has taken."""
    pipeline = redis.pipeline(transaction=False)
    pipeline.lrem(rq_keys.taken_key(target), 1, entry)  # type: ignore[arg-type]  # the bytes may not be text
    if isinstance(entry, str) or entry.isascii():
        pipeline.delete(rq_keys.entry_key(entry if isinstance(entry, str) else entry.decode()))
    pipeline.execute()
