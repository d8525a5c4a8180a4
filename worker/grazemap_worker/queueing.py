"""Entries in RQ's queues: one per tile, by name, with the JSON serializer.

The service enqueues what it submitted, the reconciler what the ledger still misses. An entry is only a hint to claim
the tile, so a doubled or a lost entry does no harm.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterable

from redis import Redis
from rq import Queue
from rq.command import send_stop_job_command
from rq.exceptions import InvalidJobOperation, NoSuchJobError
from rq.job import Job
from rq.serializers import JSONSerializer

from grazemap_worker.store.keys import queue_name

RUN_TILE = "grazemap_worker.tasks.run_tile"
# A tile takes seconds; a long trajectory or a huge curve is one tile. Over this something hangs.
TILE_TIMEOUT = 3600
FAILURE_TTL = 60
_CHUNK = 500


def queue(redis: Redis, fingerprint: str) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return Queue(queue_name(fingerprint), connection=redis, serializer=JSONSerializer)


def enqueue(redis: Redis, job_id: str, tiles: Iterable[int], fingerprint: str) -> int:
    """Queue tiles of a job; return how many. Jobs of one tile go to the front: they should not wait for a map."""
    target = queue(redis, fingerprint)
    numbers = list(tiles)
    for start in range(0, len(numbers), _CHUNK):
        entries = [
            Queue.prepare_data(
                RUN_TILE,
                args=(job_id, tile),
                job_id=f"{job_id}-{tile}-{secrets.token_hex(4)}",
                description=f"{job_id[:12]} tile {tile}",
                timeout=TILE_TIMEOUT,
                result_ttl=0,
                failure_ttl=FAILURE_TTL,
                at_front=len(numbers) == 1,
            )
            for tile in numbers[start : start + _CHUNK]
        ]
        target.enqueue_many(entries)
    return len(numbers)


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
