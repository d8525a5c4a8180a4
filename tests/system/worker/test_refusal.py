"""The allowed fields of an entry: each field that RQ acts on is refused by name."""

from __future__ import annotations

from pathlib import Path

import pytest
from rq.job import Job
from rq.webhook import Webhook

from grazemap_worker.queue import bells
from grazemap_worker.queue.refusal import refusal
from grazemap_worker.store import Store
from tests.support.hostile import ACTING, hostile_entries

# What an entry tells of itself and nothing acts on: its call and name, its times, its limits (each tested), its worker.
INERT = {
    *("_id", "created_at", "connection", "serializer", "log", "redis_server_version"),
    *("_data", "_func_name", "_instance", "_args", "_kwargs", "description", "origin"),
    *("enqueued_at", "started_at", "ended_at", "last_heartbeat", "worker_name", "_status"),
    *("timeout", "result_ttl"),
    *("_result", "_exc_info", "_cached_result", "_unreadable_meta"),
    *(f"_{kind}_callback" for kind in ("success", "failure", "stopped")),
    *(f"_{kind}_callback_timeout" for kind in ("success", "failure", "stopped")),
}


def test_entries_that_the_service_enqueues_are_executed(store: Store) -> None:
    for _ in range(2):
        bells.ring(store.redis, "f", small=True)
    jobs = bells.queue(store.redis, "f", small=True).get_jobs()
    assert [refusal(job) for job in jobs] == [None] * 2


def test_each_hostile_entry_is_refused_with_its_reason(store: Store, tmp_path: Path) -> None:
    queue = bells.queue(store.redis, "f", small=False)
    hostile = hostile_entries(tmp_path, queue)
    for entry, _ in hostile:
        queue.enqueue_job(entry)
    fetched = [Job.fetch(entry.id, store.redis, serializer=queue.serializer) for entry, _ in hostile]
    assert [refusal(entry) for entry in fetched] == [reason for _, reason in hostile]


def test_every_attribute_of_an_rq_job_is_known(store: Store) -> None:
    """A version of RQ with another attribute fails here: it acts, and belongs in `ACTING`, or it is inert."""
    job = bells.queue(store.redis, "f", small=False).create_job(bells.DRAIN, args=(), timeout=-1)
    acting = {name for changes, _ in ACTING for name in changes}
    assert set(vars(job)) - INERT == acting


def test_a_field_of_a_later_rq_is_refused(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    written = Job.to_dict
    monkeypatch.setattr(Job, "to_dict", lambda job: {**written(job), "planted": 1})
    job = bells.queue(store.redis, "f", small=False).create_job(bells.DRAIN, args=(), timeout=-1)
    assert refusal(job) == "carries planted"


def test_several_fields_are_all_named(store: Store) -> None:
    job = bells.queue(store.redis, "f", small=False).create_job(bells.DRAIN, args=(), timeout=-1)
    job.webhooks, job.repeats_left = [Webhook("http://127.0.0.1:9/", "finished")], 1
    assert refusal(job) == "carries repeats_left, webhooks"
