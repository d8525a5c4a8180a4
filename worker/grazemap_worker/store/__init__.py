"""What lives in Redis: job records, tile ledger, progress, results. Used by service and worker.

Every change is one Lua script, so that any number of services and workers agree, and the first writer wins.
"""

from __future__ import annotations

from importlib.metadata import version

from redis import Redis

from grazemap_worker.store.connection import Scripts, connect, is_away, trouble
from grazemap_worker.store.keys import ASSEMBLY, MOST_RESULT_BYTES, queue_name
from grazemap_worker.store.plan import Plan, Tile, plan
from grazemap_worker.store.problems import refused_problem
from grazemap_worker.store.records import (
    Claim,
    Counts,
    Event,
    QueueFull,
    ResultInfo,
    ResultTooLarge,
    StoreError,
    WorkerInfo,
)
from grazemap_worker.store.results import ResultStore

DEFAULT_RESULT_BYTES = 2 << 30


class Store(ResultStore):
    """Everything that service and workers share.

    Parameters
    ----------
    redis : Redis
        As `connect` gives it: answers are bytes.
    result_bytes : int
        Byte budget of the results together.

    Raises
    ------
    redis.exceptions.RedisError
        From any method, when Redis is away: nothing is retried here.
    """

    def __init__(self, redis: Redis, result_bytes: int = DEFAULT_RESULT_BYTES) -> None:
        super().__init__(Scripts(redis), result_bytes)
        self.redis = redis


def core_version() -> str:
    """Return the version of the core that is installed here; part of every job's id."""
    return version("grazemap")


__all__ = [
    "ASSEMBLY",
    "MOST_RESULT_BYTES",
    "Claim",
    "Counts",
    "Event",
    "Plan",
    "QueueFull",
    "ResultInfo",
    "ResultTooLarge",
    "Store",
    "StoreError",
    "Tile",
    "WorkerInfo",
    "connect",
    "core_version",
    "is_away",
    "plan",
    "queue_name",
    "refused_problem",
    "trouble",
]
