"""The store: jobs, tiles, results and workers on one Redis."""

from __future__ import annotations

import json

from redis import Redis
from redis.exceptions import NoPermissionError

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.jobs import Jobs
from grazemap_worker.store.keys import PREFIX
from grazemap_worker.store.ledger import Results, Tiles
from grazemap_worker.store.records import Counts, Persistence
from grazemap_worker.store.workers import Workers

DEFAULT_RESULT_BYTES = 2 << 30
# The fields of INFO that say how the last write of each kind ended.
_WRITES = {
    "file": "aof_last_write_status",
    "file-rewrite": "aof_last_bgrewrite_status",
    "snapshot": "rdb_last_bgsave_status",
}


class Store:
    """Everything that the service and the workers keep in Redis.

    Parameters
    ----------
    redis : Redis
        A client from `connect`, whose answers are bytes.
    result_bytes : int
        Maximum bytes of all results and tiles together.

    Raises
    ------
    redis.exceptions.RedisError
        Raised by any method when Redis is unavailable; no method tries again.
    """

    def __init__(self, redis: Redis, result_bytes: int = DEFAULT_RESULT_BYTES) -> None:
        scripts = Scripts(redis)
        self.redis = redis
        self._scripts = scripts
        self._result_bytes = result_bytes
        self._redis = scripts.redis
        self.workers = Workers(scripts)
        self.jobs = Jobs(scripts, self.workers)
        self.tiles = Tiles(scripts, self.jobs)
        self.results = Results(scripts, result_bytes)

    def count(self, name: str) -> None:
        """Add 1 to the number of events of a kind, for metrics."""
        self._redis.hincrby(f"{PREFIX}counts", name, 1)

    def try_write(self) -> None:
        """Write a key without meaning. Raises RedisError if Redis refuses writes."""
        self._redis.set(f"{PREFIX}written", 1, ex=60)

    def set_budget(self) -> None:
        """Store the maximum bytes of results, for metrics."""
        self._redis.set(f"{PREFIX}budget", self._result_bytes)

    def counts(self) -> Counts:
        """Return what the store holds and what happens in it, for metrics and the status."""
        counts = json.loads(self._scripts.run("counts"))
        counts["workers"] = counts["workers"] or []
        return Counts.model_validate(counts)

    def persistence(self) -> Persistence | None:
        """Return the state of Redis; None if the Redis user of this process may not read it."""
        try:
            disk, memory = (self._redis.info(section) for section in ("persistence", "memory"))
        except NoPermissionError:
            return None
        writes = {kind: disk[field] == "ok" for kind, field in _WRITES.items() if field in disk}
        return Persistence(writes, memory["used_memory"], memory.get("maxmemory", 0))
