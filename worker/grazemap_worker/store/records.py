"""What the store returns, but for jobs: claims, events, workers, counts; and its errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from grazemap.wire import ProcessRequest
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.store.keys import ASSEMBLY

FailureKind = Literal["exception", "lost", "timeout"]
Verdict = Literal["retry", "failed"]


class QueueFull(Exception):
    """There is too much unfinished work already; `retry_after` is in seconds."""

    def __init__(self, retry_after: int) -> None:
        super().__init__(f"the queue is full; try again in {retry_after} s")
        self.retry_after = retry_after


class ResultTooLarge(Exception):
    """The result is too large for the store; it was not sent."""

    def __init__(self, size: int, most: int) -> None:
        super().__init__(f"the result takes {size} bytes; at most {most} are stored: ask for fewer values")


@dataclass(frozen=True, slots=True)
class Claim:
    """The right to compute one tile, for as long as the holder's lease is renewed.

    `canonical` is the request as the store holds it, `request` the same parsed.
    """

    job_id: str
    tile: int
    holder: str
    fingerprint: str
    process: str
    canonical: dict[str, Any]
    request: ProcessRequest
    core_version: str
    plan: Plan

    @property
    def assembly(self) -> bool:
        """Whether this is the step that puts the finished tiles together."""
        return self.tile == ASSEMBLY

    @property
    def rectangle(self) -> Tile:
        """The tile's part of the grid."""
        return self.plan.tile(self.tile)


@dataclass(frozen=True, slots=True)
class Event:
    """One entry of a job's stream; `id` orders them and is what a client resumes from."""

    id: str
    name: str
    data: dict[str, Any]


@dataclass(frozen=True, slots=True)
class ResultInfo:
    """Size in bytes of a result's npz, and its strong entity tag (hex, without quotes)."""

    size: int
    etag: str


@dataclass(frozen=True, slots=True)
class WorkerInfo:
    """A live worker."""

    name: str
    fingerprint: str
    core_version: str


@dataclass(frozen=True, slots=True)
class Counts:
    """What the store holds: jobs by status, unfinished tiles, live workers, results and their bytes."""

    jobs: dict[str, int]
    pending_tiles: int
    workers: int
    results: int
    result_bytes: int
