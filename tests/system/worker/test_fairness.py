"""Which tiles are claimed next: requesters get equal shares, small and short jobs come first; what is kept longest."""

from __future__ import annotations

from collections import Counter

import pytest

from grazemap.wire import Estimate, GrazingCurvesRequest, Job, UnfoldingMapsRequest
from grazemap_worker.planning import Plan
from grazemap_worker.store import Claim, QuotaExceeded, Requester, Store, WorkerInfo
from tests.support import submitting
from tests.support.steps import commit_result, commit_tile, job_of, register

LEASE = 5.0
KERNELS = frozenset({"curves", "maps"})
LARGE = WorkerInfo("large", "f", "1", KERNELS)
SMALL = WorkerInfo("small", "f", "1", KERNELS, small=True)
TILES = 100
HOUR = Plan(rows=TILES, estimate=Estimate(tiles=TILES, seconds=100.0))
EIGHT = Plan(rows=8, estimate=Estimate(tiles=8, seconds=8.0))


@pytest.fixture(autouse=True)
def worker(store: Store) -> None:
    """A live worker, so that jobs are bound."""
    store.workers.renew(LARGE, LEASE)


def submit_map(store: Store, number: int, plan: Plan = HOUR, requester: Requester = Requester("one")) -> Job:  # noqa: B008
    request = UnfoldingMapsRequest(omega=[1, 2 + number], clearance=[1, 2])
    return submitting.submit(store, "unfolding-maps", request, "1", plan, 10**6, requester)[0]


def submit_curve(store: Store, number: int, requester: Requester = Requester("one")) -> Job:  # noqa: B008
    request = GrazingCurvesRequest(omega=[1, 2 + number])
    return submitting.submit(store, "grazing-curves", request, "1", Plan(), 10**6, requester)[0]


def claimed(store: Store, times: int, worker: WorkerInfo = LARGE) -> list[Claim]:
    """What a worker claims, one visit after another; nothing of it is committed."""
    return [claim for _ in range(times) for claim in store.tiles.claim_next(worker, LEASE)[0]]


def test_a_flow_of_another_program_is_passed_over(store: Store) -> None:
    store.redis.zadd("grazemap:4:flows:f", {"no flow of ours": -1.0})
    job = submit_map(store, 0)
    assert set(store.tiles.waiting("f")) == {("long", "maps")}
    assert [claim.job_id for claim in claimed(store, 1)] == [job.id]


def test_jobs_share_the_workers_tile_by_tile(store: Store) -> None:
    jobs = [submit_map(store, number) for number in range(10)]
    counts = Counter(claim.job_id for claim in claimed(store, 50))
    assert counts == {job.id: 5 for job in jobs}


def test_every_requester_has_the_same_share_whatever_it_queued(store: Store) -> None:
    many = [submit_map(store, number).id for number in range(20)]
    other = submit_map(store, 100, requester=Requester("two"))
    counts = Counter("one" if claim.job_id in many else claim.job_id for claim in claimed(store, 40))
    assert abs(counts["one"] - counts[other.id]) <= 1


def test_a_short_job_of_another_requester_overtakes_fifty_maps(store: Store) -> None:
    for number in range(51):
        submit_map(store, number)
    claimed(store, 30)
    short = submit_map(store, 100, EIGHT, Requester("two"))
    claims = claimed(store, 12)
    assert sum(claim.job_id == short.id for claim in claims) == 8


def test_a_weight_and_a_priority_are_shares(store: Store) -> None:
    heavy = submit_map(store, 0, requester=Requester("one", weight=3.0))
    light = submit_map(store, 1, requester=Requester("two"))
    counts = Counter(claim.job_id for claim in claimed(store, 40))
    assert counts[heavy.id] == pytest.approx(3 * counts[light.id], abs=2)
    urgent = submit_map(store, 2, requester=Requester("three", priority=7))
    counts = Counter(claim.job_id for claim in claimed(store, 64))
    assert counts[urgent.id] == pytest.approx(4 * counts[light.id], abs=3)


def test_one_who_asks_again_more_urgently_raises_the_priority_of_the_job(store: Store) -> None:
    job, other = submit_map(store, 0), submit_map(store, 1, requester=Requester("two"))
    assert submit_map(store, 0, requester=Requester("three", priority=8)).id == job.id
    counts = Counter(claim.job_id for claim in claimed(store, 45))
    assert counts[job.id] == pytest.approx(8 * counts[other.id], abs=2)


def test_a_job_that_became_a_long_one_has_the_share_of_long_ones(store: Store) -> None:
    quarter = Plan(rows=TILES, estimate=Estimate(tiles=TILES, seconds=20.0))
    moved = submit_map(store, 0, quarter)
    (first,) = claimed(store, 1)
    store.tiles.move_to_next_lane(moved.id, first.tile, LARGE.name, 0.0)
    short = submit_map(store, 1, quarter, requester=Requester("two"))
    counts = Counter(claim.job_id for claim in claimed(store, 45))
    assert counts[short.id] == pytest.approx(8 * counts[moved.id], abs=2)


def test_what_takes_longer_than_estimated_counts(store: Store) -> None:
    slow, quick = submit_map(store, 0), submit_map(store, 1, requester=Requester("two"))
    counts: Counter[str] = Counter()
    for claim in claimed(store, 1) + claimed(store, 1):
        commit_tile(store, claim.job_id, claim.tile, b"", "f", 10.0 if claim.job_id == slow.id else 1.0)
    counts.update(claim.job_id for claim in claimed(store, 9))
    assert counts == {quick.id: 9}


def test_small_jobs_are_claimed_together_by_workers_of_their_own(store: Store) -> None:
    submit_map(store, 0)
    jobs = [submit_curve(store, number) for number in range(20)]
    claims, waiting = store.tiles.claim_next(SMALL, LEASE)
    assert waiting == ("grazing-curves", jobs[16].id)
    assert [claim.job_id for claim in claims] == [job.id for job in jobs[:16]]
    claims, waiting = store.tiles.claim_next(SMALL, LEASE)
    assert (len(claims), waiting) == (4, None)
    assert [claim.process for claim in claimed(store, 2)] == ["unfolding-maps"] * 2


def test_a_small_tile_that_failed_is_computed_in_a_process_of_its_own(store: Store) -> None:
    job = submit_curve(store, 0)
    claimed(store, 1, SMALL)
    assert store.tiles.record_failure(job.id, 0, "lost", "small") == "retry"
    assert claimed(store, 1, SMALL) == []
    assert [claim.job_id for claim in claimed(store, 1)] == [job.id]


def test_tiles_wait_for_their_kernels(store: Store) -> None:
    request = UnfoldingMapsRequest(omega=[1, 2], clearance=[1, 2], observables=["rms_displacement"])
    job, _ = submitting.submit(store, "unfolding-maps", request, "1", HOUR, 10**6)
    assert claimed(store, 1) == []
    assert set(store.tiles.waiting("f")) == {("long", "map_observables")}
    store.workers.set_compiling("map_observables", "kernels for observables")
    assert job_of(store, job.id).waiting_for == "kernels for observables"
    more = WorkerInfo("more", "f", "1", KERNELS | {"map_observables"})
    assert [claim.tile for claim in claimed(store, 2, more)] == [0, 1]


def test_a_quota_is_of_one_requester(store: Store) -> None:
    limited = Requester("one", max_tiles=150)
    submit_map(store, 0, requester=limited)
    with pytest.raises(QuotaExceeded):
        submit_map(store, 1, requester=limited)
    submit_map(store, 1, requester=Requester("two", max_tiles=150))
    submit_map(store, 2, EIGHT, limited)


def test_a_job_goes_on_while_anybody_is_interested(store: Store) -> None:
    job = submit_map(store, 0)
    submit_map(store, 0, requester=Requester("two"))
    assert store.jobs.dismiss(job.id, "one")
    assert store.jobs.status(job.id) == "accepted"
    assert store.jobs.dismiss(job.id, "a stranger")
    assert not store.jobs.dismiss(job.id, "two")
    assert store.jobs.status(job.id) == "dismissed"


def test_a_subscription_runs_out_unless_its_requester_looks(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.SUBSCRIPTION_SECONDS", 0)
    jobs = [submit_map(store, number, requester=Requester("gone")) for number in range(3)]
    monkeypatch.setattr("grazemap_worker.store.jobs.SUBSCRIPTION_SECONDS", 900)
    for number in range(3):
        submit_map(store, number, requester=Requester("two"))
    store.jobs.get(jobs[1].id, "gone")
    store.jobs.get(jobs[2].id, "a stranger")
    assert [store.jobs.dismiss(job.id, "two") for job in jobs] == [False, True, False]


def test_everybodys_job_can_be_dismissed(store: Store) -> None:
    job = submit_map(store, 0)
    assert not store.jobs.dismiss(job.id, "two", everyone=True)
    assert store.jobs.status(job.id) == "dismissed"


def test_many_small_jobs_leave_the_maps_alone(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_SMALL_RECORDS", 10)
    budget = Store(store.redis, result_bytes=1000)
    maps = [submit_map(store, number, Plan(estimate=Estimate(seconds=1.0))) for number in range(3)]
    for job in maps:
        assert commit_result(budget, job.id, bytes(200), "f", 1.0)
    for number in range(60):
        assert commit_result(budget, submit_curve(store, number).id, bytes(20), "f", 0.0)
    assert [store.results.info(job.id) is not None for job in maps] == [True] * 3
    assert store.counts().bytes["results:small"] <= 250
    assert sum(store.counts().jobs.values()) <= 3 + 11


def test_tiles_count_against_the_budget(store: Store) -> None:
    budget = Store(store.redis, result_bytes=1000)
    done = submit_map(store, 0, Plan(estimate=Estimate(seconds=1.0)))
    assert commit_result(budget, done.id, bytes(600), "f", 1.0)
    running = submit_map(store, 1)
    assert commit_tile(budget, running.id, 0, bytes(500), "f", 1.0) == TILES - 1
    assert store.results.info(done.id) is None  # a result can be computed again
    assert commit_tile(budget, running.id, 1, bytes(501), "f", 1.0) == -2
    assert store.counts().bytes == {"tiles": 500, "results:large": 0, "requests": store.counts().bytes["requests"]}
    store.jobs.dismiss(running.id, everyone=True)
    assert store.counts().bytes["tiles"] == 0


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("total", b"many"),
        ("request", b"\xff"),
        ("estimate", b"{}{"),
        ("created", b"noon"),
        ("plan", b"[]"),
        ("unit", None),
    ],
)
def test_an_unreadable_record_is_forgotten_and_can_be_asked_again(
    store: Store, field: str, value: bytes | None
) -> None:
    job, good = submit_map(store, 0), submit_map(store, 1)
    if value is None:
        store.redis.hdel(f"grazemap:4:job:{job.id}", field)
    else:
        store.redis.hset(f"grazemap:4:job:{job.id}", field, value)
    claims = claimed(store, 4)
    assert [listed.id for listed in store.jobs.page()[0]][:1] == [good.id]
    assert {claim.job_id for claim in claims} <= {job.id, good.id}
    assert good.id in {claim.job_id for claim in claims}
    again = submit_map(store, 0)
    assert again.status in ("accepted", "running")
    assert store.jobs.get(job.id) is not None


def test_given_back_tiles_are_claimed_first(store: Store) -> None:
    job = submit_map(store, 0)
    assert [claim.tile for claim in claimed(store, 3)] == [0, 1, 2]
    store.workers.remove("large", return_claims=True)
    register(store, "large", "f", LEASE, "1")
    assert sorted(claim.tile for claim in claimed(store, 4)) == [0, 1, 2, 3]
    assert store.redis.exists(f"grazemap:4:job:{job.id}:failures") == 0
