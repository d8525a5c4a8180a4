"""The clean-up after jobs and workers that are gone, and the memory for storing a large result."""

from __future__ import annotations

from dataclasses import asdict

import pytest

from grazemap.wire import Estimate, UnfoldingMapsRequest
from grazemap_service.redis_server import RedisServer
from grazemap_worker.planning import Plan
from grazemap_worker.queue import clean_up, wake_ups
from grazemap_worker.store import Store, WorkerInfo, connect
from tests.support import submitting
from tests.support.planted import WAITING
from tests.support.steps import commit_result, commit_tile, register
from tests.support.submitting import submit_curve

LEASE = 5.0
# a job whose events are kept
LONG = Plan(estimate=Estimate(seconds=1.0))


@pytest.mark.parametrize("end", ["successful", "dismissed"])
def test_the_events_of_a_finished_job_expire(store: Store, end: str) -> None:
    job = submit_curve(store, plan=LONG)
    store.tiles.claim(job.id, 0, "w", "f", LEASE)
    events = f"grazemap:4:job:{job.id}:events"
    assert store.redis.ttl(events) == -1
    if end == "successful":
        commit_result(store, job.id, b"", "f", 0.0)
    else:
        store.jobs.dismiss(job.id)
    assert 3500 < store.redis.ttl(events) <= 3600
    assert store.jobs.events(job.id)[-1].data == {"status": end}
    if end == "dismissed":
        submit_curve(store, plan=LONG)
        assert store.redis.ttl(events) == -1


def test_workers_that_are_gone_are_removed_from_the_lists_of_rq(store: Store) -> None:
    for name in ("rq:workers", "rq:workers:grazemap:4:f", "rq:workers:grazemap:4:g"):
        store.redis.sadd(name, "rq:worker:gone", "rq:worker:here")
    store.redis.hset("rq:worker:here", "birth", "now")
    store.redis.sadd("rq:queues", "rq:queue:grazemap:4:g", "rq:queue:of somebody else")
    store.redis.sadd("rq:workers:of somebody else", "rq:worker:gone")
    register(store, "w", "g", LEASE, "1")
    clean_up.QueueCleanUp("f").sweep(store.redis)
    for name in ("rq:workers", "rq:workers:grazemap:4:f", "rq:workers:grazemap:4:g"):
        assert store.redis.smembers(name) == {b"rq:worker:here"}
    assert store.redis.scard("rq:workers:of somebody else") == 1


def test_the_queue_of_numerics_that_are_gone_is_removed(store: Store) -> None:
    register(store, "w", "here", LEASE, "1")
    for fingerprint in ("here", "gone", "f"):
        for small in (False, True):
            wake_ups.wake_worker(store.redis, fingerprint, WAITING, small=small)
    store.redis.sadd("rq:queues", "rq:queue:of somebody else")
    clean_up.QueueCleanUp("f").sweep(store.redis)
    assert len(list(store.redis.scan_iter("rq:job:*"))) == 4
    assert store.redis.smembers("rq:queues") == {
        b"rq:queue:grazemap:4:here",
        b"rq:queue:grazemap:4:here:small",
        b"rq:queue:grazemap:4:f",
        b"rq:queue:grazemap:4:f:small",
        b"rq:queue:of somebody else",
    }
    assert list(store.redis.scan_iter("*gone*")) == []


def test_a_worker_of_a_later_release_may_have_more_fields(store: Store) -> None:
    register(store, "w", "f", LEASE, "1")
    store.redis.hset("grazemap:4:workers", "w", '{"fingerprint": "f", "core_version": "2", "cores": 3}')
    assert [asdict(worker) for worker in store.workers.live()] == [asdict(WorkerInfo("w", "f", "2"))]


def test_memory_is_freed_before_a_result_is_stored(own_redis_server: RedisServer) -> None:
    client = connect(own_redis_server.url)
    size = 16 << 20
    store = Store(client, result_bytes=size + 1000)

    def peak(number: int) -> int:
        job = submit_curve(store, number, LONG)
        store.tiles.claim(job.id, 0, "w", "f", LEASE)
        client.config_resetstat()
        assert commit_result(store, job.id, bytes(size), "f", 0.0)
        return int(client.info("memory")["used_memory_peak"])

    alone = peak(0)
    assert peak(1) < alone + size / 2
    assert store.counts().bytes["results:large"] == size
    client.close()


def test_the_tiles_of_a_map_are_read_in_a_few_steps(store: Store) -> None:
    request = UnfoldingMapsRequest(omega={"start": 1, "stop": 2, "points": 10}, clearance=[1, 2])
    cut = Plan(rows=2, columns=10, tile_rows=1, tile_columns=1)
    job, _ = submitting.submit(store, "unfolding-maps", request, "1", cut, 1000)
    for tile in (*range(15), 19):
        store.tiles.claim(job.id, tile, "w", "f", LEASE)
        commit_tile(store, job.id, tile, b"%d" % tile, "f", 0.0)
    store.redis.config_resetstat()
    assert list(store.tiles.many(job.id, range(15))) == [b"%d" % tile for tile in range(15)]
    assert list(store.tiles.many(job.id, [19, 15, 3])) == [b"19", None, b"3"]
    assert store.redis.info("commandstats")["cmdstat_hmget"]["calls"] == 2
