"""Bounds of the store and of one attempt: refused by name, and not retried without end."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from grazemap.wire import GrazingCurvesRequest, Job, UnfoldingMapsRequest
from grazemap_worker import computation, tasks
from grazemap_worker.planning import Plan
from grazemap_worker.processes import IMPLEMENTATIONS, Process
from grazemap_worker.store import BacklogFull, ResultTooLarge, Store, core_version
from grazemap_worker.store.keys import MAX_LARGE_RECORDS, MAX_SMALL_RECORDS, PREFIX
from tests.support import submitting
from tests.support.planted import INFO, NUMERICS
from tests.support.steps import commit_result, commit_tile, problem_of

LEASE = 5.0


def curve(first: float = 1.0, length: int = 2) -> GrazingCurvesRequest:
    return GrazingCurvesRequest(omega=[first + place / 8192 for place in range(length)])


def submit(store: Store, request: GrazingCurvesRequest | None = None) -> Job:
    return submitting.submit(store, "grazing-curves", request or curve(), core_version(), Plan(), 1000)[0]


def finish(store: Store, job: Job, data: bytes = b"12") -> None:
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE)
    assert commit_result(store, job.id, data, "f", 0.0)


@pytest.fixture
def worker(store: Store, monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """This process as a worker."""
    store.workers.renew(INFO, 60)
    return monkeypatch


def compute_all(store: Store) -> None:
    """Compute what is to be computed, small or not."""
    for small in (True, False):
        tasks.compute_waiting_tiles(tasks.WorkerContext(store, replace(INFO, small=small), NUMERICS))


def refused(store: Store, job: Job) -> tuple[str, int]:
    """The kind of problem with which a job has failed, and its status."""
    problem = problem_of(store, job.id)
    return problem.type.rpartition(":")[2], problem.status


def test_a_result_over_the_limit_is_not_sent(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.records.MAX_RESULT_BYTES", 10)
    job = submit(store)
    assert store.tiles.claim(job.id, 0, "w", "f", LEASE)
    with pytest.raises(ResultTooLarge, match="11 bytes"):
        commit_result(store, job.id, bytes(11), "f", 0.0)
    with pytest.raises(ResultTooLarge, match="11 bytes"):
        commit_tile(store, job.id, 0, bytes(11), "f", 0.0)
    assert commit_result(store, job.id, bytes(10), "f", 0.0)


def test_a_result_over_the_limit_fails_its_job_at_once(worker: pytest.MonkeyPatch, store: Store) -> None:
    worker.setattr("grazemap_worker.store.records.MAX_RESULT_BYTES", 10)
    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=lambda *_: {"x": np.zeros(9)})})
    job = submit(store)
    compute_all(store)
    assert refused(store, job) == ("computation-refused", 422)


@pytest.mark.thorough
def test_an_error_of_redis_that_will_come_back_is_counted(worker: pytest.MonkeyPatch, store: Store) -> None:
    worker.setattr(computation, "IMPLEMENTATIONS", {"grazing-curves": Process(whole=lambda *_: {"x": np.zeros(9)})})
    job = submit(store)
    store.redis.set("grazemap:4:results:small", "not a sorted set")
    store.redis.set("grazemap:4:results:large", "not a sorted set")
    for _ in range(3):
        compute_all(store)
    assert refused(store, job) == ("computation-failed", 500)


def test_a_tile_of_a_map_ends_in_time_even_if_nothing_settles() -> None:
    request = UnfoldingMapsRequest.model_validate(
        {
            "omega": {"start": 0.26, "stop": 0.3, "points": 200},
            "clearance": {"start": 1.3, "stop": 2.0, "points": 200},
            "max_periods": 10**6,
        }
    )
    cut = IMPLEMENTATIONS["unfolding-maps"].plan(request)
    seconds = cut.tile_rows * cut.tile_columns * request.max_periods / 1e5
    assert seconds <= tasks.MAX_CPU_SECONDS["long"] / 2


def test_records_are_under_a_byte_budget(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    size = len(json.dumps(submit(store, curve(1, 500)).request, separators=(",", ":")))
    store.redis.flushall()
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_RECORD_BYTES", 4 * size)
    waiting = submit(store, curve(1, 500))
    for number in range(2, 9):
        finish(store, submit(store, curve(number, 500)))
    kept = [job.id for job in store.jobs.page()[0]]
    assert 2 <= len(kept) <= 4
    assert waiting.id in kept  # what is unfinished is not forgotten
    assert store.counts().bytes["results:small"] == 2 * (len(kept) - 1)


def test_unfinished_requests_over_the_byte_budget_are_refused(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_RECORD_BYTES", 50_000)

    def fill() -> None:
        for number in range(1, 9):
            submit(store, curve(number, 1000))

    with pytest.raises(BacklogFull) as caught:
        fill()
    assert caught.value.retry_after >= 1
    left = store.jobs.page()[0]
    assert 1 <= len(left) < 8
    for job in left:
        store.jobs.dismiss(job.id)
    assert submit(store, curve(20, 1000)).status == "accepted"


def test_a_repeated_request_counts_once(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.jobs.MAX_RECORD_BYTES", 20_000)
    other = submit(store)
    for _ in range(10):
        store.jobs.dismiss(submit(store, curve(5, 500)).id)
    assert len(store.jobs.page()[0]) == 2
    assert store.jobs.get(other.id) is not None


def test_a_page_of_jobs_costs_what_it_shows(store: Store) -> None:
    for number in range(1, 8):
        submit(store, curve(number, 4000))
    read = int(store.redis.info("stats")["total_net_output_bytes"])
    page, cursor = store.jobs.page(limit=3)
    assert len(page) == 3
    assert cursor is not None
    assert all(job.request is None for job in page)
    assert int(store.redis.info("stats")["total_net_output_bytes"]) - read < 10_000
    assert len(store.jobs.page(limit=7, process="grazing-curves")[0]) == 7
    assert store.jobs.page(process="trajectories") == ([], None)


# Records of large jobs, newer than all that there are. Arguments: the prefix of all keys, their number.
OTHER_RECORDS = """
for i = 1, ARGV[2] do
  local seq = redis.call('INCR', ARGV[1] .. 'sequence')
  redis.call('HSET', ARGV[1] .. 'job:' .. seq, 'process', 'trajectories', 'status', 'failed', 'lane', 'map', 'seq', seq)
  redis.call('ZADD', ARGV[1] .. 'jobs', seq, seq)
end
"""


def test_no_script_examines_many_jobs_for_a_list_of_few(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """As many records as there can be of both classes, of which a filter selects the first and the last."""
    first = submit(store)
    number = MAX_SMALL_RECORDS + MAX_LARGE_RECORDS
    store.redis.eval(OTHER_RECORDS, 0, PREFIX, number)
    last = submit(store, curve(2))
    examined = []
    run = store.jobs._scripts.run

    def counted(*arguments: Any, **more: Any) -> Any:
        before = _reads(store)
        answer = run(*arguments, **more)
        examined.append(_reads(store) - before)
        return answer

    monkeypatch.setattr(store.jobs._scripts, "run", counted)
    for selected in ({"process": "grazing-curves"}, {"small": True}, {"group": "night"}):
        page, cursor = store.jobs.page(limit=2, **selected)
        assert [job.id for job in page] == ([] if "group" in selected else [last.id, first.id])
        assert cursor is None
    page, cursor = store.jobs.page(limit=1, process="grazing-curves")
    assert [job.id for job in page] == [last.id]
    page, cursor = store.jobs.page(limit=1, process="grazing-curves", cursor=cursor)
    assert ([job.id for job in page], cursor) == ([first.id], None)
    assert store.jobs.page(process="basins") == ([], None)
    assert sum(examined) > 6 * number
    assert max(examined) < number / 10


def _reads(store: Store) -> int:
    """The commands that have read records so far."""
    stats: Any = store.redis.info("commandstats")
    return sum(stats.get(f"cmdstat_{name}", {"calls": 0})["calls"] for name in ("hget", "hmget", "hgetall"))


def test_the_etag_of_an_evicted_result_is_remembered(store: Store) -> None:
    job = submit(store)
    assert store.results.etag(job.id) is None
    finish(store, job)
    info = store.results.info(job.id)
    assert info is not None
    store.redis.delete(*store.redis.keys("grazemap:4:result:*"))
    assert store.results.info(job.id) is None
    assert store.results.etag(job.id) == info.etag
    assert store.jobs.status(job.id) == "successful"
    assert store.jobs.status("0" * 64) is None


def test_a_tile_that_never_fits_drops_no_results(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store.results, "_budget", 1000)
    kept = [submit(store, curve(float(number))) for number in (1, 2, 3)]
    for job in kept:
        finish(store, job, b"x" * 100)
    request = UnfoldingMapsRequest(omega=[1, 2, 3], clearance=[1, 2])
    plan = Plan(rows=2, columns=3, tile_rows=1, tile_columns=3)
    large = submitting.submit(store, "unfolding-maps", request, core_version(), plan, 1000)[0]
    for tile in (0, 1):
        assert store.tiles.claim(large.id, tile, "w", "f", LEASE)
    assert commit_tile(store, large.id, 0, b"x" * 600, "f", 0.0) == 1
    assert commit_tile(store, large.id, 1, b"x" * 500, "f", 0.0) < 0
    assert None not in store.results.each_info([job.id for job in kept], 1000)
