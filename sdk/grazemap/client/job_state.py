"""The base class of the job handles of both clients: the job as last received from the service."""

from __future__ import annotations

from typing import Any

from grazemap.client.connection import AsyncConnection
from grazemap.errors import problem_text
from grazemap.results import html
from grazemap.wire import Job, Problem, ProcessRequest, Progress, Status


class JobState:
    """Base class of the handles: the job as last seen."""

    def __init__(self, connection: AsyncConnection, job: Job, request: ProcessRequest | None = None) -> None:
        self._connection = connection
        self._job = job
        self._request = request  # to submit it again if the service loses the job; None: not from this client

    @property
    def id(self) -> str:
        """The content-addressed id: equal requests to the same version of the core have the same id."""
        return self._job.id

    @property
    def process(self) -> str:
        """Name of the process, for example "unfolding-maps"."""
        return self._job.process

    @property
    def request(self) -> dict[str, Any] | None:
        """The canonical request, with all defaults; None if a list of jobs left it out as too long: call `refresh`."""
        return self._job.request

    @property
    def status(self) -> Status:
        """Status as last seen: accepted, running, successful, failed or dismissed."""
        return self._job.status

    @property
    def progress(self) -> Progress:
        """Progress as last seen."""
        return self._job.progress

    @property
    def problem(self) -> Problem | None:
        """Why the job failed, if it did."""
        return self._job.problem

    @property
    def job(self) -> Job:
        """The whole job as last seen."""
        return self._job

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id[:12]} {self.process}: {self.status}>"

    def _repr_html_(self) -> str:
        job, progress = self._job, self._job.progress
        rows = {
            "process": job.process,
            "status": job.status,
            "progress": f"{progress.done} of {progress.total} {progress.unit}",
            "waiting for": job.waiting_for,
            "estimate": f"{job.estimate.seconds:.3g} s of one core",
            "core": job.core_version,
            "note": "; ".join(note.detail for note in job.notes),
            "problem": problem_text(job.problem) if job.problem else None,
        }
        return html.table(f"Job {job.id[:12]}", rows)
