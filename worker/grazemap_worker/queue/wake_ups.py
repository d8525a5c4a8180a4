"""Wake-ups: entries in RQ's queues, which say that there are tiles to claim.

>>> entry = queue(redis, fingerprint, small=True).jobs[0]  # the job is small: its estimate is below 50 ms
>>> entry.func_name, entry.args == ["unfolding-maps", job.id]
('grazemap_worker.tasks.compute_waiting_tiles', True)

A worker that takes a wake-up claims tiles of any job until the ledger has none left for it. The entry names a job that
waits, but only for `rq info` and dashboards: the ledger decides, by priority and fairness, which tile the worker gets.
A duplicate or a lost entry does no harm: while tiles wait, the reconciler sends further wake-ups. Each fingerprint of
workers (of their core and their processor) has two queues, one for small jobs and one for all others.
"""

from __future__ import annotations

import secrets

from redis import Redis
from rq import Queue
from rq.job import Job
from rq.serializers import JSONSerializer

from grazemap_worker.store.keys import PREFIX
from grazemap_worker.store.records import WaitingJob

# The function that a worker calls for a wake-up. The name in an entry is compared as a text; RQ never imports it.
WAKE_UP_FUNCTION = "grazemap_worker.tasks.compute_waiting_tiles"
# About the maximum number of wake-ups that wait in a queue: several senders may add one after the check. A worker that
# leaves tiles to other workers sends the next wake-up.
MAX_WAITING = 2
SMALL_SUFFIX = ":small"


def queue(redis: Redis, fingerprint: str, *, small: bool) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return named_queue(redis, PREFIX + fingerprint + (SMALL_SUFFIX if small else ""))


def named_queue(redis: Redis, name: str) -> Queue:
    """Return the queue of a name."""
    return Queue(name, connection=redis, serializer=JSONSerializer)


def wake_worker(redis: Redis, fingerprint: str, job: WaitingJob, *, small: bool) -> None:
    """Send a wake-up for a job to the workers with this fingerprint, unless enough wake-ups wait in the queue."""
    target = queue(redis, fingerprint, small=small)
    if target.count < MAX_WAITING:
        wake_up = Queue.prepare_data(
            WAKE_UP_FUNCTION,
            args=tuple(job),
            job_id=f"{job.id}-{secrets.token_hex(4)}",
            description=" ".join(job),  # what RQ's tools show of an entry
            timeout=-1,
            result_ttl=0,
        )
        target.enqueue_many([wake_up])


def remove_taken(redis: Redis, target: Queue, entry: str | bytes) -> None:
    """Remove an entry from the list of those that workers have taken, and delete its fields."""
    pipeline = redis.pipeline(transaction=False)
    pipeline.lrem(target.intermediate_queue_key, 1, entry)  # type: ignore[arg-type]  # the bytes may not be text
    if isinstance(entry, str) or entry.isascii():  # all ids of wake-ups are; another entry leaves the list only
        pipeline.delete(Job.key_for(entry if isinstance(entry, str) else entry.decode()))
    pipeline.execute()
