"""Removing from RQ's keys what killed workers leave there, without performing any of it."""

from __future__ import annotations

import time
from typing import Any

from redis import Redis
from rq.utils import as_text

from grazemap_worker.queue import rq_keys
from grazemap_worker.queue.entries import drop, named_queue, overtaken_key, queue
from grazemap_worker.store.keys import PREFIX, queue_name

# Seconds from taking an entry to starting it; in between, a worker only forks.
TAKEN_SECONDS = 30.0


def sweep(connection: Redis, fingerprint: str) -> None:
    """Remove what killed workers leave in RQ's registries.

    An entry that a worker took and did not start within `TAKEN_SECONDS` is removed, and so is one that its worker no
    longer renews. The ledger has the tiles of these entries.
    """
    redis: Any = connection  # redis-py's types allow bytes and text
    target = queue(connection, fingerprint)
    now = time.time()
    started = rq_keys.started_key(target)
    for member in redis.zrangebyscore(started, 0, now):
        composite = as_text(member)
        entry, keys = rq_keys.execution_keys(connection, composite)
        pipeline = redis.pipeline(transaction=False)
        pipeline.zrem(started, composite)
        pipeline.delete(*keys, rq_keys.entry_key(entry))
        pipeline.execute()
    redis.zremrangebyscore(rq_keys.failed_key(target), 0, now)
    _sweep_taken(redis, fingerprint, now)
    _sweep_queues(redis, fingerprint)


def _sweep_taken(redis: Any, fingerprint: str, now: float) -> None:
    """Remove entries that were taken `TAKEN_SECONDS` ago and not started; note when others were first seen."""
    taken_key = rq_keys.taken_key(queue(redis, fingerprint))
    seen_key = _seen_key(taken_key)
    taken = {as_text(member) for member in redis.lrange(taken_key, 0, -1)}
    seen = {as_text(member): float(score) for member, score in redis.zrange(seen_key, 0, -1, withscores=True)}
    for entry, since in seen.items():
        if entry not in taken:
            redis.zrem(seen_key, entry)
        elif now - since > TAKEN_SECONDS:
            redis.zrem(seen_key, entry)
            drop(redis, entry, fingerprint)
    if fresh := dict.fromkeys(taken - seen.keys(), now):
        redis.zadd(seen_key, fresh, nx=True)


def _sweep_queues(redis: Any, fingerprint: str) -> None:
    """Remove the names of ended workers, and the queues of numerics that no worker has had for some time."""
    known = {rq_keys.fingerprint_of(as_text(key)) for key in redis.smembers(rq_keys.ALL_QUEUES)}
    for found in sorted({fingerprint, *(one for one in known if one is not None)}):
        _remove_gone(redis, rq_keys.listeners_key(queue_name(found)))
        if found != fingerprint and not redis.exists(f"{PREFIX}fingerprint:{found}"):
            _remove_queue(redis, queue_name(found))
    _remove_gone(redis, rq_keys.ALL_WORKERS)


def forget_queues(connection: Redis, prefix: str) -> None:
    """Remove the queues of an earlier layout of the store, with their entries, none of which is performed.

    `prefix` is that of the layout's keys; its queues have it and a fingerprint as names.
    """
    redis: Any = connection
    for name in sorted(rq_keys.queue_of(as_text(key)) for key in redis.smembers(rq_keys.ALL_QUEUES)):
        if name.startswith(prefix) and ":" not in name.removeprefix(prefix):
            _remove_queue(redis, name)


def _remove_queue(redis: Any, name: str) -> None:
    target = named_queue(redis, name)
    started, taken_key = rq_keys.started_key(target), rq_keys.taken_key(target)
    for member in redis.zrange(started, 0, -1):
        entry, keys = rq_keys.execution_keys(redis, as_text(member))
        redis.delete(*keys, rq_keys.entry_key(entry))
    for entry in redis.lrange(taken_key, 0, -1):
        redis.delete(rq_keys.entry_key(as_text(entry)))
    registries = (started, rq_keys.failed_key(target), rq_keys.listeners_key(name))
    redis.delete(taken_key, _seen_key(taken_key), overtaken_key(target), *registries)
    target.delete()


def _seen_key(taken_key: str) -> str:
    return f"{taken_key}:seen"


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
    pipeline.srem(rq_keys.listeners_key(queue_name(fingerprint)), description)
    pipeline.delete(description, executions)
    pipeline.execute()
