"""Entries in RQ's queues: queueing, finding, removing and cleaning up."""

from __future__ import annotations

import pytest

from grazemap_worker.queue import entries, leftovers
from grazemap_worker.store import Store

ID, OTHER = "a" * 64, "b" * 64


def test_queued_entries_are_found_and_removed(store: Store) -> None:
    assert entries.enqueue(store.redis, ID, [0, 5, -1], "f") == 3
    assert entries.enqueue(store.redis, OTHER, [7], "f") == 1
    assert entries.queued(store.redis, "f") == {(ID, 0), (ID, 5), (ID, -1), (OTHER, 7)}
    assert entries.queued(store.redis, "g") == set()
    assert entries.cancel(store.redis, ID, "f") == 3
    assert entries.queued(store.redis, "f") == {(OTHER, 7)}
    assert len(list(store.redis.scan_iter("rq:job:*"))) == 1


def test_a_single_tile_goes_before_a_map(store: Store) -> None:
    entries.enqueue(store.redis, ID, range(3), "f")
    entries.enqueue(store.redis, OTHER, [0], "f")
    assert entries.parse_entry(entries.queue(store.redis, "f").get_job_ids()[0]) == (OTHER, 0)


def test_single_tiles_do_not_starve_each_other_or_a_map(store: Store) -> None:
    queue = entries.queue(store.redis, "f")
    entries.enqueue(store.redis, ID, range(3), "f")
    for number in range(2 * entries.MOST_OVERTAKING):
        entries.enqueue(store.redis, f"{number:064}", [0], "f")
    waiting = [entries.parse_entry(entry) for entry in queue.get_job_ids()]
    assert waiting[entries.MOST_OVERTAKING] == (ID, 0)
    assert waiting[-1] == (f"{2 * entries.MOST_OVERTAKING - 1:064}", 0)
    # under a load that never lets up, whatever waits is reached all the same
    target = f"{2 * entries.MOST_OVERTAKING - 1:064}"
    for taken in range(10 * len(waiting)):
        entry = entries.parse_entry(str(queue.pop_job_id()))
        assert entry is not None
        if entry[0] == target:
            break
        entries.enqueue(store.redis, f"{1000 + taken:064}", [0], "f")
    else:
        raise AssertionError("never reached")


def test_the_assembly_goes_first(store: Store) -> None:
    for number in range(2 * entries.MOST_OVERTAKING):
        entries.enqueue(store.redis, f"{number:064}", [0], "f")
    entries.enqueue(store.redis, ID, [-1], "f")
    assert entries.parse_entry(entries.queue(store.redis, "f").get_job_ids()[0]) == (ID, -1)


def test_a_huge_map_is_queued_piece_by_piece(store: Store) -> None:
    assert entries.enqueue(store.redis, ID, range(10**6), "f") == entries.QUEUED_AHEAD


@pytest.mark.parametrize("entry", ["", "x", "-", "a-b", "a-b-c", "a-1.5-c"])
def test_entries_of_other_programs_are_not_taken_for_tiles(entry: str) -> None:
    assert entries.parse_entry(entry) is None


def test_the_cleanup_removes_what_killed_workers_left(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    queue = entries.queue(store.redis, "f")
    entries.enqueue(store.redis, ID, [0, 1], "f")
    taken, waiting = queue.get_job_ids()
    store.redis.lmove(queue.key, queue.intermediate_queue_key, "LEFT", "RIGHT")
    store.redis.zadd(queue.started_job_registry.key, {f"{taken}:execution": 1.0})
    leftovers.sweep(store.redis, "f")
    assert store.redis.zcard(queue.started_job_registry.key) == 0
    assert store.redis.llen(queue.intermediate_queue_key) == 1  # a worker may be about to begin it
    monkeypatch.setattr(leftovers, "TAKEN_SECONDS", 0.0)
    leftovers.sweep(store.redis, "f")
    assert store.redis.llen(queue.intermediate_queue_key) == 0
    assert queue.get_job_ids() == [waiting]
