"""Jobs: the list, one job, and its dismissal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal
from urllib.parse import urlencode

from anyio.to_thread import run_sync
from fastapi import APIRouter, Query, Response

from grazemap.wire import FINISHED, PROCESSES, Job, JobList, Link, Note, Status
from grazemap.wire.notes import GOES_ON
from grazemap_service.context import CurrentContext
from grazemap_service.jobs import NAME, PREFIX, CurrentRequester, KnownJob, job_response, stored_job, with_links
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import invalid

router = APIRouter(tags=["jobs"])
JOB_GOES_ON = Note(code=GOES_ON, detail="others asked for the job too, so it goes on; DELETE with ?for=all stops it")


@router.get(
    f"{PREFIX}/jobs",
    operation_id="list_jobs",
    summary="Jobs, newest first",
    response_model=JobList,
    responses=problem_responses("invalid-request"),
)
@router.head(f"{PREFIX}/jobs", include_in_schema=False)
async def list_jobs(
    context: CurrentContext,
    status: Annotated[Status | None, Query(description="Only jobs of this status.")] = None,
    process: Annotated[
        str | None, Query(description="Only jobs of this process.", json_schema_extra={"enum": sorted(PROCESSES)})
    ] = None,
    group: Annotated[
        str | None, Query(max_length=64, pattern=NAME, description="Only jobs submitted with this `Grazemap-Group`.")
    ] = None,
    small: Annotated[
        bool | None,
        Query(
            description="`true`: only small jobs, which have one tile and an estimate below 0.05 s; `false`: only jobs "
            "that are not small."
        ),
    ] = None,
    limit: Annotated[int, Query(ge=1, le=500, description="Jobs on one page.")] = 50,
    cursor: Annotated[
        str | None,
        Query(
            max_length=64,
            description="The value of `cursor` in the link `next` of the previous page.",
            pattern="^[0-9]{1,18}$",
        ),
    ] = None,
) -> Response:
    """List the jobs that the service stores, a page at a time. `request` is null for a job with a request over 4 kB."""
    if process is not None and process not in PROCESSES:
        raise invalid("?process", "There is no such process", ", ".join(sorted(PROCESSES)))

    def listed() -> bytes:
        jobs, next_cursor = context.store.jobs.page(status, process, limit, cursor, group, small)
        filters = {"status": status, "process": process, "group": group, "limit": limit}
        if small is not None:
            filters["small"] = str(small).lower()
        page = JobList(jobs=[with_links(job) for job in jobs], links=_links(filters, next_cursor))
        return page.model_dump_json().encode()

    text = await run_sync(listed, limiter=context.threads)
    return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


def _links(filters: Mapping[str, str | int | None], next_cursor: str | None) -> list[Link]:
    """Return the links of a page, with its filters: to the first page, and to the next page if there is one."""
    query = {name: value for name, value in filters.items() if value is not None}
    links = [Link(href=f"{PREFIX}/jobs?{urlencode(query)}", rel="first")]
    if next_cursor is not None:
        links.append(Link(href=f"{PREFIX}/jobs?{urlencode(query | {'cursor': next_cursor})}", rel="next"))
    return links


@router.get(
    PREFIX + "/jobs/{job_id}",
    operation_id="get_job",
    summary="One job",
    response_model=Job,
    responses=problem_responses("unknown-job"),
)
@router.head(PREFIX + "/jobs/{job_id}", include_in_schema=False)
async def get_job(job: KnownJob) -> Response:
    """Return a job's request, status, progress and links."""
    return job_response(job, 200)


@router.delete(
    PREFIX + "/jobs/{job_id}",
    operation_id="dismiss_job",
    summary="Dismiss a job",
    response_model=Job,
    responses=problem_responses("unknown-job"),
)
async def dismiss_job(
    job: KnownJob,
    context: CurrentContext,
    requester: CurrentRequester,
    whose: Annotated[
        Literal["me", "all"],
        Query(
            alias="for",
            description="`me`: the job stops only if nobody else asked for it. `all`: the job stops for everybody.",
        ),
    ] = "me",
) -> Response:
    """Withdraw your request for an unfinished job. The job stops if nobody else has asked for it.

    A finished job is not changed. The request is idempotent.
    """

    def dismiss() -> Job:
        goes_on = context.store.jobs.dismiss(job.id, requester.name, everyone=whose == "all")
        stored = stored_job(context, job.id, requester.name)
        if stored is None:  # its record has been removed meanwhile
            return job if job.status in FINISHED else job.model_copy(update={"status": "dismissed"})
        if not goes_on:
            return stored
        return stored.model_copy(update={"notes": [*stored.notes, JOB_GOES_ON]})

    return job_response(await run_sync(dismiss, limiter=context.threads), 200)
