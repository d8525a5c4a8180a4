"""Refuses entries of the queue that are not the call of one tile.

The serializer is no protection: a program that can write to Redis can name any function, method, callback or address to
post to, and can make RQ repeat an entry, enqueue others after it, or add it to other registries. So an entry may have
only the fields that `entries.enqueue` writes. One with any other field is refused, even if this version of RQ ignores
it.
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
    """An entry as a worker reads it; a field that RQ cannot read makes it unreadable, but does not end the worker."""

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
