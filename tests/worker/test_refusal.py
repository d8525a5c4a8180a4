"""The allowed fields of an entry: each field that RQ acts on is refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from hostile import ACTING, hostile_entries
from rq.job import Job
from rq.webhook import Webhook

from grazemap_worker.queue import entries
from grazemap_worker.queue.refusal import refusal
from grazemap_worker.store import Store

ID = "a" * 64
# What an entry tells of itself and nothing acts on: its call and name, its times, its limits (each tested), its worker.
INERT = {
    *("_id", "created_at", "connection", "serializer", "log", "redis_server_version"),
    *("_data", "_func_name", "_instance", "_args", "_kwargs", "description", "origin"),
    *("enqueued_at", "started_at", "ended_at", "last_heartbeat", "worker_name", "_status"),
    *("timeout", "result_ttl", "failure_ttl"),
    *("_result", "_exc_info", "_cached_result", "_unreadable_meta"),
    *(f"_{kind}_callback" for kind in ("success", "failure", "stopped")),
    *(f"_{kind}_callback_timeout" for kind in ("success", "failure", "stopped")),
}


def test_entries_that_the_service_enqueues_are_executed(store: Store) -> None:
    entries.enqueue(store.redis, ID, [0, 1, -1], "f")
    entries.enqueue(store.redis, ID, [2], "f")
    jobs = entries.queue(store.redis, "f").get_jobs()
    assert [refusal(job) for job in jobs] == [None] * 4


def test_each_hostile_entry_is_refused_with_its_reason(store: Store, tmp_path: Path) -> None:
    queue = entries.queue(store.redis, "f")
    hostile = hostile_entries(tmp_path, queue)
    for entry, _ in hostile:
        queue.enqueue_job(entry)
    fetched = [Job.fetch(entry.id, store.redis, serializer=queue.serializer) for entry, _ in hostile]
    assert [refusal(entry) for entry in fetched] == [reason for _, reason in hostile]


def test_every_attribute_of_an_rq_job_is_known(store: Store) -> None:
    """A version of RQ with another attribute fails here: it acts, and belongs in `ACTING`, or it is inert."""
    job = entries.queue(store.redis, "f").create_job(entries.RUN_TILE, args=(ID, 0))
    acting = {name for changes, _ in ACTING for name in changes}
    assert set(vars(job)) - INERT == acting


def test_a_field_of_a_later_rq_is_refused(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    written = Job.to_dict
    monkeypatch.setattr(Job, "to_dict", lambda job: {**written(job), "planted": 1})
    job = entries.queue(store.redis, "f").create_job(entries.RUN_TILE, args=(ID, 0))
    assert refusal(job) == "carries planted"


def test_several_fields_are_all_named(store: Store) -> None:
    job = entries.queue(store.redis, "f").create_job(entries.RUN_TILE, args=(ID, 0))
    job.webhooks, job.repeats_left = [Webhook("http://127.0.0.1:9/", "finished")], 1
    assert refusal(job) == "carries repeats_left, webhooks"
