"""Jobs: the list, one job, and its dismissal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal
from urllib.parse import urlencode

from anyio.to_thread import run_sync
from fastapi import APIRouter, Query, Response

from grazemap.wire import FINISHED, PROCESSES, Job, JobList, Link, Note, Status
from grazemap_service.context import CurrentContext
from grazemap_service.jobs import NAME, PREFIX, CurrentRequester, KnownJob, job_response, stored_job, with_links
from grazemap_service.openapi import problem_responses
from grazemap_service.problems import invalid

router = APIRouter(tags=["jobs"])
GOES_ON = Note(code="goes-on", detail="others asked for the job too, so it goes on; DELETE with ?for=all stops it")


@router.get(
    "/v1/jobs",
    operation_id="list_jobs",
    summary="Jobs, newest first",
    response_model=JobList,
    responses=problem_responses("invalid-request"),
)
@router.head("/v1/jobs", include_in_schema=False)
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
        bool | None, Query(description="`true`: only jobs that take milliseconds; `false`: only the others.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=500, description="Jobs on one page.")] = 50,
    cursor: Annotated[
        str | None,
        Query(
            max_length=64,
            description="From the link `next` of a page.",
            pattern="^[0-9]{1,18}$",
        ),
    ] = None,
) -> Response:
    """List the jobs that the service stores, a page at a time; requests over 4 kB are left out (null)."""
    if process is not None and process not in PROCESSES:
        raise invalid("?process", "There is no such process", ", ".join(sorted(PROCESSES)))

    def listed() -> bytes:
        selected_jobs, following = context.store.jobs.page(status, process, limit, cursor, group, small)
        selected = {"status": status, "process": process, "group": group, "limit": limit}
        if small is not None:
            selected["small"] = str(small).lower()
        page = JobList(jobs=[with_links(job) for job in selected_jobs], links=_links(selected, following))
        return page.model_dump_json().encode()

    text = await run_sync(listed, limiter=context.threads)
    return Response(text, media_type="application/json", headers={"Cache-Control": "no-store"})


def _links(selected: Mapping[str, str | int | None], following: str | None) -> list[Link]:
    """Return the links of a page, with its filters: to the first page, and to the next page if there is one."""
    query = {name: value for name, value in selected.items() if value is not None}
    links = [Link(href=f"{PREFIX}/jobs?{urlencode(query)}", rel="first")]
    if following is not None:
        links.append(Link(href=f"{PREFIX}/jobs?{urlencode(query | {'cursor': following})}", rel="next"))
    return links


@router.get(
    "/v1/jobs/{job_id}",
    operation_id="get_job",
    summary="One job",
    response_model=Job,
    responses=problem_responses("unknown-job"),
)
@router.head("/v1/jobs/{job_id}", include_in_schema=False)
async def get_job(job: KnownJob) -> Response:
    """Return a job's request, status, progress and links."""
    return job_response(job, 200)


@router.delete(
    "/v1/jobs/{job_id}",
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
        Query(alias="for", description="`me`: the job stops only if nobody else asked for it; `all`: it stops."),
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
        return stored.model_copy(update={"notes": [*stored.notes, GOES_ON]})

    return job_response(await run_sync(dismiss, limiter=context.threads), 200)
