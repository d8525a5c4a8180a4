"""Jobs, labels of motions and problems as the service answers them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, Literal

from grazemap.wire.base import Response

Status = Literal["accepted", "running", "successful", "failed", "dismissed"]
FINISHED: frozenset[Status] = frozenset({"successful", "failed", "dismissed"})


class Progress(Response):
    """Progress of a job, counted in `unit` ("tiles" or "steps")."""

    done: int = 0
    total: int = 1
    unit: str = "tiles"
    eta_seconds: float | None = None


class Estimate(Response):
    """Expected cost of a job: forcing periods to simulate, tiles, seconds on one core."""

    periods: float = 0.0
    tiles: int = 1
    seconds: float = 0.0


class Note(Response):
    """What is probably not meant in a request that is allowed; `code` is one of a few words, for programs."""

    code: str
    detail: str


class Forecast(Estimate):
    """The expected cost of a request that was not submitted, and what is probably not meant in it."""

    notes: list[Note] = []


class ProblemError(Response):
    """One error in a request: JSON pointer into the body, what is wrong, and what is allowed."""

    pointer: str
    detail: str
    allowed: str = ""


class Problem(Response):
    """An error after RFC 9457."""

    type: str
    title: str
    status: int
    detail: str = ""
    errors: list[ProblemError] = []


class Link(Response):
    """A link to something that belongs to a job."""

    href: str
    rel: str
    type: str = "application/json"


class Job(Response):
    """A request that was submitted, and its progress. Lists of jobs leave out long requests (None).

    `cpu_seconds` is the processor time spent on the finished part in all workers together, without packing, waiting
    and failed attempts. It is None from a service that does not count it.

    `waiting_for` says what an unfinished job waits for: kernels that are compiled, a worker, or other jobs.
    It is None while the job is computed, when it is finished, and in lists of jobs.

    `groups` are the last ones that it was submitted with.
    """

    id: str
    process: str
    request: dict[str, Any] | None
    status: Status
    progress: Progress = Progress()
    waiting_for: str | None = None
    estimate: Estimate = Estimate()
    cpu_seconds: float | None = None
    core_version: str = ""
    groups: list[str] = []
    created: str | None = None
    started: str | None = None
    finished: str | None = None
    problem: Problem | None = None
    notes: list[Note] = []
    links: list[Link] = []


class JobList(Response):
    """One page of jobs, newest first."""

    jobs: list[Job]
    links: list[Link] = []


INFINITE = -2
"""The number that stands for infinitely many impacts."""


def impacts_on(stops: Iterable[int]) -> tuple[int, int]:
    """Return the impacts on the right (1) and on the left stop (-1) as labels have them: -1 on a stop without any."""
    counts = Counter(int(stop) for stop in stops)
    return counts[1] or -1, counts[-1] or -1


def motion_label(period: int, impacts_right: int, impacts_left: int) -> str:
    """Return the label n-p_r-q_l as plain text, for example "1-2r-2l" or "1-(-1)r-(-1)l".

    INFINITE reads "1-∞r-∞l".
    """

    def count(impacts: int) -> str:
        if impacts == INFINITE:
            return "∞"
        return f"({impacts})" if impacts < 0 else str(impacts)

    return f"{period}-{count(impacts_right)}r-{count(impacts_left)}l"
