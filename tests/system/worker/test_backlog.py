"""A long backlog: the cost of one request or one tile does not grow with the number of waiting jobs."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from grazemap.wire import GrazingCurvesRequest, Job
from grazemap_worker.numerics import Numerics
from grazemap_worker.planning import Plan
from grazemap_worker.queue import wake_ups
from grazemap_worker.store import BacklogFull, Store, Submission, WorkerInfo
from grazemap_worker.supervision.reconciler import Reconciler
from tests.support.steps import commit_result, commit_tile, fingerprint_of, pending, register
from tests.support.submitting import submit_curve, submit_map

LEASE = 5.0
FOUR = Plan(rows=4, columns=4, tile_rows=2, tile_columns=2)


def commands(store: Store, step: Callable[[], object]) -> int:
    """Commands that Redis performs for a step, those in scripts included."""
    store.redis.config_resetstat()
    step()
    return sum(command["calls"] for command in store.redis.info("commandstats").values())


@pytest.fixture
def backlog(store: Store) -> list[Job]:
    """Some hundred jobs that wait, a few of them claimed."""
    register(store, "w", "f", LEASE, "1")
    jobs = [submit_curve(store, number) for number in range(300)]
    for job in jobs[:3]:
        store.tiles.claim(job.id, 0, "w", "f", LEASE)
    return jobs


def test_the_claims_of_one_holder_are_found_without_asking_every_job(store: Store, backlog: list[Job]) -> None:
    expected = sorted((job.id, 0, "w") for job in backlog[:3])
    assert sorted(store.tiles.claims_of("w")) == expected
    assert commands(store, lambda: store.tiles.claims_of("w")) < 20
    assert commands(store, store.tiles.claims_of) < 20
    store.tiles.record_failure(backlog[0].id, 0, "exception", "w")
    commit_result(store, backlog[1].id, b"", "f", 0.0)
    assert store.tiles.claims_of("w") == [(backlog[2].id, 0, "w")]
    store.workers.remove("w")
    assert store.tiles.claims_of() == [(backlog[2].id, 0, "w")]
    store.tiles.record_failure(backlog[2].id, 0, "lost", holder="w")
    assert store.tiles.claims_of() == []
    assert list(store.redis.scan_iter("grazemap:4:held*")) == []


def test_a_claim_taken_over_by_another_worker_is_lost(store: Store) -> None:
    job = submit_curve(store, 0)
    store.tiles.claim(job.id, 0, "one", "f", LEASE)
    store.workers.remove("one")
    store.tiles.claim(job.id, 0, "two", "f", LEASE)
    assert store.tiles.claims_of("one") == store.tiles.claims_of() == []
    assert store.tiles.claims_of("two") == [(job.id, 0, "two")]
    store.workers.remove("two", return_claims=True)
    assert store.tiles.claims_of("two") == store.tiles.claims_of() == []
    assert list(store.redis.scan_iter("grazemap:4:held*")) == []


def test_the_unfinished_tiles_are_counted_as_jobs_come_and_go(store: Store) -> None:
    register(store, "w", "f", LEASE, "1")
    job = submit_map(store, 0, FOUR)
    submit_map(store, 1, FOUR)
    submit_curve(store, 0)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    commit_tile(store, job.id, 0, b"", "f", 0.0)
    commit_tile(store, job.id, 0, b"", "f", 0.0)
    assert store.counts().pending_tiles == 3 + 4 + 1
    for _ in range(3):
        store.tiles.claim(job.id, 3, "w", "f", LEASE)
        store.tiles.record_failure(job.id, 3, "exception", holder="w")
    assert store.counts().pending_tiles == 4 + 1
    assert submit_map(store, 0, FOUR).status == "accepted"  # goes on from the tile that it has
    assert store.counts().pending_tiles == 3 + 4 + 1
    store.redis.delete("grazemap:4:fingerprint:f")
    assert job.id in store.jobs.bind("g", "1", [job.id])  # and starts over with other numerics
    assert store.counts().pending_tiles == 4 + 4 + 1
    with pytest.raises(BacklogFull):
        submit_curve(store, 1, most=9)
    submit_curve(store, 1, most=10)
    for entry in store.jobs.page()[0]:
        store.jobs.dismiss(entry.id)
    assert store.counts().pending_tiles == 0


def test_removing_old_records_does_not_scan_the_waiting_ones(
    store: Store, backlog: list[Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = commands(store, lambda: submit_curve(store, 999))
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_SMALL_RECORDS", 0)
    assert commands(store, lambda: submit_curve(store, 1000)) < before + 10
    store.jobs.dismiss(backlog[0].id)
    submit_curve(store, 1001)
    assert store.jobs.get(backlog[0].id) is None


def test_a_claim_costs_the_same_however_many_jobs_wait(store: Store, backlog: list[Job]) -> None:
    worker = WorkerInfo("w", "f", "1", frozenset({"curves"}), small=True)
    assert commands(store, lambda: store.tiles.claim_next(worker, LEASE)) < 16 * 60


@pytest.fixture
def reconciler(store: Store, monkeypatch: pytest.MonkeyPatch) -> Reconciler:
    monkeypatch.setattr("grazemap_worker.supervision.reconciler.core_version", lambda: "1")
    return Reconciler(store, Numerics("0", "0", "0", "0", "planted", "none", "f"), "me")


def test_a_round_checks_some_of_the_jobs_and_the_next_rounds_check_the_others(
    store: Store, reconciler: Reconciler, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("grazemap_worker.supervision.reconciler.JOBS_A_ROUND", 300)
    jobs = [submit_curve(store, number) for number in range(1500)]
    reconciler.reconcile()
    bound = [fingerprint_of(store, job.id) == "f" for job in jobs]
    assert 0 < sum(bound) < 1500
    for _ in range(8):
        reconciler.reconcile()
    assert all(fingerprint_of(store, job.id) == "f" for job in jobs)


def test_a_lost_tile_can_be_claimed_after_a_round(store: Store, reconciler: Reconciler) -> None:
    job = submit_map(store, 0, FOUR)
    store.tiles.claim(job.id, 1, "dead", "f", LEASE)
    assert (job.id, 1) not in pending(store, "f")
    store.workers.remove("dead")
    reconciler.reconcile()
    assert (job.id, 1) in pending(store, "f")


def test_a_round_rings_where_tiles_wait_and_says_for_which_kernels(store: Store, reconciler: Reconciler) -> None:
    assert reconciler.reconcile() == set()
    register(store, "w", "f", LEASE, "1")
    submit_curve(store, 0)
    assert reconciler.reconcile() == {"curves"}
    queues = [wake_ups.queue(store.redis, "f", small=small) for small in (False, True)]
    assert [queue.count for queue in queues] == [0, 1]
    submit_map(store, 0, FOUR)
    for _ in range(5):
        assert reconciler.reconcile() == {"curves", "maps"}
    assert [queue.count for queue in queues] == [wake_ups.MAX_WAITING] * 2


def test_the_workers_are_counted_once_for_all_refusals_of_a_batch(
    store: Store, backlog: list[Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    requests = [GrazingCurvesRequest(omega=[1, 1000 + number]) for number in range(50)]
    asked = [Submission("grazing-curves", request, Plan(), "curves") for request in requests]
    counted: list[int] = []
    live = store.workers.live
    monkeypatch.setattr(store.workers, "live", lambda: counted.append(1) or live())
    outcomes = store.jobs.submit(asked, "1", 1)
    assert all(isinstance(outcome, BacklogFull) for outcome in outcomes)
    assert len(counted) == 1
