"""Entries in RQ's queues: bells, which say that there are tiles to claim.

A worker that takes one claims tiles until the ledger has no more for it. So an entry holds no data, and a duplicate or
lost one does no harm: the reconciler rings again while tiles wait. Each fingerprint has two queues, one of them for
small jobs.
"""

from __future__ import annotations

import secrets

from redis import Redis
from rq import Queue
from rq.serializers import JSONSerializer

from grazemap_worker.queue import rq_keys
from grazemap_worker.store.keys import queue_name

DRAIN = "grazemap_worker.tasks.drain"
# Bells that wait at a time: each worker that takes one and leaves tiles rings for the next worker.
MOST_WAITING = 2


def queue(redis: Redis, fingerprint: str, *, small: bool) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return named_queue(redis, queue_name(fingerprint) + (SMALL if small else ""))


SMALL = ":small"


def named_queue(redis: Redis, name: str) -> Queue:
    """Return the queue of a name."""
    return Queue(name, connection=redis, serializer=JSONSerializer)


def ring(redis: Redis, fingerprint: str, *, small: bool) -> None:
    """Wake a worker, unless enough bells wait already."""
    target = queue(redis, fingerprint, small=small)
    if redis.llen(rq_keys.waiting_key(target)) < MOST_WAITING:
        bell = Queue.prepare_data(
            DRAIN,
            args=(),
            job_id=f"bell-{secrets.token_hex(8)}",
            description="tiles to claim",
            timeout=-1,
            result_ttl=0,
        )
        target.enqueue_many([bell])


def drop(redis: Redis, target: Queue, entry: str | bytes) -> None:
    """Forget an entry that a worker has taken."""
    pipeline = redis.pipeline(transaction=False)
    pipeline.lrem(rq_keys.taken_key(target), 1, entry)  # type: ignore[arg-type]  # bytes that are no text too
    if isinstance(entry, str) or entry.isascii():
        pipeline.delete(rq_keys.entry_key(entry if isinstance(entry, str) else entry.decode()))
    pipeline.execute()
