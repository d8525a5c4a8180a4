"""The store: everything that grazemap keeps in Redis, which is job records, the ledger of tiles, results and workers.

The service and the workers use it. Every change is one Lua script, so any number of services and workers may run at
once. Of two commits of the same tile or result, the first wins.
"""

from __future__ import annotations

from grazemap.version import __version__
from grazemap_worker.store.connection import connect, is_away, is_full, trouble
from grazemap_worker.store.keys import ASSEMBLY
from grazemap_worker.store.problems import FULL_PROBLEM
from grazemap_worker.store.records import (
    ANONYMOUS,
    EVENT_KINDS,
    BacklogFull,
    Claim,
    Finished,
    QuotaExceeded,
    Requester,
    ResultInfo,
    ResultTooLarge,
    Submission,
    WaitingJob,
    WorkerInfo,
    WorkerQueue,
)
from grazemap_worker.store.store import Store


def core_version() -> str:
    """Return the version of the core that is installed here; part of every job's id."""
    return __version__


__all__ = [
    "ANONYMOUS",
    "ASSEMBLY",
    "EVENT_KINDS",
    "FULL_PROBLEM",
    "BacklogFull",
    "Claim",
    "Finished",
    "QuotaExceeded",
    "Requester",
    "ResultInfo",
    "ResultTooLarge",
    "Store",
    "Submission",
    "WaitingJob",
    "WorkerInfo",
    "WorkerQueue",
    "connect",
    "core_version",
    "is_away",
    "is_full",
    "trouble",
]
