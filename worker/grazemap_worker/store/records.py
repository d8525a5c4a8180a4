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
    """The right to compute one tile, for as long as the holder's lease is renewed.

    `canonical` is the request as the store holds it, `request` the same parsed; `lane` is the job's now, and
    `left_seconds` the processor time that it may still take.
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
    lane: Lane = "short"
    left_seconds: float = math.inf

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
    """Who asks for a job.

    Attributes
    ----------
    name : str
        Of the key, or of the client; those without either are one asker.
    priority : int
        0 to 9; each step doubles the share.
    weight : float
        Share of the workers, relative to other askers.
    most_tiles : int, optional
        Maximum unfinished tiles of all jobs of this asker.
    group : str
        Of jobs, in which lists show this one too; empty: none.
    """

    name: str = "anonymous"
    priority: int = 5
    weight: float = 1.0
    most_tiles: int | None = None
    group: str = ""


ANYBODY = Asker()


class Submission(NamedTuple):
    """A request for a process, how it is cut into tiles, and the name of the kernels that it needs."""

    process: str
    request: ProcessRequest
    plan: Plan
    kernels: str


class Bell(NamedTuple):
    """The queue of the workers that may compute a new job; an empty fingerprint: none is alive."""

    fingerprint: str
    small: bool


class QuotaUsed(QueueFull):
    """The asker has too much unfinished work already."""


@dataclass(frozen=True, slots=True)
class Finished:
    """What was computed of a claim: the npz of a tile, or of the `whole` result of its job, and the processor time.

    A result that is not `lasting` can be fetched, but is computed again when the request is made again.

    Raises
    ------
    ResultTooLarge
        Over `MOST_RESULT_BYTES`.
    """

    claim: Claim
    data: bytes
    seconds: float
    whole: bool = True
    lasting: bool = True

    def __post_init__(self) -> None:
        """Check the size."""
        if len(self.data) > MOST_RESULT_BYTES:
            raise ResultTooLarge(len(self.data), MOST_RESULT_BYTES)


@dataclass(frozen=True, slots=True)
class Event:
    """One entry of a job's stream; `id` orders them and is what a client resumes from; `text` is the data's JSON."""

    id: str
    name: str
    text: str

    @property
    def data(self) -> dict[str, Any]:
        """What happened. Raises ValueError if the text is none of JSON."""
        data: dict[str, Any] = json.loads(self.text)
        return data


@dataclass(frozen=True, slots=True)
class ResultInfo:
    """Size in bytes of a result's npz, its strong entity tag (hex, without quotes), and the npz if it was read."""

    size: int
    etag: str
    data: bytes | None = None


@dataclass(frozen=True, slots=True)
class WorkerInfo:
    """A live worker.

    Attributes
    ----------
    name, fingerprint, core_version : str
    kernels : frozenset of str
        The kernels that it has compiled or loaded, as `planning.Plan.kernels` names them.
    small : bool
        Whether it computes the tiles of small jobs only, in its own process.
    """

    name: str
    fingerprint: str
    core_version: str = ""
    kernels: frozenset[str] = frozenset()
    small: bool = False


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
    """What the store holds and what happens in it.

    Attributes
    ----------
    jobs : dict
        By status.
    pending_tiles, results : int
        Unfinished tiles, and stored results.
    bytes, events : dict
        Stored bytes by kind, and how often something happened.
    budget : int, optional
        Bytes that results and tiles may take; None until a worker has said it.
    waiting : dict
        By lane.
    workers : list
        The live ones.
    claimed_seconds : float
        The longest time for which a tile has been held, also by a worker that is gone.
    """

    jobs: dict[str, int]
    pending_tiles: int
    results: int
    bytes: dict[str, int]
    events: dict[str, int]
    budget: int | None = None
    waiting: dict[str, Waiting]
    workers: list[WorkerState]
    claimed_seconds: float


@dataclass(frozen=True, slots=True)
class Persistence:
    """Whether the last write of each kind to Redis' disk succeeded, and its memory; limit 0: none."""

    writes_ok: dict[str, bool]
    memory_bytes: int
    memory_limit_bytes: int
