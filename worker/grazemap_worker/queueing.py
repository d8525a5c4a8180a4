"""Entries in RQ's queues: one per tile, by name, with the JSON serializer.

The service enqueues what it submitted, the reconciler what the ledger still misses. An entry is only a hint to claim
the tile, so a doubled or a lost entry does no harm.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterable
from itertools import islice
from typing import Any

from redis import Redis
from rq import Queue, Worker
from rq.command import send_stop_job_command
from rq.exceptions import InvalidJobOperation, NoSuchJobError
from rq.job import Job
from rq.serializers import JSONSerializer
from rq.utils import as_text
from rq.worker_registration import WORKERS_BY_QUEUE_KEY

from grazemap_worker.store.keys import ASSEMBLY, PREFIX, QUEUE_PREFIX, queue_name

RUN_TILE = "grazemap_worker.tasks.run_tile"
# A tile takes seconds; a long trajectory or a huge curve is one tile. Over this something hangs.
TILE_TIMEOUT = 3600
FAILURE_TTL = 60
# Entries of one job that are queued at a time; the reconciler adds the next ones as workers take them.
QUEUED_AHEAD = 1000
# Single tiles that may be put before what waits first; then it has to be taken before more may.
MOST_OVERTAKING = 8
# Between taking an entry and beginning it a worker only forks.
TAKEN_SECONDS = 30.0


def queue(redis: Redis, fingerprint: str) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return Queue(queue_name(fingerprint), connection=redis, serializer=JSONSerializer)


def enqueue(redis: Redis, job_id: str, tiles: Iterable[int], fingerprint: str) -> int:
    """Queue tiles of a job, at most the first `QUEUED_AHEAD`; return how many.

    The assembly of a map goes to the front. So does a single tile, as long as not too many have done so: a curve, or
    the last missing piece of a map, should not wait for another map, nor keep it waiting for ever.
    """
    numbers = list(islice(tiles, QUEUED_AHEAD))
    at_front = len(numbers) == 1 and (numbers[0] == ASSEMBLY or _may_overtake(redis, queue(redis, fingerprint)))
    entries = [
        Queue.prepare_data(
            RUN_TILE,
            args=(job_id, tile),
            job_id=f"{job_id}-{tile}-{secrets.token_hex(4)}",
            description=f"{job_id[:12]} tile {tile}",
            timeout=TILE_TIMEOUT,
            result_ttl=0,
            failure_ttl=FAILURE_TTL,
            at_front=at_front,
        )
        for tile in numbers
    ]
    if entries:
        queue(redis, fingerprint).enqueue_many(entries)
    return len(entries)


def _may_overtake(connection: Redis, target: Queue) -> bool:
    """Return whether another entry may go to the front, and note that it did.

    At most `MOST_OVERTAKING` go before the entry that was first when the first of them came; the next ones wait until
    it is taken, so that each entry is reached. (Two that ask at once may go before it both: this is no promise.)
    """
    redis: Any = connection  # redis-py's types are those of bytes and of text at once
    noted = _overtaken_key(target)
    head = redis.lrange(target.key, 0, 2 * MOST_OVERTAKING)
    overtaken, count = redis.hmget(noted, "entry", "count")
    if not head:
        return False
    if overtaken not in head:
        redis.hset(noted, mapping={"entry": head[0], "count": 1})
        return True
    if int(count) >= MOST_OVERTAKING:
        return False
    redis.hincrby(noted, "count", 1)
    return True


def _overtaken_key(target: Queue) -> str:
    return f"{target.key}:overtaken"


def queued(redis: Redis, fingerprint: str) -> set[tuple[str, int]]:
    """Return (job id, tile) of what is waiting in a queue."""
    found = (parse_entry(entry) for entry in queue(redis, fingerprint).get_job_ids())
    return {entry for entry in found if entry}


def cancel(redis: Redis, job_id: str, fingerprint: str) -> int:
    """Take a job's entries out of the queue and stop the running ones; return how many were told.

    Dismiss the job first, so that no worker claims another of its tiles.
    """
    target = queue(redis, fingerprint)
    waiting = [entry for entry in target.get_job_ids() if _belongs(entry, job_id)]
    if waiting:
        pipeline = redis.pipeline(transaction=False)
        for entry in waiting:
            pipeline.lrem(target.key, 1, entry)
            pipeline.delete(Job.key_for(entry))
        pipeline.execute()
    stopped = 0
    for entry in target.started_job_registry.get_job_ids(cleanup=False):
        if not _belongs(entry, job_id):
            continue
        try:
            send_stop_job_command(redis, entry, serializer=JSONSerializer)
            stopped += 1
        except (InvalidJobOperation, NoSuchJobError):
            continue  # it ended, or has not begun and will find the job dismissed
    return len(waiting) + stopped


def drop(redis: Redis, entry: str, fingerprint: str) -> None:
    """Forget an entry that a worker has taken and will not perform."""
    target = queue(redis, fingerprint)
    pipeline = redis.pipeline(transaction=False)
    pipeline.lrem(target.intermediate_queue_key, 1, entry)
    pipeline.delete(Job.key_for(entry))
    pipeline.execute()


def sweep(connection: Redis, fingerprint: str) -> None:
    """Remove what killed workers leave in RQ's registries, without performing any of it.

    An entry that a worker took and did not begin within `TAKEN_SECONDS` is forgotten, and so is one whose worker
    stopped renewing it; the ledger knows which tiles that concerns.
    """
    redis: Any = connection  # redis-py's types are those of bytes and of text at once
    target = queue(connection, fingerprint)
    now = time.time()
    started = target.started_job_registry
    for member in redis.zrangebyscore(started.key, 0, now):
        composite = as_text(member)
        entry, _, _execution = composite.partition(":")
        pipeline = redis.pipeline(transaction=False)
        pipeline.zrem(started.key, composite)
        pipeline.delete(f"rq:execution:{composite}", f"rq:executions:{entry}", Job.key_for(entry))
        pipeline.execute()
    redis.zremrangebyscore(target.failed_job_registry.key, 0, now)

    seen_key = target.intermediate_queue_key + ":seen"
    taken = {as_text(member) for member in redis.lrange(target.intermediate_queue_key, 0, -1)}
    seen = {as_text(member): float(score) for member, score in redis.zrange(seen_key, 0, -1, withscores=True)}
    for entry, since in seen.items():
        if entry not in taken:
            redis.zrem(seen_key, entry)
        elif now - since > TAKEN_SECONDS:
            redis.zrem(seen_key, entry)
            drop(redis, entry, fingerprint)
    if fresh := dict.fromkeys(taken - seen.keys(), now):
        redis.zadd(seen_key, fresh, nx=True)
    _sweep_queues(connection, fingerprint)


def _sweep_queues(connection: Redis, fingerprint: str) -> None:
    """Remove what names workers that are gone, and the queues of numerics that nobody has had for a while."""
    redis: Any = connection
    known = {as_text(name) for name in redis.smembers(Queue.redis_queues_keys)}
    prefix = Queue.redis_queue_namespace_prefix + QUEUE_PREFIX
    ours = {fingerprint, *(name.removeprefix(prefix) for name in known if name.startswith(prefix))}
    for found in sorted(ours):
        members = WORKERS_BY_QUEUE_KEY % queue_name(found)
        _remove_gone(redis, members)
        if found != fingerprint and not redis.exists(f"{PREFIX}fingerprint:{found}"):
            _remove_queue(redis, queue_name(found))
    _remove_gone(redis, Worker.redis_workers_keys)


def forget_queues(connection: Redis, prefix: str) -> None:
    """Remove the queues of an earlier layout of the store, with their entries, none of which is performed.

    `prefix` is that of the layout's keys; its queues have it and a fingerprint as names.
    """
    redis: Any = connection
    namespace = Queue.redis_queue_namespace_prefix
    names = [as_text(key).removeprefix(namespace) for key in redis.smembers(Queue.redis_queues_keys)]
    for name in sorted(names):
        if name.startswith(prefix) and ":" not in name.removeprefix(prefix):
            _remove_queue(redis, name)


def _remove_queue(redis: Any, name: str) -> None:
    target = Queue(name, connection=redis, serializer=JSONSerializer)
    started = target.started_job_registry
    for member in redis.zrange(started.key, 0, -1):
        composite = as_text(member)
        entry = composite.partition(":")[0]
        redis.delete(f"rq:execution:{composite}", f"rq:executions:{entry}", Job.key_for(entry))
    for entry in redis.lrange(target.intermediate_queue_key, 0, -1):
        redis.delete(Job.key_for(as_text(entry)))
    seen = target.intermediate_queue_key + ":seen"
    members = WORKERS_BY_QUEUE_KEY % name
    registries = (started.key, target.failed_job_registry.key)
    redis.delete(target.intermediate_queue_key, seen, _overtaken_key(target), members, *registries)
    target.delete()


def _remove_gone(redis: Any, members: str) -> None:
    """Remove from a set of names of keys those that are not there."""
    names = list(redis.smembers(members))
    pipeline = redis.pipeline(transaction=False)
    for name in names:
        pipeline.exists(name)
    gone = [name for name, there in zip(names, pipeline.execute(), strict=True) if not there]
    if gone:
        redis.srem(members, *gone)


def forget_worker(redis: Redis, name: str, fingerprint: str) -> None:
    """Remove a worker that is known to be gone from RQ's lists."""
    pipeline = redis.pipeline(transaction=False)
    key = Worker.redis_worker_namespace_prefix + name
    pipeline.srem(Worker.redis_workers_keys, key)
    pipeline.srem(WORKERS_BY_QUEUE_KEY % queue_name(fingerprint), key)
    pipeline.delete(key)
    pipeline.execute()


def parse_entry(entry: str) -> tuple[str, int] | None:
    """Return (job id, tile) from the id of a queue's entry, or None when it is not one of ours."""
    head, _, _nonce = entry.rpartition("-")
    # The assembly's number is negative: "<id>--1-<nonce>".
    job_id, separator, tile = head.partition("-")
    if not separator:
        return None
    try:
        return job_id, int(tile)
    except ValueError:
        return None


def _belongs(entry: str, job_id: str) -> bool:
    return entry.startswith(job_id + "-")
