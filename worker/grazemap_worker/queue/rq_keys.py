"""The undocumented names of RQ's keys in Redis. An entry is what RQ calls a job.

They are read from RQ's objects, so that the environment variable RQ_KEY_PREFIX applies. RQ_KEY_PREFIX must have the
same value for every service and worker on one Redis.
"""

from __future__ import annotations

from rq import Queue, Worker
from rq.executions import WORKER_EXECUTIONS_KEY_TEMPLATE
from rq.job import Job
from rq.worker_registration import WORKERS_BY_QUEUE_KEY

ALL_QUEUES = Queue.redis_queues_keys
"""The key of a set with the key of every queue, queues of other applications included."""
ALL_WORKERS = Worker.redis_workers_keys
"""The key of a set with the key of every worker, workers of other applications included."""


def entry_key(entry_id: str) -> str:
    """Return the key of an entry, which is a hash."""
    return Job.key_for(entry_id)


def queue_name_of(queue_key: str) -> str:
    """Return the name of the queue that has this key."""
    return queue_key.removeprefix(Queue.redis_queue_namespace_prefix)


def waiting_key(queue: Queue) -> str:
    """Return the key of the list with the ids of a queue's waiting entries."""
    return str(queue.key)


def taken_key(queue: Queue) -> str:
    """Return the key of the list with the ids of entries that workers have taken from a queue but not begun."""
    return str(queue.intermediate_queue_key)


def started_key(queue: Queue) -> str:
    """Return the key of the set of running executions ("entry:execution"), sorted by the time when they expire."""
    return str(queue.started_job_registry.key)


def failed_key(queue: Queue) -> str:
    """Return the key of the set of failed entries, sorted by the time when they expire."""
    return str(queue.failed_job_registry.key)


def worker_keys(worker_name: str) -> tuple[str, str]:
    """Return the key of the description of a worker, and the key of the set of the worker's executions."""
    return Worker.redis_worker_namespace_prefix + worker_name, WORKER_EXECUTIONS_KEY_TEMPLATE.format(worker_name)


def listeners_key(queue_name: str) -> str:
    """Return the key of the set of workers that listen to a queue."""
    return str(WORKERS_BY_QUEUE_KEY % queue_name)
