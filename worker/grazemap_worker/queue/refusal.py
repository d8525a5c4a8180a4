"""Refuses entries of the queue that are not wake-ups.

JSON instead of pickle is not enough protection: a program that can write to Redis can make an entry that names any
function, method or callback, or an address that RQ posts to. The program can make RQ repeat an entry, enqueue others
after it, or add it to other registries. Therefore an entry may have only the fields that `wake_ups.wake_worker` writes.
An entry with any other field of RQ is refused, even if this version of RQ does nothing with the field.
"""

from __future__ import annotations

from typing import Any

from rq.exceptions import DeserializationError, NoSuchJobError
from rq.job import Job

from grazemap_worker.queue.wake_ups import WAKE_UP_FUNCTION
from grazemap_worker.store.records import WaitingJob

_WAKE_UP_FIELDS = {
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
    """An entry that a worker has read.

    If RQ cannot parse a field, the data of the entry is emptied, so that `refusal` returns "unreadable" and the worker
    goes on.
    """

    def restore(self, raw_data: Any) -> None:
        """Set the fields of this entry from those in Redis."""
        try:
            super().restore(raw_data)
        except NoSuchJobError:
            raise
        except Exception:
            self.data = b""


def refusal(job: Job) -> str | None:
    """Return why an entry is not a wake-up, or None if it is one."""
    try:
        name, arguments, keywords, instance = job.func_name, job.args, job.kwargs, job.instance
    except DeserializationError:
        return "unreadable"
    if name != WAKE_UP_FUNCTION or instance is not None:
        return "not a function of ours"
    texts = isinstance(arguments, list | tuple) and all(isinstance(text, str) for text in arguments)
    if keywords or not texts or len(arguments) != len(WaitingJob._fields):
        return "not the arguments of a wake-up"
    if unknown := sorted(field for field, value in job.to_dict().items() if value and field not in _WAKE_UP_FIELDS):
        return f"carries {', '.join(unknown)}"
    if job.result_ttl != 0:  # an entry without one is kept for a default time of RQ
        return "is kept after its end"
    if job.timeout != -1:
        return "has a time limit"
    return None
