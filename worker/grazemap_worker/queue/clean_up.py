"""Removes from RQ's keys what killed workers left, and queues of fingerprints that no worker has. It runs no entry."""

from __future__ import annotations

import time
from typing import Any

from redis import Redis

from grazemap_worker.queue import rq_keys
from grazemap_worker.queue.wake_ups import SMALL_SUFFIX, named_queue, queue, remove_taken
from grazemap_worker.store.keys import PREFIX, QUEUE_PREFIX, queue_name

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
            for entry in redis.lrange(rq_keys.taken_key(target), 0, _MAX_TAKEN - 1):
                taken[entry] = self._taken.get(entry, now)
                if now - taken[entry] > TAKEN_SECONDS:
                    remove_taken(connection, target, entry)
            redis.zremrangebyscore(rq_keys.started_key(target), 0, time.time())
        self._taken = taken
        _sweep_queues(redis, self._fingerprint)


def _sweep_queues(redis: Any, fingerprint: str) -> None:
    """Remove the names of ended workers, and the queues of fingerprints.

    The store forgets a fingerprint that no worker has had for `FINGERPRINT_REMEMBERED` seconds; then its queues go.
    """
    own = queue_name(fingerprint)
    for name in {own, own + SMALL_SUFFIX, *_queue_names(redis, QUEUE_PREFIX)}:
        _remove_dangling(redis, rq_keys.listeners_key(name))
        queue_fingerprint = name.removeprefix(QUEUE_PREFIX).removesuffix(SMALL_SUFFIX)
        if queue_fingerprint != fingerprint and not redis.exists(f"{PREFIX}fingerprint:{queue_fingerprint}"):
            _remove_queue(redis, name)
    _remove_dangling(redis, rq_keys.ALL_WORKERS)


def _queue_names(redis: Any, prefix: str) -> list[str]:
    """Return the names of RQ's queues that begin with a prefix; names of other queues may be any bytes."""
    names = (rq_keys.queue_name_of(key.decode("utf-8", "replace")) for key in redis.smembers(rq_keys.ALL_QUEUES))
    return sorted(name for name in names if name.startswith(prefix))


def _remove_queue(redis: Any, name: str) -> None:
    """Remove a queue and RQ's registries of it, with all entries."""
    target = named_queue(redis, name)
    for key in (rq_keys.waiting_key(target), rq_keys.taken_key(target)):
        for entry in redis.lrange(key, 0, -1):
            redis.delete(rq_keys.entry_key(entry.decode("utf-8", "replace")))
        redis.delete(key)
    for key in (rq_keys.started_key(target), rq_keys.failed_key(target), rq_keys.listeners_key(name)):
        redis.delete(key)
    redis.srem(rq_keys.ALL_QUEUES, target.key)


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
    description, executions = rq_keys.worker_keys(name)
    pipeline = redis.pipeline(transaction=False)
    pipeline.srem(rq_keys.ALL_WORKERS, description)
    for listened in (queue_name(fingerprint), queue_name(fingerprint) + SMALL_SUFFIX):
        pipeline.srem(rq_keys.listeners_key(listened), description)
    pipeline.delete(description, executions)
    pipeline.execute()
