"""Removes from RQ's keys what killed workers left, and queues of fingerprints that no worker has. It runs no entry.

The names of the keys are read from RQ, so that the environment variable RQ_KEY_PREFIX applies. RQ_KEY_PREFIX must have
the same value for every service and worker on one Redis. An entry is what RQ calls a job.
"""

from __future__ import annotations

import time
from typing import Any

from redis import Redis
from rq import Queue, Worker
from rq.executions import WORKER_EXECUTIONS_KEY_TEMPLATE
from rq.job import Job
from rq.worker_registration import WORKERS_BY_QUEUE_KEY

from grazemap_worker.queue.wake_ups import SMALL_SUFFIX, named_queue, queue, remove_taken
from grazemap_worker.store.keys import PREFIX

# A worker drops an entry soon after it has taken the entry. One that stays taken for longer than this, in seconds, was
# left behind.
TAKEN_SECONDS = 30.0
# Maximum number of taken entries of a queue that are looked at in one round.
_MAX_TAKEN = 1000


class QueueCleanUp:
    """Removes what killed workers left in RQ's keys; remembers when it first saw each entry that workers have taken."""

    def __init__(self, fingerprint: str) -> None:
        self._fingerprint = fingerprint
        self._taken: dict[bytes, float] = {}

    def sweep(self, connection: Redis) -> None:
        """Remove entries that were left behind, expired executions, names of ended workers, and unused queues."""
        redis: Any = connection  # redis-py types every answer as bytes | str; after `connect` it is bytes
        now, taken = time.monotonic(), {}
        for small in (False, True):
            target = queue(connection, self._fingerprint, small=small)
            for entry in redis.lrange(target.intermediate_queue_key, 0, _MAX_TAKEN - 1):
                taken[entry] = self._taken.get(entry, now)
                if now - taken[entry] > TAKEN_SECONDS:
                    remove_taken(connection, target, entry)
            # the running executions, by the time when they expire
            redis.zremrangebyscore(target.started_job_registry.key, 0, time.time())
        self._taken = taken
        _sweep_queues(redis, self._fingerprint)


def _sweep_queues(redis: Any, fingerprint: str) -> None:
    """Remove the names of ended workers, and the queues of fingerprints.

    The store forgets a fingerprint that no worker has had for `FINGERPRINT_REMEMBERED` seconds; then its queues go.
    """
    own = {queue(redis, fingerprint, small=small).name for small in (False, True)}
    # names of queues of other programs may be any bytes
    keys = (key.decode("utf-8", "replace") for key in redis.smembers(Queue.redis_queues_keys))
    names = (key.removeprefix(Queue.redis_queue_namespace_prefix) for key in keys)
    for name in own.union(name for name in names if name.startswith(PREFIX)):
        _remove_dangling(redis, WORKERS_BY_QUEUE_KEY % name)
        queue_fingerprint = name.removeprefix(PREFIX).removesuffix(SMALL_SUFFIX)
        if queue_fingerprint != fingerprint and not redis.exists(f"{PREFIX}fingerprint:{queue_fingerprint}"):
            _remove_queue(redis, name)
    _remove_dangling(redis, Worker.redis_workers_keys)


def _remove_queue(redis: Any, name: str) -> None:
    """Remove a queue and RQ's registries of it, with all entries."""
    target = named_queue(redis, name)
    lists = target.key, target.intermediate_queue_key
    for key in lists:
        for entry in redis.lrange(key, 0, -1):
            redis.delete(Job.key_for(entry.decode("utf-8", "replace")))
    registries = target.started_job_registry.key, target.failed_job_registry.key
    redis.delete(*lists, *registries, WORKERS_BY_QUEUE_KEY % name)
    redis.srem(Queue.redis_queues_keys, target.key)


def _remove_dangling(redis: Any, members: str) -> None:
    """Remove from a set of keys those that do not exist; `members` is the key of the set."""
    names = list(redis.smembers(members))
    pipeline = redis.pipeline(transaction=False)
    for name in names:
        pipeline.exists(name)
    dangling = [name for name, exists in zip(names, pipeline.execute(), strict=True) if not exists]
    if dangling:
        redis.srem(members, *dangling)


def forget_worker(redis: Redis, name: str, fingerprint: str) -> None:
    """Remove a worker that has ended from RQ's keys."""
    description = Worker.redis_worker_namespace_prefix + name
    pipeline = redis.pipeline(transaction=False)
    pipeline.srem(Worker.redis_workers_keys, description)
    for small in (False, True):
        pipeline.srem(WORKERS_BY_QUEUE_KEY % queue(redis, fingerprint, small=small).name, description)
    pipeline.delete(description, WORKER_EXECUTIONS_KEY_TEMPLATE.format(name))
    pipeline.execute()
