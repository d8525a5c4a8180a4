"""The answers to the first example of each process, as the API's document shows them."""

from __future__ import annotations

from typing import Any, NamedTuple

from grazemap.wire import PROCESSES, Forecast, Job, Progress, canonical_id, notes_on, parse_request, unstated
from grazemap_service.jobs import with_links
from grazemap_worker.processes import IMPLEMENTATIONS
from grazemap_worker.store import core_version

# When the job was submitted, taken by a worker, and done.
_CREATED, _STARTED, _FINISHED = (f"2026-01-02T12:00:0{second}.000Z" for second in (0, 1, 2))


class Answers(NamedTuple):
    """The answers to a request in JSON."""

    forecast: dict[str, Any]
    """The estimate."""
    new: dict[str, Any]
    """The job that has just been submitted."""
    done: dict[str, Any]
    """The same job, successful."""


def answers_to(process: str) -> Answers:
    """Return the answers to the first example of a process."""
    request = parse_request(process, dict(next(iter(PROCESSES[process].operation.examples.values()))))
    plan, values = IMPLEMENTATIONS[process].plan(request), request.canonical()
    notes = [*notes_on(request), *unstated(request)]
    progress = Progress(total=plan.tile_count + plan.after, unit="steps" if plan.after else "tiles")
    new = Job(
        id=canonical_id(process, values, core_version()),
        process=process,
        request=values,
        status="accepted",
        progress=progress,
        estimate=plan.estimate,
        core_version=core_version(),
        created=_CREATED,
        notes=notes,
    )
    ended = {"status": "successful", "progress": progress.model_copy(update={"done": progress.total})}
    times = {"started": _STARTED, "finished": _FINISHED, "cpu_seconds": plan.estimate.seconds}
    forecast = Forecast(**plan.estimate.model_dump(), notes=notes)
    return Answers(forecast.model_dump(), *(_shown(job) for job in (new, new.model_copy(update={**ended, **times}))))


def _shown(job: Job) -> dict[str, Any]:
    return with_links(job).model_dump()
