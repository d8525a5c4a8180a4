"""Entries in RQ's queues: one per tile, by name, with the JSON serializer.

The service enqueues the tiles of a new job, the reconciler those that the ledger still lacks. An entry is only a hint
to claim the tile, so a duplicate or lost entry does no harm.
"""

from __future__ import annotations

import re
import secrets
from collections.abc import Iterable
from itertools import islice
from typing import Any

from redis import Redis
from rq import Queue
from rq.command import send_stop_job_command
from rq.exceptions import InvalidJobOperation, NoSuchJobError
from rq.serializers import JSONSerializer

from grazemap_worker.queue import rq_keys
from grazemap_worker.store.keys import ASSEMBLY, queue_name

RUN_TILE = "grazemap_worker.tasks.run_tile"
# Time limit of a tile, in seconds: most tiles take seconds, but a long trajectory or a large curve is one tile.
TILE_TIMEOUT = 3600
FAILURE_TTL = 60
# Entries of one job that are queued at a time; the reconciler adds the next ones as workers take them.
QUEUED_AHEAD = 1000
# Maximum number of single tiles that are put before the first entry until it is taken.
MOST_OVERTAKING = 8
# "<id>-<tile>-<nonce>"; the assembly's number is negative.
_ENTRY = re.compile(r"([^-]*)-(-?\d+)-[^-]*", re.ASCII)


def queue(redis: Redis, fingerprint: str) -> Queue:
    """Return the queue that workers with this fingerprint listen to."""
    return named_queue(redis, queue_name(fingerprint))


def named_queue(redis: Redis, name: str) -> Queue:
    """Return the queue of a name."""
    return Queue(name, connection=redis, serializer=JSONSerializer)


def enqueue(redis: Redis, job_id: str, tiles: Iterable[int], fingerprint: str) -> int:
    """Queue tiles of a job, at most the first `QUEUED_AHEAD`; return how many.

    The assembly of a map goes to the front. So does a single tile, up to a limit: a curve, or the last missing tile of
    a map, should not wait for another map, nor delay it for ever.
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


def _may_overtake(redis: Any, target: Queue) -> bool:
    """Return whether another entry may go to the front; if so, it is counted.

    At most `MOST_OVERTAKING` entries are put before the first entry until it is taken, so that every entry is reached.
    (Two concurrent callers may both overtake, so the bound is approximate.)
    """
    noted = overtaken_key(target)
    head = redis.lrange(rq_keys.waiting_key(target), 0, 2 * MOST_OVERTAKING)
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


def overtaken_key(target: Queue) -> str:
    """Return the key of the number of entries that went before the first one."""
    return f"{rq_keys.waiting_key(target)}:overtaken"


def queued(redis: Redis, fingerprint: str) -> set[tuple[str, int]]:
    """Return (job id, tile) of the entries that wait in a queue."""
    found = (parse_entry(entry) for entry in queue(redis, fingerprint).get_job_ids())
    return {entry for entry in found if entry}


def cancel(redis: Redis, job_id: str, fingerprint: str) -> int:
    """Take a job's entries out of the queue and stop the running ones; return how many there were.

    Dismiss the job first, so that no worker claims another of its tiles.
    """
    target = queue(redis, fingerprint)
    waiting = [entry for entry in target.get_job_ids() if entry.startswith(f"{job_id}-")]
    if waiting:
        pipeline = redis.pipeline(transaction=False)
        for entry in waiting:
            pipeline.lrem(rq_keys.waiting_key(target), 1, entry)
            pipeline.delete(rq_keys.entry_key(entry))
        pipeline.execute()
    stopped = 0
    for entry in rq_keys.started_entries(target):
        if not entry.startswith(f"{job_id}-"):
            continue
        try:
            send_stop_job_command(redis, entry, serializer=JSONSerializer)
            stopped += 1
        except (InvalidJobOperation, NoSuchJobError):
            continue  # it has ended, or has not started and will find the job dismissed
    return len(waiting) + stopped


def drop(redis: Redis, entry: str, fingerprint: str) -> None:
    """Forget an entry that a worker has taken and will not perform."""
    target = queue(redis, fingerprint)
    pipeline = redis.pipeline(transaction=False)
    pipeline.lrem(rq_keys.taken_key(target), 1, entry)
    pipeline.delete(rq_keys.entry_key(entry))
    pipeline.execute()


def parse_entry(entry: str) -> tuple[str, int] | None:
    """Return (job id, tile) from the id of a queue's entry, or None if it is not a tile's."""
    found = _ENTRY.fullmatch(entry)
    return (found[1], int(found[2])) if found else None
