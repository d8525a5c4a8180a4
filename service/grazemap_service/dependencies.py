"""What routers ask for: the app's context, and the job that a path names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Path, Request
from fastapi.concurrency import run_in_threadpool

from grazemap.models import Job
from grazemap_service.logs import bind_job
from grazemap_service.metrics import Metrics
from grazemap_service.problems import ProblemException
from grazemap_service.representations import HotResults, Renderings
from grazemap_service.settings import Settings
from grazemap_worker.store import Store

_JOB_ID = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True)
class Context:
    """What one app holds for its lifetime."""

    settings: Settings
    core_version: str
    store: Store
    metrics: Metrics
    hot: HotResults
    renderings: Renderings


async def get_context(request: Request) -> Context:
    """Return the context of the app that serves a request."""
    context: Context = request.app.state.context
    return context


CurrentContext = Annotated[Context, Depends(get_context)]


async def known_job(
    job_id: Annotated[str, Path(description="The job's id: 64 hexadecimal digits.")], context: CurrentContext
) -> Job:
    """Return the job that the path names. Raises ProblemException "unknown-job"."""
    job = await run_in_threadpool(context.store.job, job_id) if _JOB_ID.fullmatch(job_id) else None
    if job is None:
        raise ProblemException("unknown-job")
    bind_job(job.id)
    return job


KnownJob = Annotated[Job, Depends(known_job)]
