"""What the store takes and returns besides jobs: claims, requesters, events, workers, counts; and its errors."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, get_args

from pydantic import BaseModel

from grazemap.wire import ProcessRequest, Waiting, WorkerState
from grazemap_worker.planning import Lane, Plan
from grazemap_worker.planning.limits import MAX_RESULT_BYTES
from grazemap_worker.store.keys import ASSEMBLY

FailureKind = Literal["exception", "lost", "hung", "timeout", "memory"]
Verdict = Literal["retry", "failed"]


class BacklogFull(Exception):
    """There are too many unfinished tiles; a request may succeed after `retry_after` seconds."""

    def __init__(self, retry_after: int) -> None:
        super().__init__(f"the queue is full; try again in {retry_after} s")
        self.retry_after = retry_after


class ResultTooLarge(Exception):
    """The result is too large for the store; it was not sent."""

    def __init__(self, size: int, max_size: int) -> None:
        super().__init__(f"the result takes {size} bytes; at most {max_size} are stored: ask for fewer values")


@dataclass(frozen=True, slots=True)
class Claim:
    """The right of a worker to compute a tile, as long as the worker renews its lease."""

    job_id: str
    """The job."""
    tile: int
    """Index of the tile in the plan; ASSEMBLY: all tiles are finished and are to be joined."""
    holder: str
    """The worker that has the claim."""
    fingerprint: str
    """Fingerprint of the numerics that the job is computed with."""
    process: str
    """Name of the process."""
    canonical: dict[str, Any]
    """The canonical form of the request, as it is stored."""
    request: ProcessRequest
    """The parsed request."""
    core_version: str
    """Version of the core that the job is computed with."""
    plan: Plan
    """How the job is cut into tiles."""
    lane: Lane = "short"
    """The present lane of the job."""
    left_seconds: float = math.inf
    """Processor time that the job may still take."""

    @property
    def assembly(self) -> bool:
        """Whether this is the step that joins the finished tiles."""
        return self.tile == ASSEMBLY


@dataclass(frozen=True, slots=True)
class Requester:
    """The person or program that asks for a job."""

    name: str = "anonymous"
    """Name of its key or, without keys, of the client; all requests without either have the same requester."""
    priority: int = 5
    """0 to 9; each step doubles the share of the workers."""
    weight: float = 1.0
    """Share of the workers, relative to other requesters."""
    max_tiles: int | None = None
    """Maximum number of unfinished tiles of all its jobs; None: no limit."""
    group: str = ""
    """Name of the group of jobs to which the job is added; empty: none."""


ANONYMOUS = Requester()


class Submission(NamedTuple):
    """A request for a process, with its plan."""

    process: str
    """Name of the process."""
    request: ProcessRequest
    """The request."""
    plan: Plan
    """How the request is cut into tiles, and the estimate of its cost."""
    kernels: str
    """Name of the kernels that the request needs."""


class WorkerQueue(NamedTuple):
    """The queue of the workers that may compute a new job."""

    fingerprint: str
    """Fingerprint of these workers; empty: no worker is alive."""
    small: bool
    """Whether it is the queue for small jobs."""


class WaitingJob(NamedTuple):
    """A job with tiles that can be claimed."""

    process: str
    """Name of its process."""
    id: str
    """Its id."""


class QuotaExceeded(BacklogFull):
    """The requester has too many unfinished tiles."""


@dataclass(frozen=True, slots=True)
class Finished:
    """A finished tile, or the result of a whole job.

    Raises
    ------
    ResultTooLarge
        `data` has more than `MAX_RESULT_BYTES`.
    """

    claim: Claim
    """The claim."""
    data: bytes
    """The npz of the tile, or of the result of the whole job."""
    seconds: float
    """Processor time of the computation."""
    whole: bool = True
    """Whether `data` is the result of the whole job."""
    lasting: bool = True
    """Whether the result also answers later submissions of the request; otherwise it can be fetched, but a later
    submission computes it again."""

    def __post_init__(self) -> None:
        """Check the size."""
        if len(self.data) > MAX_RESULT_BYTES:
            raise ResultTooLarge(len(self.data), MAX_RESULT_BYTES)


@dataclass(frozen=True, slots=True)
class JobEvent:
    """One entry of a job's stream."""

    id: str
    """The id, which orders the entries; a client resumes the stream after an id."""
    name: str
    """Kind of the event."""
    text: str
    """JSON of its data."""

    @property
    def data(self) -> dict[str, Any]:
        """The data of the event. Raises ValueError if the text is not JSON."""
        data: dict[str, Any] = json.loads(self.text)
        return data


@dataclass(frozen=True, slots=True)
class ResultInfo:
    """A stored result."""

    size: int
    """Size of its npz in bytes."""
    etag: str
    """SHA-256 digest of its npz in hex, of which ETags are made."""
    data: bytes | None = None
    """The npz, if it was read from the store."""


@dataclass(frozen=True, slots=True)
class WorkerInfo:
    """A live worker."""

    name: str
    """Its name."""
    fingerprint: str
    """Fingerprint of its numerics."""
    core_version: str = ""
    """Version of its core."""
    kernels: frozenset[str] = frozenset()
    """Names of the kernels that it has loaded, as `processes.kernels_of` returns them."""
    small: bool = False
    """Whether it computes small tiles only, in its own process."""


# The events that are counted. Metrics contain all of them, with 0 for those that have not happened.
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
    """Number of jobs by status."""
    pending_tiles: int
    """Number of unfinished tiles."""
    results: int
    """Number of stored results."""
    bytes: dict[str, int]
    """Stored bytes by kind."""
    events: dict[str, int]
    """Number of events by kind, see `EVENT_KINDS`."""
    budget: int | None = None
    """Maximum bytes of results and tiles; None until a worker has stored it."""
    waiting: dict[str, Waiting]
    """Waiting jobs by lane."""
    workers: list[WorkerState]
    """The live workers."""
    claimed_seconds: float
    """The longest time for which a tile has been claimed, also by a worker that has ended."""


@dataclass(frozen=True, slots=True)
class Persistence:
    """The state of Redis: its writes to the disk, and its memory."""

    writes_ok: dict[str, bool]
    """Whether the last write of each kind succeeded."""
    memory_bytes: int
    """Memory that it uses."""
    memory_limit_bytes: int
    """Limit of this memory; 0: none."""
