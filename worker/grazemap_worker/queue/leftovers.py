"""Removing from RQ's keys what killed workers leave there, without performing any of it."""

from __future__ import annotations

import time
from typing import Any

from redis import Redis

from grazemap_worker.queue import rq_keys
from grazemap_worker.queue.bells import SMALL, drop, named_queue, queue
from grazemap_worker.store.keys import PREFIX, QUEUE_PREFIX, queue_name

# Seconds from taking an entry to dropping it; in between, a worker only reads it.
TAKEN_SECONDS = 30.0
_MOST_TAKEN = 1000


class Leftovers:
    """Remembers the entries that workers have taken, to remove those that were not dropped in time."""

    def __init__(self, fingerprint: str) -> None:
        self._fingerprint = fingerprint
        self._taken: dict[bytes, float] = {}

    def sweep(self, connection: Redis) -> None:
        """Remove what killed workers leave: entries that were taken `TAKEN_SECONDS` ago, names, and unused queues."""
        redis: Any = connection  # redis-py's types allow bytes and text
        now, taken = time.monotonic(), {}
        for small in (False, True):
            target = queue(connection, self._fingerprint, small=small)
            for entry in redis.lrange(rq_keys.taken_key(target), 0, _MOST_TAKEN):
                taken[entry] = self._taken.get(entry, now)
                if now - taken[entry] > TAKEN_SECONDS:
                    drop(connection, target, entry)
        self._taken = taken
        _sweep_queues(redis, self._fingerprint)


def _sweep_queues(redis: Any, fingerprint: str) -> None:
    """Remove the names of ended workers, and the queues of numerics that no worker has had for some time."""
    own = queue_name(fingerprint)
    for name in {own, own + SMALL, *_queues_below(redis, QUEUE_PREFIX)}:
        _remove_gone(redis, rq_keys.listeners_key(name))
        found = name.removeprefix(QUEUE_PREFIX).removesuffix(SMALL)
        if found != fingerprint and not redis.exists(f"{PREFIX}fingerprint:{found}"):
            _remove_queue(redis, name)
    _remove_gone(redis, rq_keys.ALL_WORKERS)


def _queues_below(redis: Any, prefix: str) -> list[str]:
    """Return the names of RQ's queues that begin with a prefix; others may have any bytes as names."""
    names = (rq_keys.queue_of(key.decode("utf-8", "replace")) for key in redis.smembers(rq_keys.ALL_QUEUES))
    return sorted(name for name in names if name.startswith(prefix))


def _remove_queue(redis: Any, name: str) -> None:
    """Remove a queue and RQ's registries of it, with what is in them."""
    target = named_queue(redis, name)
    for key in (rq_keys.waiting_key(target), rq_keys.taken_key(target)):
        for entry in redis.lrange(key, 0, -1):
            redis.delete(rq_keys.entry_key(entry.decode("utf-8", "replace")))
        redis.delete(key)
    for key in (rq_keys.started_key(target), rq_keys.failed_key(target), rq_keys.listeners_key(name)):
        redis.delete(key)
    redis.srem(rq_keys.ALL_QUEUES, target.key)


def _remove_gone(redis: Any, members: str) -> None:
    """Remove from a set of names of keys those without a key."""
    names = list(redis.smembers(members))
    pipeline = redis.pipeline(transaction=False)
    for name in names:
        pipeline.exists(name)
    gone = [name for name, there in zip(names, pipeline.execute(), strict=True) if not there]
    if gone:
        redis.srem(members, *gone)


def forget_worker(redis: Redis, name: str, fingerprint: str) -> None:
    """Remove a worker that has ended from RQ's keys."""
    description, executions = rq_keys.worker_keys(name)
    pipeline = redis.pipeline(transaction=False)
    pipeline.srem(rq_keys.ALL_WORKERS, description)
    for name in (queue_name(fingerprint), queue_name(fingerprint) + SMALL):
        pipeline.srem(rq_keys.listeners_key(name), description)
    pipeline.delete(description, executions)
    pipeline.execute()
