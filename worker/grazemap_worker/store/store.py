"""The store: jobs, tiles, results and workers on one Redis."""

from __future__ import annotations

from typing import get_args

from redis import Redis

from grazemap.wire import Status
from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.jobs import Jobs
from grazemap_worker.store.keys import PREFIX
from grazemap_worker.store.ledger import Results, Tiles
from grazemap_worker.store.older_layouts import OlderLayouts
from grazemap_worker.store.records import Counts
from grazemap_worker.store.workers import Workers

DEFAULT_RESULT_BYTES = 2 << 30


class Store:
    """Everything that the service and the workers share.

    Parameters
    ----------
    redis : Redis
        As `connect` gives it: answers are bytes.
    result_bytes : int
        Byte budget of all results together.

    Attributes
    ----------
    jobs : Jobs
        Records and events.
    tiles : Tiles
        The ledger of tiles: claims, finished tiles, failures.
    results : Results
        The npz files of finished jobs.
    workers : Workers
        The leases of workers.
    older_layouts : OlderLayouts
        What an earlier version of grazemap stored.

    Raises
    ------
    redis.exceptions.RedisError
        From any method, when Redis is unavailable; nothing is retried here.
    """

    def __init__(self, redis: Redis, result_bytes: int = DEFAULT_RESULT_BYTES) -> None:
        scripts = Scripts(redis)
        self.redis = redis
        self._redis = scripts.redis
        self.workers = Workers(scripts)
        self.jobs = Jobs(scripts, self.workers)
        self.tiles = Tiles(scripts, self.jobs)
        self.results = Results(scripts, result_bytes)
        self.older_layouts = OlderLayouts(scripts)

    def count(self, name: str) -> None:
        """Count something that happened, for metrics."""
        self._redis.hincrby(f"{PREFIX}counts", name, 1)

    def try_write(self) -> None:
        """Write a key of no meaning. Raises RedisError where Redis refuses writes."""
        self._redis.set(f"{PREFIX}written", 1, ex=60)

    def counts(self) -> Counts:
        """Return what the store holds, for metrics."""
        names: tuple[Status, ...] = get_args(Status)
        pipeline = self._redis.pipeline(transaction=False)
        for name in names:
            pipeline.zcard(f"{PREFIX}status:{name}")
        pipeline.get(f"{PREFIX}unfinished:tiles")
        pipeline.hlen(f"{PREFIX}results:sizes")
        pipeline.hgetall(f"{PREFIX}bytes")
        pipeline.hgetall(f"{PREFIX}counts")
        *by_status, remaining, results, stored, counted = pipeline.execute()
        return Counts(
            jobs=dict(zip(names, by_status, strict=True)),
            pending_tiles=int(remaining or 0),
            workers=len([worker for worker in self.workers.live() if not worker.small]),
            results=results,
            bytes={name.decode(): int(size) for name, size in stored.items()},
            events={name.decode(): int(number) for name, number in counted.items()},
        )
