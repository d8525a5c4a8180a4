"""What an entry may hold: the call of one tile, and nothing else that RQ would act on.

A serializer does not protect: whoever writes to Redis may name any function, a method of an instance, callbacks or
addresses to post to, and have RQ repeat an entry, enqueue others when it ends, or count it in a registry of theirs.
So an entry may hold the fields that `entries.enqueue` writes; one with any other is refused, whether this version of
RQ acts on it or a later one.
"""

from __future__ import annotations

from typing import Any

from rq.exceptions import DeserializationError, NoSuchJobError
from rq.job import Job

from grazemap_worker.queue.entries import RUN_TILE, TILE_TIMEOUT

_FIELDS = {
    "created_at",
    "data",
    "description",
    "enqueued_at",
    "failure_ttl",
    "origin",
    "result_ttl",
    "status",
    "timeout",
}


class Entry(Job):
    """An entry as a worker reads it: one with a field that RQ cannot read is unreadable, and ends no worker."""

    def restore(self, raw_data: Any) -> None:
        """Take the fields of an entry."""
        try:
            super().restore(raw_data)
        except NoSuchJobError:
            raise
        except Exception:
            self.data = b""


def refusal(job: Job) -> str | None:
    """Return why a job must not be performed, or None."""
    try:
        name, arguments, keywords, instance = job.func_name, job.args, job.kwargs, job.instance
    except DeserializationError:
        return "unreadable"
    if name != RUN_TILE or instance is not None:
        return "not a function of ours"
    if keywords or len(arguments) != 2 or type(arguments[0]) is not str or type(arguments[1]) is not int:
        return "not the arguments of a tile"
    if others := sorted(field for field, value in job.to_dict().items() if value and field not in _FIELDS):
        return f"carries {', '.join(others)}"
    if job.result_ttl or (job.failure_ttl or 0) < 0:
        return "is kept after its end"
    if not 0 < (job.timeout or TILE_TIMEOUT) <= TILE_TIMEOUT:
        return "has another time limit"
    return None
