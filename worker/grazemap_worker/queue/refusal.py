"""Refuses entries of the queue that are not bells.

The serializer is no protection: a program that can write to Redis can name any function, method, callback or address to
post to, and can make RQ repeat an entry, enqueue others after it, or add it to other registries. So an entry may have
only the fields that `bells.ring` writes. One with any other field is refused, even if this version of RQ ignores it.
"""

from __future__ import annotations

from typing import Any

from rq.exceptions import DeserializationError, NoSuchJobError
from rq.job import Job

from grazemap_worker.queue.bells import DRAIN

_FIELDS = {
    "created_at",
    "data",
    "description",
    "enqueued_at",
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
    """Return why an entry must not be performed, or None."""
    try:
        name, arguments, keywords, instance = job.func_name, job.args, job.kwargs, job.instance
    except DeserializationError:
        return "unreadable"
    if name != DRAIN or instance is not None:
        return "not a function of ours"
    if keywords or arguments:
        return "not the arguments of a bell"
    if others := sorted(field for field, value in job.to_dict().items() if value and field not in _FIELDS):
        return f"carries {', '.join(others)}"
    if job.result_ttl:
        return "is kept after its end"
    if job.timeout != -1:
        return "has another time limit"
    return None
