"""What the store returns, but for jobs: claims, events, workers, counts; and its errors."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

from pydantic import BaseModel

from grazemap.wire import ProcessRequest, Waiting, WorkerState
from grazemap_worker.planning import Lane, Plan, Tile
from grazemap_worker.planning.limits import MOST_RESULT_BYTES
from grazemap_worker.store.keys import ASSEMBLY

FailureKind = Literal["exception", "lost", "hung", "timeout", "memory"]
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
    """The right to compute one tile, for as long as the holder's lease is renewed."""

    job_id: str
    """The job."""
    tile: int
    """Index of the tile in the plan; ASSEMBLY: all tiles are done, and are to be joined."""
    holder: str
    """The worker that has the claim."""
    fingerprint: str
    """The numerics that the job is computed with."""
    process: str
    """Name of the process."""
    canonical: dict[str, Any]
    """The request as the store holds it."""
    request: ProcessRequest
    """The same, parsed."""
    core_version: str
    """Version of the core that the job is computed with."""
    plan: Plan
    """How the job is cut into tiles."""
    lane: Lane = "short"
    """The job's lane now."""
    left_seconds: float = math.inf
    """Processor time that the job may still take."""

    @property
    def seconds(self) -> float:
        """The processor time that it is expected to take."""
        return self.plan.seconds_of_tile

    @property
    def assembly(self) -> bool:
        """Whether this is the step that puts the finished tiles together."""
        return self.tile == ASSEMBLY

    @property
    def rectangle(self) -> Tile:
        """The tile's part of the grid."""
        return self.plan.tile(self.tile)


@dataclass(frozen=True, slots=True)
class Asker:
    """Who asks for a job."""

    name: str = "anonymous"
    """Of the key, or of the client; those without either are one asker."""
    priority: int = 5
    """0 to 9; each step doubles the share."""
    weight: float = 1.0
    """Share of the workers, relative to other askers."""
    most_tiles: int | None = None
    """Maximum unfinished tiles of all jobs of this asker; None: no limit."""
    group: str = ""
    """Of jobs, in which lists show this one too; empty: none."""


ANYBODY = Asker()


class Submission(NamedTuple):
    """A request for a process, and what is known of it."""

    process: str
    """Name of the process."""
    request: ProcessRequest
    """The request."""
    plan: Plan
    """How it is cut into tiles, and the estimate of the cost."""
    kernels: str
    """Name of the kernels that it needs."""


class Bell(NamedTuple):
    """The queue of the workers that may compute a new job."""

    fingerprint: str
    """The numerics of these workers; empty: none is alive."""
    small: bool
    """Whether the job is a small one."""


class QuotaUsed(QueueFull):
    """The asker has too much unfinished work already."""


@dataclass(frozen=True, slots=True)
class Finished:
    """What was computed of a claim.

    Raises
    ------
    ResultTooLarge
        Over `MOST_RESULT_BYTES`.
    """

    claim: Claim
    """The claim."""
    data: bytes
    """The npz of the tile, or of the result of the whole job."""
    seconds: float
    """Processor time that it took."""
    whole: bool = True
    """Whether `data` is the result of the whole job."""
    lasting: bool = True
    """Whether it is the answer whenever the request is made again; else it can be fetched, but is computed again
    then."""

    def __post_init__(self) -> None:
        """Check the size."""
        if len(self.data) > MOST_RESULT_BYTES:
            raise ResultTooLarge(len(self.data), MOST_RESULT_BYTES)


@dataclass(frozen=True, slots=True)
class Event:
    """One entry of a job's stream."""

    id: str
    """Orders the entries; a client resumes from it."""
    name: str
    """Kind of the event."""
    text: str
    """JSON of its data."""

    @property
    def data(self) -> dict[str, Any]:
        """What happened. Raises ValueError if the text is none of JSON."""
        data: dict[str, Any] = json.loads(self.text)
        return data


@dataclass(frozen=True, slots=True)
class ResultInfo:
    """A result that is stored."""

    size: int
    """Size of its npz in bytes."""
    etag: str
    """Its strong entity tag, in hex, without quotes."""
    data: bytes | None = None
    """The npz, if it was read."""


@dataclass(frozen=True, slots=True)
class WorkerInfo:
    """A live worker."""

    name: str
    """Its name."""
    fingerprint: str
    """The numerics that it computes with."""
    core_version: str = ""
    """Version of its core."""
    kernels: frozenset[str] = frozenset()
    """The kernels that it has compiled or loaded, as `planning.Plan.kernels` names them."""
    small: bool = False
    """Whether it computes the tiles of small jobs only, in its own process."""


# What is counted; metrics begin with 0.
EVENT_KINDS = (
    *(f"failures:{kind}" for kind in get_args(FailureKind)),
    "overran:small",
    "overran:short",
    "poisoned:records",
    "poisoned:entries",
    *(f"ended:{name}" for name in ("worker", "supervisor", "service", "redis")),
    "hung:worker",
)


class Counts(BaseModel):
    """What the store holds and what happens in it."""

    jobs: dict[str, int]
    """By status."""
    pending_tiles: int
    """Number of unfinished tiles."""
    results: int
    """Number of stored results."""
    bytes: dict[str, int]
    """Stored bytes by kind."""
    events: dict[str, int]
    """How often something happened."""
    budget: int | None = None
    """Bytes that results and tiles may take; None until a worker has said it."""
    waiting: dict[str, Waiting]
    """By lane."""
    workers: list[WorkerState]
    """The live ones."""
    claimed_seconds: float
    """The longest time for which a tile has been held, also by a worker that is gone."""


@dataclass(frozen=True, slots=True)
class Persistence:
    """How Redis writes to its disk, and its memory."""

    writes_ok: dict[str, bool]
    """Whether the last write of each kind succeeded."""
    memory_bytes: int
    """Memory that it uses."""
    memory_limit_bytes: int
    """Limit of this memory; 0: none."""
