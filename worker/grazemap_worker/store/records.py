"""What the store returns: claims, events, workers, counts; and the reading of a job from its hash."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from grazemap.wire import Estimate, Job, Problem, ProcessRequest, Progress
from grazemap_worker.planning import Plan, Tile
from grazemap_worker.store.keys import ASSEMBLY

FailureKind = Literal["exception", "lost", "timeout"]
Verdict = Literal["retry", "failed"]


class StoreError(Exception):
    """Base of what the store raises itself; Redis's own errors pass through."""


class QueueFull(StoreError):
    """There is too much unfinished work already; `retry_after` is in seconds."""

    def __init__(self, retry_after: int) -> None:
        super().__init__(f"the queue is full; try again in {retry_after} s")
        self.retry_after = retry_after


class ResultTooLarge(StoreError):
    """A result that the store does not take; it was not sent."""

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
        """(row_start, row_stop, col_start, col_stop) of the tile in the grid [clearance, omega]."""
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


def timestamp(seconds: str | None) -> str | None:
    """Return seconds since the epoch as ISO 8601 in UTC."""
    if seconds is None:
        return None
    return datetime.fromtimestamp(float(seconds), UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def text_fields(record: Mapping[bytes, bytes]) -> dict[str, str]:
    """Return a hash as Redis gives it with names and values as text."""
    return {name.decode(): value.decode() for name, value in record.items()}


def read_job(job_id: str, fields: Mapping[str, str]) -> Job:
    """Return the job that a record describes, without links, which the service adds."""
    steps = fields["unit"] == "steps"
    eta, spent = fields.get("eta"), fields.get("cpu_seconds")
    problem = fields.get("problem")
    return Job.model_validate(
        {
            "id": job_id,
            "process": fields["process"],
            "request": json.loads(fields["request"]) if "request" in fields else None,
            "status": fields["status"],
            "progress": Progress(
                done=int(fields.get("steps_done" if steps else "done", 0)),
                total=int(fields.get("steps_total" if steps else "total", 1)),
                unit=fields["unit"],
                eta_seconds=float(eta) if eta is not None else None,
            ),
            "estimate": Estimate.model_validate_json(fields["estimate"]),
            "cpu_seconds": float(spent) if spent is not None else None,
            "core_version": fields["core_version"],
            "created": timestamp(fields["created"]),
            "started": timestamp(fields.get("started")),
            "finished": timestamp(fields.get("finished")),
            "problem": Problem.model_validate_json(problem) if problem else None,
        }
    )
