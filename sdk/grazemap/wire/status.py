"""The state of a service: what GET /v1/status answers."""

from __future__ import annotations

from grazemap.wire.base import Response


class Computing(Response):
    """A tile that a worker computes, and for how many seconds so far; tile -1 joins the finished tiles of a map."""

    job: str
    process: str | None = None
    tile: int
    seconds: float


class WorkerState(Response):
    """A live worker; `small`: it computes small jobs only. `computes` is None while it computes nothing."""

    small: bool = False
    core_version: str = ""
    computes: Computing | None = None


class Waiting(Response):
    """Number of jobs that have tiles to compute, and the longest time that one of them has waited for a worker."""

    jobs: int
    seconds: float


class ServiceStatus(Response):
    """What a service does, and what has failed since its store was created.

    `ready` is false while Redis refuses writes; `detail` then says why. While the service is ready and has no worker,
    `detail` says so, or what the workers that are starting do. `jobs` are counted by status, `pending_tiles` are the
    tiles that are not finished, and `waiting` has the keys "small", "short" and "long". `claimed_seconds` is the
    longest time that a worker has held a tile. `stored_bytes` are counted by kind; `budget_bytes` is the limit of
    results and tiles together, None if no worker has reported it yet. `events` are counted by kind: failed attempts at
    tiles, unreadable records and entries, processes that ended.
    """

    version: str
    ready: bool
    detail: str = ""
    workers: list[WorkerState]
    jobs: dict[str, int]
    pending_tiles: int
    waiting: dict[str, Waiting]
    claimed_seconds: float
    stored_bytes: dict[str, int]
    budget_bytes: int | None
    events: dict[str, int]
