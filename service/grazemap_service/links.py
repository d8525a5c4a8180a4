"""The links of a job: where its state, events and result are."""

from __future__ import annotations

from grazemap.wire import FINISHED, Job, Link

PREFIX = "/v1"
NPZ_TYPE = "application/x-npz"
# The relation of OGC API - Processes for a job's results.
RESULTS_RELATION = "http://www.opengis.net/def/rel/ogc/1.0/results"


def job_path(job_id: str) -> str:
    """Return the path of a job."""
    return f"{PREFIX}/jobs/{job_id}"


def with_links(job: Job) -> Job:
    """Return the job with its links, as far as they lead somewhere in its present state."""
    path = job_path(job.id)
    links = [
        Link(href=path, rel="self"),
        Link(href=f"{path}/events", rel="monitor", type="text/event-stream"),
        Link(href=f"{path}/result/tiles", rel="tiles"),
    ]
    if job.status == "successful":
        links.append(Link(href=f"{path}/result?f=json", rel=RESULTS_RELATION, type="application/json"))
        links.append(Link(href=f"{path}/result?f=npz", rel=RESULTS_RELATION, type=NPZ_TYPE))
    if job.status not in FINISHED:
        links.append(Link(href=path, rel="cancel"))
    return job.model_copy(update={"links": links})
