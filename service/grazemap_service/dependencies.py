"""The dependencies of routes: the app's context, and the job that a path names."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any, TypeVar

import anyio
import anyio.to_thread
from fastapi import Depends, Path, Request

from grazemap.wire import Job
from grazemap_service.logs import bind_job
from grazemap_service.metrics import Metrics
from grazemap_service.problems import ProblemException
from grazemap_service.representations import Renderings
from grazemap_service.settings import Settings
from grazemap_worker.store import Store

Answer = TypeVar("Answer")
_STORE_THREADS = 40
_JOB_ID = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Context:
    """The objects of one app."""

    settings: Settings
    core_version: str
    store: Store
    metrics: Metrics
    renderings: Renderings
    # apart from the framework's: threads that wait for a Redis that hangs do not delay other pages
    threads: anyio.CapacityLimiter = field(default_factory=lambda: anyio.CapacityLimiter(_STORE_THREADS))

    async def ask(self, call: Callable[..., Answer], *arguments: Any) -> Answer:
        """Return what a call that asks the store returns, from a thread."""
        return await anyio.to_thread.run_sync(partial(call, *arguments), limiter=self.threads)


async def get_context(request: Request) -> Context:
    """Return the context of the app that serves a request."""
    context: Context = request.app.state.context
    return context


CurrentContext = Annotated[Context, Depends(get_context)]


async def known_job(
    job_id: Annotated[str, Path(description="The job's id: 64 hexadecimal digits.")], context: CurrentContext
) -> Job:
    """Return the job that the path names. Raises ProblemException "unknown-job"."""
    job = await context.ask(context.store.jobs.get, job_id) if _JOB_ID.fullmatch(job_id) else None
    if job is None:
        raise ProblemException("unknown-job")
    bind_job(job.id)
    return job


KnownJob = Annotated[Job, Depends(known_job)]
