"""The state of a service: what GET /v1/status answers."""

from __future__ import annotations

from grazemap.wire.base import Response


class Computing(Response):
    """A tile that is computed, since how many seconds; tile -1 joins the finished tiles of a map."""

    job: str
    process: str | None = None
    tile: int
    seconds: float


class WorkerState(Response):
    """A live worker, and what it computes; `small`: it computes small jobs only."""

    small: bool = False
    core_version: str = ""
    computes: Computing | None = None


class Waiting(Response):
    """Jobs that have tiles to compute, and the longest time for which one of them has had none taken."""

    jobs: int
    seconds: float


class ServiceStatus(Response):
    """What a service does, and what has failed since its store began.

    `jobs` are counted by status, `stored_bytes` by kind, and `events` by kind: failed attempts at tiles, unreadable
    records and entries, processes that ended. `waiting` has small, short and long jobs. `claimed_seconds` is the
    longest time for which a tile has been held. `budget_bytes` is the limit of results and tiles together, None if no
    worker has said it. `ready` is false while Redis refuses writes; `detail` then says why, or what the
    workers do while none is there.
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
