"""Entries that would do something besides a tile, if they were performed, with what `refusal` says of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rq import Queue
from rq.job import Job
from rq.webhook import Webhook

from grazemap_worker.queue.wake_ups import WAKE_UP_FUNCTION

# Attributes of an entry that make RQ act, at its end or when it fails, and the field that tells of each.
ACTING: list[tuple[dict[str, Any], str]] = [
    ({"_success_callback_name": "os.mkdir"}, "success_callback_name"),
    ({"_failure_callback_name": "os.mkdir"}, "failure_callback_name"),
    ({"_stopped_callback_name": "os.mkdir"}, "stopped_callback_name"),
    ({"webhooks": [Webhook("http://127.0.0.1:9/", "finished")]}, "webhooks"),
    ({"repeats_left": 3}, "repeats_left"),
    ({"repeat_intervals": [1]}, "repeat_intervals"),
    ({"rate_limit_key": "of somebody else"}, "rate_limit_key"),
    ({"rate_limit_concurrency": 1}, "rate_limit_concurrency"),
    ({"retries_left": 3}, "retries_left"),
    ({"number_of_retries": 1}, "number_of_retries"),
    ({"retry_intervals": [1]}, "retry_intervals"),
    ({"enqueue_at_front_on_retry": True}, "enqueue_at_front_on_retry"),
    ({"enqueue_at_front": True}, "enqueue_at_front"),
    ({"_dependency_ids": ["another"]}, "dependency_id, dependency_ids"),
    ({"allow_dependency_failures": True}, "allow_dependency_failures"),
    ({"group_id": "of somebody else"}, "group_id"),
    ({"ttl": 600}, "ttl"),
    ({"failure_ttl": 60}, "failure_ttl"),
    ({"meta": {"a": 1}}, "meta"),
]


def hostile_entries(folder: Path, queue: Queue) -> list[tuple[Job, str]]:
    """Entries that would make a folder, post something, or have RQ do more than once what they say; and the refusal."""

    def entry(**changes: object) -> Job:
        job = queue.create_job(WAKE_UP_FUNCTION, args=("grazing-curves", "a"), result_ttl=0, timeout=-1)
        for name, value in changes.items():
            setattr(job, name, value)
        return job

    arguments = "not the arguments of a wake-up"
    return [
        (queue.create_job("os.mkdir", args=(str(folder / "function"),)), "not a function of ours"),
        (queue.create_job("os.mkdir", args=(str(folder / "k"),), kwargs={"mode": 0o700}), "not a function of ours"),
        (entry(data=b'["mkdir", "os", ["x"], {}]'), "not a function of ours"),
        (entry(data=b"not JSON"), "unreadable"),
        (entry(data=json.dumps([WAKE_UP_FUNCTION, None, [["x"], 0], {}]).encode()), arguments),
        (entry(data=json.dumps([WAKE_UP_FUNCTION, None, None, {}]).encode()), arguments),
        (entry(data=json.dumps([WAKE_UP_FUNCTION, None, "xy", {}]).encode()), arguments),
        (entry(data=json.dumps([WAKE_UP_FUNCTION, None, ["x"], {}]).encode()), arguments),
        (entry(data=json.dumps([WAKE_UP_FUNCTION, None, ["x", "y"], {"tile": 1}]).encode()), arguments),
        *((entry(**changes), f"carries {fields}") for changes, fields in ACTING),
        (entry(result_ttl=-1), "is kept after its end"),
        (entry(result_ttl=None), "is kept after its end"),
        (entry(timeout=60), "has a time limit"),
        (entry(timeout=10**6), "has a time limit"),
    ]
