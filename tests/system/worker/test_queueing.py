"""Bells in RQ's queues: ringing, taking, and cleaning up after workers that were killed."""

from __future__ import annotations

import os

import pytest
from rq.exceptions import StopRequested

from grazemap_worker.queue import bells, leftovers
from grazemap_worker.queue.drainer import Drainer
from grazemap_worker.store import Store
from tests.support.planted import INFO


def test_a_few_bells_wait_at_a_time(store: Store) -> None:
    for _ in range(10):
        bells.ring(store.redis, "f", small=False)
    assert bells.queue(store.redis, "f", small=False).count == bells.MOST_WAITING
    assert bells.queue(store.redis, "f", small=True).count == 0


def test_the_cleanup_removes_what_killed_workers_took(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    queue = bells.queue(store.redis, "f", small=True)
    for _ in range(2):
        bells.ring(store.redis, "f", small=True)
    _, waiting = queue.get_job_ids()
    store.redis.lmove(queue.key, queue.intermediate_queue_key, "LEFT", "RIGHT")
    store.redis.lpush(queue.intermediate_queue_key, b"\xff\xfe")
    swept = leftovers.Leftovers("f")
    swept.sweep(store.redis)
    assert store.redis.llen(queue.intermediate_queue_key) == 2  # a worker may be about to drop it
    monkeypatch.setattr(leftovers, "TAKEN_SECONDS", -1.0)
    swept.sweep(store.redis)
    assert store.redis.llen(queue.intermediate_queue_key) == 0
    assert queue.get_job_ids() == [waiting]
    assert len(list(store.redis.scan_iter("rq:job:*"))) == 1


@pytest.mark.parametrize("entry", [b"\xff\xfe", b"", b"of another program", b"a" * 100_000])
def test_entries_that_are_no_bells_end_no_worker(store: Store, entry: bytes) -> None:
    drained: list[int] = []

    def drain() -> None:
        drained.append(os.getpid())
        raise StopRequested

    queue = bells.queue(store.redis, INFO.fingerprint, small=False)
    store.redis.rpush(queue.key, entry)
    bells.ring(store.redis, INFO.fingerprint, small=False)
    Drainer(store, INFO, drain).work(logging_level=None, burst=True)
    assert len(drained) == 1
    assert store.redis.llen(queue.key) == 0
    assert store.workers.live() == []


def test_an_entry_that_cannot_be_read_is_counted(store: Store) -> None:
    store.redis.rpush(bells.queue(store.redis, INFO.fingerprint, small=False).key, b"\xff\xfe")
    Drainer(store, INFO, lambda: None).work(logging_level=None, burst=True)
    assert store.counts().events == {"poisoned:entries": 1}
